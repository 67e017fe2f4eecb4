"""Detection of changes of a scene that its renderer has not been told of.

A renderer holds its own copy of the scene's values. If the user changes the scene and forgets to call `update`, a
render would show the old values. `TakenOver` remembers the values at the last update and raises an error instead.
"""

from __future__ import annotations

import threading
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from ..expression.nodes import Expression
from ..scene import parameters
from ..scene.scene import Scene

# Entries of an array that are compared, evenly spaced; all entries of a small array. More entries detect smaller
# changes in place, but a comparison of all entries would cost as much as an update.
_SAMPLES = 64

# Collection and name of an object. Its fields: value and fingerprint of each.
_Key = tuple[str, str]
_Held = dict[str, tuple[Any, Any]]


class TakenOver:
    """Values of the fields of a scene at the last update.

    Parameters
    ----------
    scene
        The scene at the update.
    """

    def __init__(self, scene: Scene) -> None:
        self._thread = threading.get_ident()
        self._objects: dict[_Key, _Held] = {key: _held(value) for key, value in _objects(scene)}

    def note(self, scene: Scene, paths: Collection[str]) -> None:
        """Record the values of some parameter paths after an update of these alone."""
        self._thread = threading.get_ident()
        for path in paths:
            collection, name, field = parameters.split(path)
            value = getattr(parameters.owner(scene, path)[0], field)
            self._objects[collection, name][field] = value, _mark(value)

    def check(self, scene: Scene, *, camera: bool = True) -> None:
        """Raise ``ValueError`` if the scene has changed since the last update; the message names object and field.

        `camera` says whether to check the camera too. Only calls from the thread of the last update are checked, since
        other threads may render between a change and its update.
        """
        if threading.get_ident() != self._thread:
            return
        seen = set()
        for key, held in _objects(scene):
            seen.add(key)
            known = self._objects.get(key)
            if known is None:
                raise ValueError(f"{_words(key)}: was added after the last update; call the renderer's update(), "
                                 "or make a new Renderer if it is a mesh")
            if key[0] == "camera" and not camera:
                continue
            for field, (value, mark) in known.items():
                if _differs(value, mark, getattr(held, field, None)):
                    raise ValueError(f"{_words(key)}: {field} has changed since the last update; call the renderer's "
                                     "update(), and if you give it paths, include this one")
        for key in self._objects:
            if key not in seen:
                raise ValueError(f"{_words(key)}: was removed after the last update; call the renderer's update(), or "
                                 "make a new Renderer if it was a mesh")


def _objects(scene: Scene) -> Iterator[tuple[_Key, Any]]:
    for collection in parameters.SINGLE:
        yield (collection, ""), getattr(scene, collection)
    for collection in parameters.COLLECTIONS:
        for name, held in getattr(scene, collection).items():
            yield (collection, name), held


def _words(key: _Key) -> str:
    collection, name = key
    return f"{collection.removesuffix('es' if collection == 'meshes' else 's')} '{name}'" if name else collection


def _held(value: Any) -> _Held:
    return {f.name: (held := getattr(value, f.name), _mark(held)) for f in fields(value)}


def _mark(value: Any) -> Any:
    """Return a fingerprint that detects changes in place of an array or mapping; None for other values."""
    if isinstance(value, np.ndarray):
        flat = value.reshape(-1)
        return flat[:: max(1, flat.size // _SAMPLES)].tobytes()
    if isinstance(value, Mapping):
        return {key: (item, _mark(item)) for key, item in value.items()}
    return None


def _differs(old: Any, mark: Any, new: Any) -> bool:
    if new is old and mark is None:
        return False
    if isinstance(mark, dict):
        return not isinstance(new, Mapping) or mark.keys() != new.keys() or any(
            _differs(item, of_item, new[key]) for key, (item, of_item) in mark.items()
        )
    if isinstance(old, np.ndarray):
        same = isinstance(new, np.ndarray) and new.shape == old.shape and new.dtype == old.dtype and _mark(new) == mark
        return not same or (new is not old and not np.array_equal(new, old))
    # Expressions are compared by identity: a comparison by value would visit shared branches many times.
    return isinstance(old, Expression) or bool(new != old)
