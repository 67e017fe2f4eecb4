"""What a picture and its derivative consist of in a given scene: what is computed, what is skipped and why.

Reading the plan costs a pass over the vertices and edges and no ray. It is written for people: the
engines follow the same rules by themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .._check import names, whole
from ..derivatives.motion import may_move, motion
from ..derivatives.table_derivatives import requested_tables, with_requested
from ..geometry.placed_meshes import PlacedMeshes
from ..reference import diffuse_tables
from ..rendering.engine import engine_class
from ..rendering.one_shot import caustic_share
from ..rendering.renderer import MAX_DERIVATIVE_DEPTH
from ..scene.bounces import MAX_DEPTH
from ..scene.fixed_scene import FixedScene
from ..scene.scene import Scene, validated
from ..tables.tables import flatten
from .picture import picture_plan
from .primary import missing_texel_borders
from .rims import missing_rims
from .specular import causes_caustics, missing_caustics, missing_outlines, missing_specular
from .terms import NOT_COMPUTED, UNREAD, Term, missing, terms

_WORDS = {
    "interior": "Interior (shading that changes smoothly)",
    "primary": "Primary boundary (edges that the camera sees)",
    "shadow": "Shadow boundary (edges between a lit point and a light)",
    "indirect": "Indirect boundary (edges between two surfaces that light each other)",
}


@dataclass(frozen=True)
class Plan:
    """The picture's needs, the terms of a derivative, and what is left out of it though it may not be zero."""

    picture: tuple[str, ...]
    terms: tuple[Term, ...]
    missing: tuple[str, ...]

    @property
    def needed(self) -> tuple[str, ...]:
        """Names of the terms that can be non-zero, as `render_backward` takes them."""
        return tuple(term.name for term in self.terms if term.computed)

    @property
    def zero(self) -> dict[str, str]:
        """Parameters by which the picture certainly doesn't change, and why."""
        unchanged: Mapping[str, str] = {}
        borders = False
        for term in self.terms:
            unchanged = term.zero or unchanged
            borders |= term.computed and term.name != "interior"
        return {path: why for path, why in unchanged.items() if why == UNREAD or not (borders and may_move(path))}

    def __str__(self) -> str:
        lines = ["Picture", *(f"  - {sentence}" for sentence in self.picture)]
        for term in self.terms:
            count = f": {term.edges:,} of {term.of:,} edges" if term.computed and term.of else ""
            skipped = "" if NOT_COMPUTED in term.why else ", it is zero"
            lines.append(f"{_WORDS[term.name]}{count}{'' if term.computed else f': skipped{skipped}'}")
            lines += [f"  - {reason}" for reason in term.why]
        if not self.terms:
            return "\n".join(lines)
        lines.append("Not computed by this version" + ("" if self.missing else ": nothing that matters here"))
        lines += [f"  - {reason}" for reason in self.missing]
        return "\n".join(lines)


def plan(scene: Scene, wrt: Sequence[str] = (), *, max_depth: int = MAX_DERIVATIVE_DEPTH, measure: int = 0) -> Plan:
    """Say what the picture, and its derivatives with respect to some parameters, need.

    Parameters
    ----------
    scene
        The scene.
    wrt
        Parameter paths; none: of the picture alone.
    max_depth
        Path segments, as for `edgegrad.render`.
    measure
        Samples per pixel with which to measure how much of the picture is light whose derivative is incomplete
        (caustics); 0: nothing is rendered. A scene that cannot have any is not rendered either.

    Raises
    ------
    ValueError
        For a wrong scene or path, or one that has no derivative.
    """
    wrt = names("plan", "wrt", wrt, "parameter paths")
    narrow = engine_class("auto").narrow
    measure = whole("plan", "measure", measure, 0, 1 << 24)
    max_depth = whole("plan", "max_depth", max_depth, 1, MAX_DERIVATIVE_DEPTH if wrt and narrow else MAX_DEPTH)
    if not wrt:
        return Plan(picture_plan(FixedScene.of(validated(scene)), max_depth), (), ())
    given, tables = scene, with_requested(scene, flatten(scene), wrt)
    scene = FixedScene.of(given)
    picture = picture_plan(scene, max_depth)
    requested_tables(scene, tables, wrt)  # raises for each that has no derivative
    if narrow:
        diffuse_tables.check(wrt)
    moves = motion(scene, tables, wrt)
    placed = PlacedMeshes.of(scene)
    left_out = list(missing(scene, moves, max_depth, narrow, placed))
    left_out += missing_texel_borders(scene, wrt)
    if not narrow:
        left_out += missing_specular(scene, moves, wrt, max_depth)
        left_out += missing_outlines(scene, moves, wrt, max_depth)
        thrown = causes_caustics(scene, moves, wrt, max_depth)
        if thrown:
            share = caustic_share(given, spp=measure, max_depth=max_depth) if measure else None
            left_out.append(missing_caustics(thrown, share))
        left_out += missing_rims(scene, moves, wrt, max_depth)
    return Plan(picture, terms(scene, tables, wrt, moves, max_depth, placed), tuple(left_out))
