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


def warn_about_visibility(ob: Any, report: Report) -> None:
    """Warn of visibility settings of an object that Edgegrad does not support."""
    where = f"object '{ob.name}'"
    if ob.is_holdout:
        report.warn(where, "is a holdout, which can't be rendered; it is rendered as an ordinary object")
    if ob.is_shadow_catcher:
        report.warn(where, "is a shadow catcher, which can't be rendered; it is rendered as an ordinary object")


def warn_about_layer(ob: Any, view_layer: Any, report: Report) -> None:
    """Warn of objects (or their instancers) that the view layer makes a holdout by their collection."""
    if ob.holdout_get(view_layer=view_layer) and not ob.is_holdout:
        report.warn(f"object '{ob.name}'", f"is a holdout by its collection in view layer '{view_layer.name}', which "
                    "can't be rendered; it is rendered as an ordinary object")  # fmt: skip
