"""Light linking: which meshes a light lights, and which cast its shadow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def linked(collection: Any, objects: Mapping[str, str]) -> tuple[str, ...] | None:
    """The meshes that a receiver or blocker collection names; None: all.

    Parameters
    ----------
    collection
        Of an object's ``light_linking``; None: it has none.
    objects
        Name of each exported mesh -> full name of the object (of the instancer, for instances) that it comes from.
    """
    if collection is None:
        return None
    included, excluded = _members(collection)
    if included:
        return tuple(mesh for mesh, ob in objects.items() if ob in included and ob not in excluded)
    # A collection that only excludes means: all but these.
    return tuple(mesh for mesh, ob in objects.items() if ob not in excluded) if excluded else None


def _members(collection: Any) -> tuple[set[str], set[str]]:
    """Full names of the objects that a linking collection includes and excludes, its child collections' too."""
    sets: dict[str, set[str]] = {"INCLUDE": set(), "EXCLUDE": set()}
    for ob, entry in zip(collection.objects, collection.collection_objects, strict=True):
        sets[entry.light_linking.link_state].add(ob.name_full)
    for child, entry in zip(collection.children, collection.collection_children, strict=True):
        sets[entry.light_linking.link_state].update(ob.name_full for ob in child.all_objects)
    return sets["INCLUDE"], sets["EXCLUDE"]


def uses_linking(view_layer: Any) -> bool:
    """Whether any object of the view layer links its light or shadow."""
    return any(ob.light_linking.receiver_collection is not None or ob.light_linking.blocker_collection is not None
               for ob in view_layer.objects)  # fmt: skip
