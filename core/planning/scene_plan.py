"""Plans: which parts of a picture and of its derivative are computed in a scene, which are skipped, and why.

The engine decides this without rendering (`Renderer.decide`, `Renderer.picture_facts`). A plan puts its decisions into
words.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field

from .._check import names, whole
from ..derivatives.decisions import Decisions
from ..reference import diffuse_tables
from ..reference.simplify import obstacles
from ..rendering.engine import engine_class
from ..rendering.one_shot import caustic_share, prepared
from ..rendering.options import FIELD_EDGES, MOST_SAMPLES, TERMS
from ..rendering.renderer import MAX_DERIVATIVE_DEPTH, Renderer
from ..scene.bounces import MAX_DEPTH, Bounces
from ..scene.scene import Scene
from . import boundary_words
from .interior import interior, unchanged
from .missing_words import missing
from .picture import picture_plan
from .scene_words import SceneWords
from .term import NOT_COMPUTED, Term

_WORDS = {
    "interior": "Interior (shading that changes smoothly)",
    "primary": "Primary boundary (edges that the camera sees)",
    "shadow": "Shadow boundary (edges between a lit point and a light)",
    "indirect": "Indirect boundary (edges between two surfaces that light each other)",
}


@dataclass(frozen=True)
class Plan:
    """A plan in words.

    Attributes
    ----------
    picture
        Sentences on what a picture needs.
    terms
        The terms of the derivative.
    missing
        Sentences on contributions to the derivative that are not computed, and may not be zero.
    zero
        Parameters that do not change the picture, and why.
    decisions
        The engine's decisions that the words describe.
    """

    picture: tuple[str, ...]
    terms: tuple[Term, ...]
    missing: tuple[str, ...]
    zero: Mapping[str, str] = field(default_factory=dict, repr=False)
    decisions: Decisions = field(default=(), repr=False)

    @property
    def needed(self) -> tuple[str, ...]:
        """Names of the terms that can be non-zero, as `render_backward` takes them."""
        return tuple(term.name for term in self.terms if term.computed)

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
    scene: Scene | Renderer, wrt: Sequence[str] = (), *, max_depth: int = MAX_DERIVATIVE_DEPTH,
    bounces: Bounces | None = None, measure: int = 0, field_edges: str = FIELD_EDGES[0],
) -> Plan:  # fmt: skip
    """Say what the picture, and its derivatives with respect to some parameters, need.

    The next derivative uses the edges and intersections that the engine finds for the plan. No ray is traced and no BVH
    is built, unless caustics are measured.

    Parameters
    ----------
    scene
        The scene, or a renderer that has it.
    wrt
        Parameter paths; empty: a plan of the picture only.
    max_depth, bounces
        Path segments, and how paths bounce, as for `edgegrad.render`.
    measure
        Samples per pixel for a measurement of the fraction of the picture with an incomplete derivative (caustics); 0:
        nothing is rendered. Scenes without caustics are not rendered.
    field_edges
        As for `edgegrad.render_forward`.

    Raises
    ------
    ValueError
        For a wrong scene, an unknown path, or a parameter that has no derivative.
    """
    wrt = names("plan", "wrt", wrt, "parameter paths")
    narrow = scene.narrow if isinstance(scene, Renderer) else engine_class("auto").narrow
    measure = whole("plan", "measure", measure, 0, MOST_SAMPLES)
    max_depth = whole("plan", "max_depth", max_depth, 1, MAX_DERIVATIVE_DEPTH if wrt and narrow else MAX_DEPTH)
    if narrow:
        diffuse_tables.check(wrt)
    with nullcontext(scene) if isinstance(scene, Renderer) else prepared(scene) as renderer:
        given = renderer.scene
        decided = renderer.decide(wrt, max_depth=max_depth, bounces=bounces, field_edges=field_edges) if wrt else ()
        picture = picture_plan(given, renderer.tables, renderer.picture_facts(settled=bool(wrt)), max_depth)
        if not wrt:
            return Plan(picture, (), ())
        words = SceneWords.of(given, renderer.tables, decided)
    share = None
    if measure and "caustics" in words.by_part:
        share = caustic_share(given, spp=measure, max_depth=max_depth, bounces=bounces)
    made = {"interior": interior(words, wrt), "primary": boundary_words.primary(words),
            "shadow": boundary_words.shadow(words), "indirect": boundary_words.indirect(words, max_depth)}
    left_out = _simplified(given, max_depth) if narrow else missing(words, share)
    return Plan(picture, tuple(made[name] for name in TERMS), tuple(left_out),
                unchanged(words, wrt), decided)


def _simplified(scene: Scene, max_depth: int) -> list[str]:
    """Return what the reference engine leaves out, which is exact for flat-shaded, diffuse scenes only."""
    out = [f"for exact derivatives the scene is too rich: {simplified}" for simplified in obstacles(scene)]
    closures = [closure for name in scene.used_materials for closure in scene.closures(name)]
    if max_depth >= 2 and any(c.base_color.any() or "base_color" in c.textures for c in closures):
        out.append("light that surfaces pass on to each other (more than one bounce): neither rendered nor derived")
    return out
