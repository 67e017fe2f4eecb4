"""What a picture and its derivative consist of in a given scene: what is computed, what is skipped and why.

The engine decides what a derivative has (`Renderer.decide`), without rendering; the plan is its decisions in words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field

from .._check import names, whole
from ..derivatives.decisions import Decisions
from ..derivatives.motion import may_move
from ..derivatives.table_derivatives import with_requested
from ..reference import diffuse_tables
from ..reference.simplify import obstacles
from ..rendering.engine import engine_class
from ..rendering.one_shot import caustic_share, prepared
from ..rendering.options import TERMS
from ..rendering.renderer import MAX_DERIVATIVE_DEPTH, Renderer
from ..scene.bounces import MAX_DEPTH
from ..scene.fixed_scene import FixedScene
from ..scene.scene import Scene, validated
from . import boundary_words
from .interior import Reflecting, interior
from .missing_words import missing
from .picture import picture_plan
from .scene_words import SceneWords
from .term import NOT_COMPUTED, UNREAD, Term

_WORDS = {
    "interior": "Interior (shading that changes smoothly)",
    "primary": "Primary boundary (edges that the camera sees)",
    "shadow": "Shadow boundary (edges between a lit point and a light)",
    "indirect": "Indirect boundary (edges between two surfaces that light each other)",
}


@dataclass(frozen=True)
class Plan:
    """The picture's needs, the terms of a derivative, and what is left out of it though it may not be zero.

    `decisions` are the engine's, which the words are about.
    """

    picture: tuple[str, ...]
    terms: tuple[Term, ...]
    missing: tuple[str, ...]
    decisions: Decisions = field(default=(), repr=False)

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
        lines.append("Not computed by this version" if self.missing else
                     "Everything that can contribute in this scene is computed.")
        lines += [f"  - {reason}" for reason in self.missing]
        return "\n".join(lines)


def plan(
    scene: Scene | Renderer, wrt: Sequence[str] = (), *, max_depth: int = MAX_DERIVATIVE_DEPTH, measure: int = 0
) -> Plan:
    """Say what the picture, and its derivatives with respect to some parameters, need.

    What the engine looks for to know that (edges, intersections) is kept for the next derivative. No ray is traced and
    no BVH is built, unless caustics are measured.

    Parameters
    ----------
    scene
        The scene, or a renderer that has it.
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
    narrow = scene.narrow if isinstance(scene, Renderer) else engine_class("auto").narrow
    measure = whole("plan", "measure", measure, 0, 1 << 24)
    max_depth = whole("plan", "max_depth", max_depth, 1, MAX_DERIVATIVE_DEPTH if wrt and narrow else MAX_DEPTH)
    if not wrt:
        given = scene.scene if isinstance(scene, Renderer) else validated(scene)
        return Plan(picture_plan(FixedScene.of(given), max_depth), (), ())
    if narrow:
        diffuse_tables.check(wrt)
    with nullcontext(scene) if isinstance(scene, Renderer) else prepared(scene) as renderer:
        given = renderer.scene
        decided = renderer.decide(wrt, max_depth=max_depth)
        tables = with_requested(given, renderer.tables, wrt)
        fixed = renderer.fixed_scene
    words = SceneWords.of(fixed, decided)
    share = None
    if measure and "caustics" in words.by_part:
        share = caustic_share(given, spp=measure, max_depth=max_depth)
    made = {"interior": interior(words, tables, wrt, max_depth), "primary": boundary_words.primary(words),
            "shadow": boundary_words.shadow(words), "indirect": boundary_words.indirect(words, max_depth)}
    left_out = _simplified(given, max_depth) if narrow else missing(words, share)
    return Plan(picture_plan(fixed, max_depth), tuple(made[name] for name in TERMS), tuple(left_out), decided)


def _simplified(scene: Scene, max_depth: int) -> list[str]:
    """What the reference engine, which is for flat, diffuse scenes alone, lacks."""
    out = [f"for exact derivatives the scene is too rich: {simplified}" for simplified in obstacles(scene)]
    if max_depth >= 2 and Reflecting(scene):
        out.append("light that surfaces pass on to each other (more than one bounce): neither rendered nor derived")
    return out
