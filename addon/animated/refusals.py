"""Properties whose value a fit cannot set: driven, keyed, linked and overridden ones."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..problem import Problem
from .data_path import Place


def check_own(where: str, datablock: Any, what: str = "") -> None:
    """Raise `Problem` if a datablock of another file, or an override of one, can't be written.

    The message names what is wrong with `where`, or with `what` of it.
    """
    if datablock.library is not None:
        raise Problem(f"{where}: {what}is linked from '{datablock.library.filepath}' and can't be written; make it "
                      "local first")  # fmt: skip
    if datablock.override_library is not None:
        raise Problem(f"{where}: {what}is a library override, whose values Blender takes from its reference; make it "
                      "local first")  # fmt: skip


def check(place: Place, may_be_keyed: bool = False) -> None:
    """Raise `Problem`, with the cure, if a fit cannot set this property, or not write its keys."""
    owner, where = place.owner, f"property '{place.name}'"
    check_own(where, owner, f"'{owner.name}' ")
    if getattr(owner, "mode", "") == "EDIT":
        raise Problem(f"{where}: '{owner.name}' is in edit mode; leave it first")
    for animation, prefix in _animations(place):
        path = place.path[len(prefix) :]
        for driver in animation.drivers:
            if _drives(driver, path, place.index):
                raise Problem(f"{where}: is driven, so a fit can't set it; fit what drives it "
                              f"({_inputs(driver.driver)}), or remove its driver")  # fmt: skip
        if any(_drives(curve, path, place.index) for curve in _curves_of_strips(animation)):
            raise Problem(f"{where}: is keyed in a strip of the NLA editor; mute the strip, or make it the active "
                          "action")  # fmt: skip
        if not may_be_keyed and any(_drives(curve, path, place.index) for curve in _curves(animation)):
            raise Problem(f"{where}: is keyed, so its value comes back at the next change of the frame; remove its "
                          "keyframes, or fit the frames of a film (--frames FIRST:LAST)")  # fmt: skip
    locked = _is_read_only(place)
    if locked:
        raise Problem(f"{where}: is read-only; fit the properties that it follows from")


def _is_read_only(place: Place) -> bool:
    holder, key, custom = place.holder()
    return not custom and bool(holder.bl_rna.properties[key].is_readonly)


def _animations(place: Place) -> Iterator[tuple[Any, str]]:
    """Yield the animation data that may set a property, and what the property's path starts with there."""
    owner = place.owner
    if getattr(owner, "animation_data", None) is not None:
        yield owner.animation_data, ""
    tree = getattr(owner, "node_tree", None)
    if place.path.startswith("node_tree.") and tree is not None and tree.animation_data is not None:
        yield tree.animation_data, "node_tree."


def _drives(curve: Any, path: str, index: int) -> bool:
    return bool(curve.data_path == path) and (index < 0 or curve.array_index == index)


def is_keyed(place: Place) -> bool:
    """Whether the active action has keyframes of this property."""
    return any(_drives(curve, place.path[len(prefix) :], place.index)
               for animation, prefix in _animations(place) for curve in _curves(animation))  # fmt: skip


def curve_of(place: Place) -> Any:
    """Return the curve of this property in the active action; None: there is none."""
    return next((curve for animation, prefix in _animations(place) for curve in _curves(animation)
                 if _drives(curve, place.path[len(prefix) :], place.index)), None)  # fmt: skip


def _curves(animation: Any) -> Iterator[Any]:
    """Yield the curves of the active action."""
    yield from _curves_of(animation.action, getattr(animation, "action_slot", None))


def _curves_of_strips(animation: Any) -> Iterator[Any]:
    """Yield the curves of strips that have an effect."""
    for track in animation.nla_tracks if animation.use_nla else ():
        for strip in () if track.mute else (one for one in track.strips if not one.mute):
            yield from _curves_of(strip.action, getattr(strip, "action_slot", None))


def _curves_of(action: Any, slot: Any) -> Iterator[Any]:
    if action is None:
        return
    if not hasattr(action, "layers"):
        yield from action.fcurves
        return
    for layer in action.layers:
        for strip in layer.strips:
            bag = strip.channelbag(slot) if slot is not None else None
            yield from bag.fcurves if bag is not None else ()


def _inputs(driver: Any) -> str:
    """Name what a driver reads."""
    found = [f"'{target.data_path or target.transform_type}' of '{target.id.name}'"
             for variable in driver.variables for target in variable.targets if target.id is not None]  # fmt: skip
    return ", ".join(dict.fromkeys(found)) or f"the expression '{driver.expression}'"
