"""Light linking: which meshes a light illuminates, and which meshes block its light."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def linked(collection: Any, objects: Mapping[str, str]) -> tuple[str, ...] | None:
    """Return the meshes of a receiver or blocker collection; None means all meshes.

    Parameters
    ----------
    collection
        Collection of an object's ``light_linking``, or None.
    objects
        Maps each exported mesh to the full name of its object, or of the instancer for instances.
    """
    if collection is None:
        return None
    included, excluded = _members(collection)
    if included:
        return tuple(mesh for mesh, ob in objects.items() if ob in included and ob not in excluded)
    # A collection that only excludes objects means all other objects.
    return tuple(mesh for mesh, ob in objects.items() if ob not in excluded) if excluded else None


def _members(collection: Any) -> tuple[set[str], set[str]]:
    """Full names of the objects that a linking collection, with its child collections, includes and excludes."""
    sets: dict[str, set[str]] = {"INCLUDE": set(), "EXCLUDE": set()}
    for ob, entry in zip(collection.objects, collection.collection_objects, strict=True):
        sets[entry.light_linking.link_state].add(ob.name_full)
    for child, entry in zip(collection.children, collection.collection_children, strict=True):
        sets[entry.light_linking.link_state].update(ob.name_full for ob in child.all_objects)
    return sets["INCLUDE"], sets["EXCLUDE"]


def uses_linking(view_layer: Any) -> bool:
    """Whether any object of the view layer uses light or shadow linking."""
    return any(ob.light_linking.receiver_collection is not None or ob.light_linking.blocker_collection is not None
               for ob in view_layer.objects)  # fmt: skip
