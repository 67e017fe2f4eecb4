"""Detection of changes of a scene of which its renderer has not been informed.

A renderer holds its own copy of the scene's values. If the user changes the scene and forgets to call `update`, a
render would show the old values. `TakenOver` remembers the values at the last update and raises an error instead.
"""

from __future__ import annotations

import threading
from collections.abc import Collection, Mapping
from operator import is_
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..expression import Expression
from ..scene import parameters
from ..scene.scene import Scene

try:
    from .. import _native
except ImportError:  # with the reference engine alone each object is compared
    _native = None  # type: ignore[assignment]

# Entries of an array that are compared, evenly spaced; all entries of a small array. More entries detect smaller
# changes in place, but a comparison of all entries would cost as much as an update.
_SAMPLES = 64


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
        self._collections = {name: _Collection(getattr(scene, name)) for name in parameters.COLLECTIONS}
        self._single = {name: _Held(getattr(scene, name)) for name in parameters.SINGLE}

    def note(self, scene: Scene, paths: Collection[str]) -> None:
        """Record the values of some parameter paths after an update of these alone."""
        self._thread = threading.get_ident()
        for path in paths:
            collection, name, field = parameters.split(path)
            field = field.partition(".")[0]  # of a layer, the dict that holds it
            value = getattr(parameters.owner(scene, path)[0], field)
            if name:
                self._collections[collection].note(name, field, value)
            else:
                self._single[collection].note(field, value)

    def check(self, scene: Scene, *, camera: bool = True) -> None:
        """Raise ``ValueError`` if the scene has changed since the last update; the message names object and field.

        `camera` says whether to check the camera too. Only calls from the thread of the last update are checked, since
        other threads may render between a change and its update.
        """
        if threading.get_ident() != self._thread:
            return
        for kind, single in self._single.items():
            if camera or kind != "camera":
                _require_same(kind, single.changed(getattr(scene, kind)))
        for kind, collection in self._collections.items():
            collection.check(kind, getattr(scene, kind))


class _Collection:
    """The objects of one of the scene's collections at the last update, and their fields.

    There may be very many objects, of which few change between calls: those that the native module finds untouched are
    not compared here. It keeps the fields of objects that `_objects` keeps.
    """

    def __init__(self, held: Mapping[str, Any]) -> None:
        self._given = held
        self._names = tuple(held)
        self._objects = tuple(held.values())
        self._place = {name: k for k, name in enumerate(self._names)}
        self._held = [_Held(value) for value in self._objects]
        self._watch = None if _native is None else _native.HeldObjects(np.ndarray, _SAMPLES)
        # Which objects there are, by which names.
        self._members = None if _native is None else _native.HeldObjects(np.ndarray, _SAMPLES)
        if self._members is not None:
            self._members.hold(0, held)
        for k in range(len(self._objects)) if self._watch is not None else ():
            self._watch_anew(k)

    def note(self, name: str, field: str, value: Any) -> None:
        """Record the value of a field."""
        k = self._place[name]
        self._held[k].note(field, value)
        # Its other fields may have changed without an update: until then, the object is compared.
        if self._held[k].changed(self._objects[k]) is None:
            self._watch_anew(k)

    def check(self, kind: str, held: Mapping[str, Any]) -> None:
        """Raise ``ValueError`` if an object has changed, or has come or gone."""
        if self._watch is not None and self._has_same_members(held):
            for k in self._watch.touched():
                _require_same(_words(kind, self._names[k]), self._held[k].changed(self._objects[k]))
            return
        for name, value in held.items():
            place = self._place.get(name)
            if place is None:
                raise ValueError(f"{_words(kind, name)}: was added after the last update; call the renderer's "
                                 "update(), or make a new Renderer if it is a mesh or a field")
            _require_same(_words(kind, name), self._held[place].changed(value))
        for name in self._names if len(held) < len(self._names) else ():
            if name not in held:
                raise ValueError(f"{_words(kind, name)}: was removed after the last update; call the renderer's "
                                 "update(), or make a new Renderer if it was a mesh or a field")

    def _has_same_members(self, held: Mapping[str, Any]) -> bool:
        if held is self._given and self._members is not None and not self._members.touched():
            return True
        return len(held) == len(self._names) and all(map(is_, held.values(), self._objects)) and all(
            map(is_, held, self._names))

    def _watch_anew(self, k: int) -> None:
        if self._watch is not None:
            self._watch.hold(k, self._objects[k].__dict__)


def _require_same(words: str, changed: str | None) -> None:
    if changed is not None:
        raise ValueError(f"{words}: {changed} has changed since the last update; call the renderer's update(), and if "
                         "you give it paths, include this one")


def _words(collection: str, name: str) -> str:
    return f"{collection.removesuffix('es' if collection == 'meshes' else 's')} '{name}'"


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
