"""What all renders are told besides the scene: samples, depth, seed, bounces, terms, progress; checked."""

from __future__ import annotations

from typing import Any

from .._check import function, instance, names, shown, whole
from .._fields import optional
from ..scene.bounces import MAX_DEPTH, UNLIMITED, Bounces
from .engine import Progress

# Terms of a derivative (docs/concepts.md).
TERMS = ("interior", "primary", "shadow", "indirect")
MOST_THREADS = 4096


def checked_options(
    spp: Any, max_depth: Any, seed: Any, bounces: Bounces | None, deepest: int = MAX_DEPTH
) -> dict[str, Any]:
    """The options of a picture by name, as engines take them."""
    bounces = checked_bounces("render", bounces) or UNLIMITED
    return {
        "bounces": bounces,
        "spp": whole("render", "spp", spp, 1, 1 << 24),
        "max_depth": whole("render", "max_depth", max_depth, 1, deepest),
        "seed": whole("render", "seed", seed, 0, 0xFFFFFFFF),
    }


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
