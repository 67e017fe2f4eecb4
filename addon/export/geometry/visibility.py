"""Visibility of objects to kinds of rays, and settings of visibility that Edgegrad does not support."""

from __future__ import annotations

from typing import Any

from ...problem import Report

RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")


def visible_to(ob: Any, holder: Any, view_layer: Any) -> frozenset[str]:
    """Kinds of rays that see an object.

    Parameters
    ----------
    ob
        The evaluated object.
    holder
        The object, or its instancer: both must be visible to the rays.
    view_layer
        Its collections may be visible to indirect rays only.
    """
    owner = holder.original
    rays = {ray for ray in RAYS if getattr(ob, f"visible_{ray}") and getattr(holder, f"visible_{ray}")}
    if owner.indirect_only_get(view_layer=view_layer) and not owner.holdout_get(view_layer=view_layer):
        rays.discard("camera")
    return frozenset(rays)


def terminator_offsets(ob: Any) -> list[tuple[Any, str]]:
    """List (holder, property) of the offsets of an object's shadow terminator, geometry before shading.

    They are properties of objects from Blender 5.0 on, and of Cycles' settings before; without Cycles there are none.
    """
    if hasattr(ob, "shadow_terminator_geometry_offset"):
        return [(ob, "shadow_terminator_geometry_offset"), (ob, "shadow_terminator_shading_offset")]
    cycles = getattr(ob, "cycles", None)
    names = ("shadow_terminator_geometry_offset", "shadow_terminator_offset")
    return [] if cycles is None else [(cycles, name) for name in names]


def is_holdout(holder: Any, view_layer: Any) -> bool:
    """Whether an object (or instancer) is a holdout by itself or by a collection of the view layer."""
    return bool(holder.original.holdout_get(view_layer=view_layer))


def warn_about_visibility(ob: Any, report: Report) -> None:
    """Warn of visibility settings of an object that Edgegrad does not support."""
    where = f"object '{ob.name}'"
    if ob.is_shadow_catcher:
        report.warn(where, "is a shadow catcher, which can't be rendered; it is rendered as an ordinary object")
