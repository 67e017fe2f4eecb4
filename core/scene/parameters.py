"""Parameter paths: text that names a float parameter of a scene.

Grammar::

    path   = "camera." FIELD | "world." FIELD | "world.medium." FIELD
           | "meshes." NAME "." FIELD | "meshes." NAME ".attributes." LAYER
           | "meshes." NAME ".instance_attributes." LAYER
           | "materials." NAME "." FIELD | "materials." NAME ".textures." FIELD | "materials." NAME ".medium." FIELD
           | "lights." NAME "." FIELD | "images." NAME ".pixels"
           | "fields." NAME "." FIELD | "fields." NAME ".attributes." LAYER

Names may contain dots ("Cube.001"): the text before the first dot is the collection, the text after the last dot is
the field. The name of a LAYER (UV map, colours, other values) may contain dots too: it is the text after the last
".attributes." or ".instance_attributes.". An object or layer whose name contains one of these has no valid path.

The parameter "textures.FIELD" is the vector of all numbers in the expression of this field (`expression.numbers`).
The parameter "medium.FIELD" is a coefficient of the medium.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

import numpy as np

from .._check import shaped, shown
from .._fields import near
from ..expression.numbers import numbers, with_numbers
from .medium import Medium, coefficient
from .names import listed
from .scene import Scene

COLLECTIONS = ("meshes", "materials", "lights", "images", "fields")
SINGLE = ("camera", "world")
# Fields that hold a dict of parameters, and the collections whose objects have such a field.
ATTRIBUTES, INSTANCE_ATTRIBUTES, TEXTURES = "attributes.", "instance_attributes.", "textures."
# The field that holds a medium, whose own fields are parameters.
MEDIUM = "medium."
_HOLDERS = {"meshes": (ATTRIBUTES, INSTANCE_ATTRIBUTES), "materials": (TEXTURES, MEDIUM), "fields": (ATTRIBUTES,)}


def split(path: str) -> tuple[str, str, str]:
    """Split a path into (collection, name, field).

    The name is empty for ``camera`` and ``world``. The field of a layer is "attributes.LAYER", the field of an
    expression is "textures.FIELD", that of a medium is "medium.FIELD".

    Raises
    ------
    ValueError
        If the path does not follow the grammar.
    """
    if not isinstance(path, str):
        raise ValueError(f"a parameter path must be text such as 'meshes.NAME.vertices', not {shown(path)}")
    return _split(path)


@lru_cache(maxsize=1 << 14)  # each call with derivatives splits its paths several times
def _split(path: str) -> tuple[str, str, str]:
    collection, _, rest = path.partition(".")
    if collection in SINGLE and rest and "." not in rest.removeprefix(MEDIUM if collection == "world" else ""):
        return collection, "", rest
    for holder in _HOLDERS.get(collection, ()):
        name, dot, key = rest.rpartition(f".{holder}")
        if dot and name and key:
            return collection, name, holder + key
    name, dot, fieldname = rest.rpartition(".")
    if collection in COLLECTIONS and dot and name and fieldname:
        return collection, name, fieldname
    raise ValueError(f"unknown parameter path {shown(path)}; a path is camera.FIELD, world.FIELD, world.medium.FIELD, "
                     "meshes.NAME.FIELD, meshes.NAME.attributes.LAYER, meshes.NAME.instance_attributes.LAYER, "
                     "materials.NAME.FIELD, materials.NAME.textures.FIELD, materials.NAME.medium.FIELD, "
                     "lights.NAME.FIELD, images.NAME.pixels, fields.NAME.FIELD or fields.NAME.attributes.LAYER")


def owner(scene: Scene, path: str) -> tuple[Any, str]:
    """Return the dataclass that holds the parameter, and the name of the field as `split` returns it."""
    collection, name, fieldname = split(path)
    if collection in SINGLE:
        held = getattr(scene, collection)
    else:
        entries = getattr(scene, collection)
        if name not in entries:
            known = listed([f"'{n}'" for n in entries]) or "none"
            raise ValueError(f"unknown parameter path '{path}': there is no '{name}' in {collection} (known: {known})"
                             f"{near(name, entries)}")
        held = entries[name]
    if not _has_float(held, fieldname):
        raise ValueError(f"unknown parameter path '{path}': '{fieldname}' is not one of the fields "
                         f"{', '.join(_float_fields(held))}{near(fieldname, _float_fields(held))}")
    return held, fieldname


def get(scene: Scene, path: str) -> Any:
    """Return the value of the parameter: a float array, or a float."""
    return value_of(*owner(scene, path))


def value_of(held: Any, fieldname: str) -> Any:
    """Return the value of a field of a dataclass that holds it, both as `owner` returns them."""
    if (layer := layer_of(fieldname)) is not None:
        return getattr(held, layer[0])[layer[1]]
    if fieldname.startswith(TEXTURES):
        return numbers(held.textures[fieldname[len(TEXTURES) :]])
    if fieldname.startswith(MEDIUM):
        return coefficient(held.medium, fieldname[len(MEDIUM) :])
    return getattr(held, fieldname)


def put(scene: Scene, path: str, value: Any) -> None:
    """Replace the value of the parameter by one of the same shape, converted to the same type (float32 for texels).

    `Scene.validate` checks the limits of the field later.
    """
    held, fieldname = owner(scene, path)
    old = get(scene, path)
    kind = old.dtype if isinstance(old, np.ndarray) else np.float64
    new = shaped("parameter", f"'{path}'", value, np.shape(old), kind)
    if (layer := layer_of(fieldname)) is not None:
        setattr(held, layer[0], {**getattr(held, layer[0]), layer[1]: new})
    elif fieldname.startswith(TEXTURES):
        key = fieldname[len(TEXTURES) :]
        held.textures = {**held.textures, key: with_numbers(held.textures[key], new.tolist())}
    elif fieldname.startswith(MEDIUM):
        plain = tuple(new.tolist()) if new.ndim else float(new)
        held.medium = replace(held.medium, **{fieldname[len(MEDIUM) :]: plain})
    else:
        setattr(held, fieldname, new if new.ndim else float(new))


def layer_of(fieldname: str) -> tuple[str, str] | None:
    """The dict and the name of a layer of a mesh or field, if the field (as `split` returns it) is one."""
    for holder in (ATTRIBUTES, INSTANCE_ATTRIBUTES):
        if fieldname.startswith(holder):
            return holder[:-1], fieldname[len(holder) :]
    return None


def paths(scene: Scene) -> list[str]:
    """List the paths of all float parameters of the scene."""
    out = []
    for collection in COLLECTIONS:
        for name, held in getattr(scene, collection).items():
            out += [f"{collection}.{name}.{field}" for field in _float_fields(held)]
    for collection in SINGLE:
        out += [f"{collection}.{field}" for field in _float_fields(getattr(scene, collection))]
    return out


def _float_fields(held: Any) -> Iterator[str]:
    for f in fields(held):
        value = getattr(held, f.name)
        if f.name + "." in (ATTRIBUTES, INSTANCE_ATTRIBUTES):
            yield from (f"{f.name}.{layer}" for layer in value)
        elif f.name + "." == TEXTURES:
            yield from (TEXTURES + key for key, expression in value.items() if len(numbers(expression)))
        elif isinstance(value, Medium):
            yield from (MEDIUM + one.name for one in fields(value))
        elif _is_float(value):
            yield f.name


def _has_float(held: Any, fieldname: str) -> bool:
    """Whether `fieldname` is in `_float_fields(held)`, without a visit to the other fields."""
    if fieldname.startswith((ATTRIBUTES, INSTANCE_ATTRIBUTES, TEXTURES, MEDIUM)):
        return fieldname in _float_fields(held)
    return fieldname in held.__dataclass_fields__ and _is_float(getattr(held, fieldname))


def _is_float(value: Any) -> bool:
    return isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype.kind == "f")
