"""Detection of changes of a scene that its renderer has not been told of.

A renderer holds its own copy of the scene's values. If the user changes the scene and forgets to call `update`, a
render would show the old values. `TakenOver` remembers the values at the last update and raises an error instead.
"""

from __future__ import annotations

import threading
from collections.abc import Collection, Iterator, Mapping
from operator import is_
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..expression.nodes import Expression
from ..scene import parameters
from ..scene.scene import Scene

# Entries of an array that are compared, evenly spaced; all entries of a small array. More entries detect smaller
# changes in place, but a comparison of all entries would cost as much as an update.
_SAMPLES = 64

# Collection and name of an object.
_Key = tuple[str, str]


class _Held:
    """The values of an object's fields at the last update.

    Parameters
    ----------
    value
        The object, of one of the scene's dataclasses.
    """

    def __init__(self, value: Any) -> None:
        self._kind = type(value)
        self._values: dict[str, Any] = {}
        self._views: dict[str, tuple[NDArray[Any], bytes]] = {}  # the compared entries of contiguous arrays
        self._marks: dict[str, Any] = {}  # fingerprints of all other values that can change in place
        for field, held in value.__dict__.items():
            self.note(field, held)

    def note(self, field: str, value: Any) -> None:
        """Record the value of a field."""
        self._values[field] = value
        self._views.pop(field, None)
        self._marks.pop(field, None)
        if isinstance(value, np.ndarray) and value.flags.c_contiguous:
            view = _entries(value)
            self._views[field] = view, view.tobytes()
        elif (mark := _mark(value)) is not None:
            self._marks[field] = mark

    def changed(self, value: Any) -> str | None:
        """Return the name of a field that has changed since; None: no field has."""
        if type(value) is self._kind and self._is_untouched(value.__dict__):
            return None
        return next((field for field, old in self._values.items()
                     if _differs(old, self._mark_of(field), getattr(value, field, None))), None)

    def _mark_of(self, field: str) -> Any:
        return self._views[field][1] if field in self._views else self._marks.get(field)

    def _is_untouched(self, values: Mapping[str, Any]) -> bool:
        """Whether the fields still hold the same objects, and these the same entries.

        Scenes may have very many objects, of which few change between calls.
        """
        known = self._values
        if not all(map(is_, map(values.get, known), known.values())):
            return False
        for view, mark in self._views.values():
            if view.tobytes() != mark:
                return False
        for field, mark in self._marks.items():
            value = known[field]
            if (mark or len(value)) and _differs(value, mark, value):  # most mappings are empty
                return False
        return True


class TakenOver:
    """Values of the fields of a scene at the last update.

    Parameters
    ----------
    scene
        The scene at the update.
    """

    def __init__(self, scene: Scene) -> None:
        self._thread = threading.get_ident()
        self._objects = {key: _Held(value) for key, value in _objects(scene)}

    def note(self, scene: Scene, paths: Collection[str]) -> None:
        """Record the values of some parameter paths after an update of these alone."""
        self._thread = threading.get_ident()
        for path in paths:
            collection, name, field = parameters.split(path)
            self._objects[collection, name].note(field, getattr(parameters.owner(scene, path)[0], field))

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
                                 "or make a new Renderer if it is a mesh or a field")
            if key[0] == "camera" and not camera:
                continue
            field = known.changed(held)
            if field is not None:
                raise ValueError(f"{_words(key)}: {field} has changed since the last update; call the renderer's "
                                 "update(), and if you give it paths, include this one")
        for key in self._objects if len(seen) < len(self._objects) else ():
            if key not in seen:
                raise ValueError(f"{_words(key)}: was removed after the last update; call the renderer's update(), or "
                                 "make a new Renderer if it was a mesh or a field")


def _objects(scene: Scene) -> Iterator[tuple[_Key, Any]]:
    for collection in parameters.SINGLE:
        yield (collection, ""), getattr(scene, collection)
    for collection in parameters.COLLECTIONS:
        for name, held in getattr(scene, collection).items():
            yield (collection, name), held


def _words(key: _Key) -> str:
    collection, name = key
    return f"{collection.removesuffix('es' if collection == 'meshes' else 's')} '{name}'" if name else collection


def _entries(value: NDArray[Any]) -> NDArray[Any]:
    """Return the entries of an array that are compared: a view, if the array is contiguous."""
    flat = value.reshape(-1)
    return flat[:: max(1, flat.size // _SAMPLES)]


def _mark(value: Any) -> Any:
    """Return a fingerprint that detects changes in place of an array or mapping; None for other values."""
    if isinstance(value, np.ndarray):
        return _entries(value).tobytes()
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
