"""What a renderer has taken over from its scene, so that a forgotten update is an error and not an old picture."""

from __future__ import annotations

import threading
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from ..expression.nodes import Expression
from ..scene import parameters
from ..scene.scene import Scene

# Numbers of an array that are looked at, spread over it: all of a small one. One by itself that is changed in a large
# array is missed; looking at all would cost as much as the update.
_SAMPLES = 64

# Collection and name of an object; its fields.
_Key = tuple[str, str]
_Held = dict[str, tuple[Any, Any]]


class TakenOver:
    """The values of a scene's fields as they were at the last update.

    Parameters
    ----------
    scene
        As it is taken over.
    """

    def __init__(self, scene: Scene) -> None:
        self._thread = threading.get_ident()
        self._objects: dict[_Key, _Held] = {key: _held(value) for key, value in _objects(scene)}

    def note(self, scene: Scene, paths: Collection[str]) -> None:
        """Take over the values of some parameter paths alone."""
        self._thread = threading.get_ident()
        for path in paths:
            collection, name, field = parameters.split(path)
            value = getattr(parameters.owner(scene, path)[0], field)
            self._objects[collection, name][field] = value, _mark(value)

    def check(self, scene: Scene, *, camera: bool = True) -> None:
        """Raise ``ValueError``, naming object and field, if the scene has changed since; `camera`: also the camera.

        Other threads than the one that updates may render between a change and its update: they aren't told.
        """
        if threading.get_ident() != self._thread:
            return
        seen = set()
        for key, held in _objects(scene):
            seen.add(key)
            known = self._objects.get(key)
            if known is None:
                raise ValueError(f"{_words(key)}: was not there at the last update; call the renderer's update(), "
                                 "or make a new Renderer if it is a mesh")
            if key[0] == "camera" and not camera:
                continue
            for field, (value, mark) in known.items():
                if _differs(value, mark, getattr(held, field, None)):
                    raise ValueError(f"{_words(key)}: {field} has changed since the last update; call the renderer's "
                                     "update(), or name it among the paths that are given to it")
        for key in self._objects:
            if key not in seen:
                raise ValueError(f"{_words(key)}: is gone since the last update; call the renderer's update(), or make "
                                 "a new Renderer if it was a mesh")


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
    """What tells that an array or mapping was changed in place."""
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
    # Expressions are told apart by identity: comparing them would follow shared branches many times over.
    return isinstance(old, Expression) or bool(new != old)
