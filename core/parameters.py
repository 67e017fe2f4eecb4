"""Parameter paths: ``collection.name.field``, or ``camera.field`` and ``world.field``.

Names may contain dots ("Cube.001"): the collection is what stands before the first dot, the field
what stands after the last.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from .scene import Scene

COLLECTIONS = ("meshes", "materials", "lights")
SINGLE = ("camera", "world")


def split(path: str) -> tuple[str, str, str]:
    """(collection, name, field) of a path; the name of ``camera`` and ``world`` is empty.

    Raises
    ------
    ValueError
        If the path has not this form.
    """
    collection, _, rest = path.partition(".")
    if collection in SINGLE and rest and "." not in rest:
        return collection, "", rest
    name, dot, fieldname = rest.rpartition(".")
    if collection in COLLECTIONS and dot and name and fieldname:
        return collection, name, fieldname
    raise ValueError(f"unknown parameter path '{path}'; a path is camera.FIELD, world.FIELD, meshes.NAME.FIELD, "
                     "materials.NAME.FIELD or lights.NAME.FIELD")


def owner(scene: Scene, path: str) -> tuple[Any, str]:
    """The dataclass that holds the parameter, and the field's name."""
    collection, name, fieldname = split(path)
    if collection in SINGLE:
        held = getattr(scene, collection)
    else:
        entries = getattr(scene, collection)
        if name not in entries:
            known = ", ".join(f"'{n}'" for n in entries) or "none"
            raise ValueError(f"unknown parameter path '{path}': there is no '{name}' in {collection} (there: {known})")
        held = entries[name]
    known_fields = [f.name for f in fields(held) if _is_float(getattr(held, f.name))]
    if fieldname not in known_fields:
        raise ValueError(f"unknown parameter path '{path}': '{fieldname}' is none of the fields "
                         f"{', '.join(known_fields)}")
    return held, fieldname


def get(scene: Scene, path: str) -> Any:
    """The parameter's value: a float array, or a float."""
    held, fieldname = owner(scene, path)
    return getattr(held, fieldname)


def put(scene: Scene, path: str, value: Any) -> None:
    """Replace the parameter's value by one of the same shape."""
    held, fieldname = owner(scene, path)
    old = getattr(held, fieldname)
    new = np.asarray(value, np.float64)
    if new.shape != np.shape(old):
        raise ValueError(f"'{path}' must have the shape {np.shape(old)}, not {new.shape}")
    setattr(held, fieldname, new if new.ndim else float(new))


def paths(scene: Scene) -> list[str]:
    """Every float parameter of the scene."""
    out = []
    for collection in COLLECTIONS:
        for name, held in getattr(scene, collection).items():
            out += [f"{collection}.{name}.{f.name}" for f in fields(held) if _is_float(getattr(held, f.name))]
    for collection in SINGLE:
        held = getattr(scene, collection)
        out += [f"{collection}.{f.name}" for f in fields(held) if _is_float(getattr(held, f.name))]
    return out


def _is_float(value: Any) -> bool:
    return isinstance(value, float) or (isinstance(value, np.ndarray) and np.issubdtype(value.dtype, np.floating))
