"""Visibility of objects in renders and to kinds of rays, and differences between viewport and render."""

from __future__ import annotations

from typing import Any

from ..problem import Report

RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")


def visible_to(ob: Any, instancer: Any = None) -> frozenset[str]:
    """Kinds of rays that see an object; for an instance, its instancer must be visible to them too."""
    return frozenset(ray for ray in RAYS
                     if all(getattr(one, f"visible_{ray}") for one in (ob, instancer) if one is not None))  # fmt: skip


def warn_about_visibility(ob: Any, report: Report) -> None:
    """Warn of visibility settings of an object that Edgegrad does not support."""
    where = f"object '{ob.name}'"
    if ob.is_holdout:
        report.warn(where, "is a holdout, which can't be rendered; it is rendered as an ordinary object")
    if ob.is_shadow_catcher:
        report.warn(where, "is a shadow catcher, which can't be rendered; it is rendered as an ordinary object")


def rendered_objects(view_layer: Any) -> set[str]:
    """Full names of the objects of a view layer that are not hidden in renders, by themselves or their collections."""
    shown: set[str] = set()
    pending = [view_layer.layer_collection]
    while pending:
        layer = pending.pop()
        if layer.exclude or layer.collection.hide_render:
            continue
        shown.update(ob.name_full for ob in layer.collection.objects if not ob.hide_render)
        pending += layer.children
    return shown


def not_evaluated(depsgraph: Any, shown: set[str]) -> list[str]:
    """Names of meshes and lights that are visible in renders but hidden in the viewport."""
    evaluated = {ob.original.name_full for ob in depsgraph.objects}
    missing = [ob for ob in depsgraph.view_layer.objects
               if ob.name_full in shown and ob.type in ("MESH", "CURVE", "SURFACE", "FONT", "META", "LIGHT")
               and (ob.name_full not in evaluated or not ob.visible_get(view_layer=depsgraph.view_layer))]  # fmt: skip
    return [ob.name for ob in missing]


def warn_about_modifiers(ob: Any, report: Report) -> None:
    """Warn of modifiers whose viewport settings, which are exported, differ from their render settings."""
    for modifier in ob.modifiers:
        where = f"object '{ob.name}', modifier '{modifier.name}'"
        if modifier.show_viewport != modifier.show_render:
            state = "on" if modifier.show_viewport else "off"
            report.warn(where, f"differs between viewport and render; it is {state}, as in the viewport")
        levels, render_levels = (getattr(modifier, name, 0) for name in ("levels", "render_levels"))
        if modifier.show_viewport and modifier.show_render and levels != render_levels:
            report.warn(where, f"its viewport level {levels} is used, not its render level {render_levels}")
