"""Fingerprints of all that a fit depends on, part by part, so that a difference can be named."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from ...scene import parameters
from ...scene.scene import Scene
from ..driven import Driven, Numbers, Placement
from ..targets import View

_KINDS = {"meshes": "mesh", "materials": "material", "lights": "light", "images": "image", "fields": "field"}
Fingerprint = dict[str, str]


def of_scene(scene: Scene) -> Fingerprint:
    """Return the digest of each part of a scene, by its name in words."""
    found = {single: digest(getattr(scene, single)) for single in parameters.SINGLE}
    for collection in parameters.COLLECTIONS:
        for name, held in getattr(scene, collection).items():
            found[f"{_KINDS[collection]} '{name}'"] = digest(held)
    return found


def of_views(views: Iterable[View]) -> Fingerprint:
    """Return the digests of the pictures, masks and cameras of a fit."""
    found: Fingerprint = {}
    for k, view in enumerate(views):
        found |= {f"the picture of target {k}": digest(view.image), f"the mask of target {k}": digest(view.mask),
                  f"the camera of target {k}": digest(view.camera), f"the weight of target {k}": digest(view.weight),
                  f"the gain of target {k}": digest((view.gain, view.shared)),
                  f"the silhouette of target {k}": digest(view.objects)}
    return found


def of_driven(driven: Driven | None) -> Fingerprint:
    """Return the digests of the driven variables at the start."""
    found: Fingerprint = {}
    for item in () if driven is None else driven.variables:
        rest = (item.steps, item.low, item.high) if isinstance(item, Numbers) else (item.step,)
        found[f"the property '{item.path}'"] = digest((item.value, *rest))
    return found


def of_placement(placement: Placement | None) -> Fingerprint:
    """Return the digests of the values that single pictures have."""
    own = () if placement is None else placement.own
    return {f"the scene of target {k}": digest(values) for k, values in enumerate(own)}


def difference(stored: Mapping[str, str], now: Mapping[str, str]) -> str | None:
    """Name a part that only one has, or else the first that differs; None: there is none."""
    for name in stored:
        if name not in now:
            return f"there is no {name} now"
    for name in now:
        if name not in stored:
            return f"{name} is new"
    return next((f"{name} differs" for name in stored if stored[name] != now[name]), None)


def digest(value: Any) -> str:
    """Return a digest of numbers, arrays, texts, data classes and collections of them; equal values have equal ones."""
    return _digest(value, {})


def _digest(value: Any, known: dict[int, str]) -> str:
    # Nodes of textures may be shared by very many paths, so each is read once.
    if is_dataclass(value) and not isinstance(value, type):
        if id(value) not in known:
            parts = (f"{one.name}={_digest(getattr(value, one.name), known)}" for one in fields(value))
            known[id(value)] = _hashed(type(value).__qualname__, *parts)
        return known[id(value)]
    if isinstance(value, np.ndarray):
        return _hashed(f"array {value.dtype.str} {value.shape}", np.ascontiguousarray(value).tobytes())
    if isinstance(value, Mapping):
        return _hashed("mapping", *(f"{key!r}:{_digest(value[key], known)}" for key in sorted(value, key=repr)))
    if isinstance(value, (list, tuple)):
        return _hashed("list", *(_digest(one, known) for one in value))
    if isinstance(value, (set, frozenset)):
        return _hashed("set", *sorted(_digest(one, known) for one in value))
    if callable(value):
        kind = value if hasattr(value, "__qualname__") else type(value)
        return _hashed("function", f"{kind.__module__}.{kind.__qualname__}")
    return _hashed("value", repr(value))


def _hashed(*parts: str | bytes) -> str:
    found = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        found.update(len(data).to_bytes(8, "little"))
        found.update(data)
    return found.hexdigest()
