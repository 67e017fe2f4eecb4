"""The parts of a derivative, and what an engine has decided about each of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple


class EdgeCounts(NamedTuple):
    """Numbers of edges that a search for candidate edges has found (native/boundary/curves/edge_counts.h)."""

    of: int = 0
    kept: int = 0
    flat: int = 0
    seams: int = 0
    still: int = 0


class Effects(NamedTuple):
    """How each of some parameters changes a picture. Very many parameters share few effects.

    Attributes
    ----------
    kinds
        The effects: the reason why no shading changes ("needed": it may), and whether the whole picture stays as it is.
    places
        Of each parameter, the place of its effect in `kinds`.
    """

    kinds: tuple[tuple[str, bool], ...] = ()
    places: bytes = b""


@dataclass(frozen=True)
class Decision:
    """One part of a derivative.

    Attributes
    ----------
    part, term
        Its name (native/engine/decisions/decisions.cpp lists them), and its term, one of `edgegrad.TERMS`.
    outcome
        "computed", "zero" or "missing".
    reason
        Why, as a code; "needed" where the part is computed.
    edges
        Numbers of edges.
    meshes, lights, materials
        Meshes, lights and materials that the part concerns, as indices in the order of the scene.
    pairs, pierced
        Pairs of meshes that intersect each other; pairs of a light and a mesh that intersects it.
    limit
        The number of faces or surfaces above which the part is missing; 0: it has none.
    samples, seconds
        Number of samples that the call took, and the seconds of all its threads together; 0 before a call.
    by_parameter
        Of the part "shading" in `Renderer.decide`: how each requested parameter changes the picture.
    """

    part: str
    term: str
    outcome: str
    reason: str
    edges: EdgeCounts = field(default_factory=EdgeCounts)
    meshes: tuple[int, ...] = ()
    lights: tuple[int, ...] = ()
    materials: tuple[int, ...] = ()
    pairs: tuple[tuple[int, int], ...] = ()
    pierced: tuple[tuple[int, int], ...] = ()
    limit: int = 0
    samples: float = 0.0
    seconds: float = 0.0
    by_parameter: Effects = field(default_factory=Effects)

    @property
    def computed(self) -> bool:
        """Whether the part is computed."""
        return self.outcome == "computed"


Decisions = tuple[Decision, ...]


def joined(calls: Iterable[Decisions]) -> Decisions:
    """Join the decisions of calls that computed one derivative together; samples and seconds of a part are added."""
    parts: dict[str, Decision] = {}
    for decided in calls:
        for d in decided:
            before = parts.get(d.part)
            parts[d.part] = d if before is None else replace(
                d, samples=before.samples + d.samples, seconds=before.seconds + d.seconds)
    return tuple(parts.values())
