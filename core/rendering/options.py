"""`RenderOptions`, the arguments of all renders besides the scene, and their checks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .._check import function, instance, names, shown, whole
from .._fields import optional
from ..scene.bounces import MAX_DEPTH, UNLIMITED, Bounces

Progress = Callable[[float], None]

# Terms of a derivative (docs/concepts.md).
TERMS = ("interior", "primary", "shadow", "indirect")
# Estimators of outlines of distance fields (`RenderOptions.field_edges`).
FIELD_EDGES = ("outlines", "reparameterised", "relaxed")
MOST_THREADS = 4096
MOST_SAMPLES = 1 << 24  # float32 counts no further


@dataclass(frozen=True)
class RenderOptions:
    """The arguments of engines besides the scene.

    Attributes
    ----------
    spp
        Samples per pixel.
    seed
        Of the random numbers.
    max_depth
        Most segments of a path.
    bounces
        Limits of each kind of scattering.
    terms
        Those of a derivative that are computed.
    caustics_alone
        Of a picture: the part of it that is caustics.
    field_edges
        What estimates how outlines of distance fields change the picture (docs/how_to/distance_fields.md): "outlines"
        samples them, "reparameterised" warps the picture, "relaxed" spreads them over a band, which is biased.
    two_passes
        Whether a first pass over edges says where a second one takes its samples. Rounding then moves samples: what
        another instruction set computes is equal in the mean only. The mean is the same without.
    camera_sampled_alpha
        Alpha (roughness squared) of the widest lobes through which the camera sees edges between surfaces by samples
        that start at the camera, of transmitting lobes half of it; wider ones are seen by samples that start at edges.
        The mean is the same for any.
    most_placed_edges
        How many edges of instances a search for edges lists. If there are more, it lists a random part of them, whose
        samples have more weight. The mean is the same for any.
    force
        For tests: parts of a derivative (`derivatives.decisions`) that are computed though they are zero.
    """

    spp: int
    seed: int = 0
    max_depth: int = 2
    bounces: Bounces = UNLIMITED
    terms: tuple[str, ...] = TERMS
    caustics_alone: bool = False
    field_edges: str = "outlines"
    two_passes: bool = True
    camera_sampled_alpha: float = 0.5
    most_placed_edges: int = 1 << 22
    force: tuple[str, ...] = ()


def checked_options(
    spp: Any, max_depth: Any, seed: Any, bounces: Bounces | None, deepest: int = MAX_DEPTH
) -> RenderOptions:
    """The options of a picture."""
    return RenderOptions(
        bounces=checked_bounces("render", bounces) or UNLIMITED,
        spp=whole("render", "spp", spp, 1, MOST_SAMPLES),
        max_depth=whole("render", "max_depth", max_depth, 1, deepest),
        seed=whole("render", "seed", seed, 0, 0xFFFFFFFF),
    )


def checked_bounces(where: str, bounces: Any) -> Bounces | None:
    """`bounces` with its fields checked, or None."""
    if bounces is not None:
        instance(where, "bounces", bounces, Bounces).validate()
    return bounces


def checked_progress(where: str, progress: Any) -> Progress | None:
    """`progress`, which must be a function or None."""
    return optional(function)(where, "progress", progress)


def checked_terms(terms: Any) -> tuple[str, ...]:
    """`terms` as a tuple of some of `TERMS`."""
    kinds = names("render", "terms", terms, ", ".join(TERMS))
    for term in kinds:
        if term not in TERMS:
            raise ValueError(f"render: terms must be a list of {', '.join(TERMS)}, but contains {shown(term)}")
    return kinds


def checked_field_edges(field_edges: Any) -> str:
    """`field_edges`, one of `FIELD_EDGES`."""
    if field_edges not in FIELD_EDGES:
        raise ValueError(f"render: field_edges must be one of {', '.join(FIELD_EDGES)}, but is {shown(field_edges)}")
    return str(field_edges)
