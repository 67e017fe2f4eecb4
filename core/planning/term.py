"""A term of the derivative in a scene: whether it can be non-zero, over how many edges, and why."""

from __future__ import annotations

from dataclasses import dataclass

UNREAD = "the picture does not depend on it"
NOT_COMPUTED = "not computed in this scene, see below"


@dataclass(frozen=True)
class Term:
    """One term of the derivative.

    Attributes
    ----------
    name
        As in `edgegrad.TERMS`.
    computed
        False: it is zero in this scene, or left out of it (`NOT_COMPUTED` in `why`).
    edges, of
        Candidate edges, and all edges (of the meshes that rays can hit); 0 for the interior.
    why
        What is computed or skipped, and the reason, in words.
    """

    name: str
    computed: bool
    edges: int
    of: int
    why: tuple[str, ...]
