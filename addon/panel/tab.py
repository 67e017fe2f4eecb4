"""What all panels of the tab share."""

from __future__ import annotations

from typing import Any

from ..status import STATUS


class Tab:
    """A panel of the tab."""

    bl_category = "Edgegrad"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def begin(self) -> Any:
        """Return the layout; properties have their names beside them."""
        layout = self.layout  # type: ignore[attr-defined]
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout


def editable(layout: Any) -> Any:
    """Make all buttons of a layout grey while a job runs, since it has read them already; return the layout."""
    if STATUS.job is not None:
        layout.enabled = False
    return layout


def stated(layout: Any, name: str, value: str) -> None:
    """Draw a value that can't be edited here, with its name where the names of properties are."""
    split = layout.split(factor=0.4)
    left = split.row()
    left.alignment = "RIGHT"
    left.label(text=name)
    split.label(text=value)


def others(layout: Any, owner: Any, drawn: tuple[str, ...]) -> None:
    """Draw the properties of an owner that are not among those drawn elsewhere."""
    for prop in owner.bl_rna.properties:
        if prop.identifier not in ("rna_type", "name", *drawn) and not prop.is_hidden:
            layout.prop(owner, prop.identifier)
