"""The engines that renderers can have, and which of them is there."""

from __future__ import annotations

import warnings
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .._check import shown
from ..derivatives.decisions import Decisions
from ..derivatives.table_derivatives import ParameterRows, Requested, TableDerivative
from ..geometry.topology import Edges
from ..tables import tables as flat
from ..tables.picture_facts import PictureFacts
from .options import Progress, RenderOptions


class EngineLike(Protocol):
    """The common interface of the native and the reference engine."""

    decided: Decisions  # on the last derivative
    narrow: bool  # it has derivatives of flat, diffuse, directly lit scenes alone

    def __init__(self, tables: flat.Tables, threads: int) -> None: ...
    def set_edges(self, edges: Edges) -> None: ...
    def update(self, tables: flat.Tables) -> None: ...
    def update_values(self, tables: flat.Tables) -> None: ...
    def move_vertices(self, mesh: int, vertices: NDArray[np.float64], tables: flat.Tables) -> None: ...
    def render(
        self, tables: flat.Tables, options: RenderOptions, *, progress: Progress | None
    ) -> NDArray[np.float32]: ...
    def add_samples(
        self,
        tables: flat.Tables,
        options: RenderOptions,
        first: int,
        sums: NDArray[np.float64],
        *,
        progress: Progress | None,
    ) -> NDArray[np.float32]: ...
    def forward(
        self,
        tables: flat.Tables,
        tangent: TableDerivative,
        requested: Requested,
        options: RenderOptions,
        *,
        progress: Progress | None,
    ) -> NDArray[np.float32]: ...
    def backward(
        self,
        tables: flat.Tables,
        adjoint: NDArray[np.float32],
        requested: Requested,
        options: RenderOptions,
        *,
        progress: Progress | None,
    ) -> TableDerivative: ...
    def picture_facts(self, tables: flat.Tables) -> PictureFacts: ...
    def decide(
        self, tables: flat.Tables, requested: Requested, options: RenderOptions, parameters: ParameterRows
    ) -> Decisions: ...


_warned_of_fallback = False


def engine_name(name: str) -> str:
    """`name`, which must be that of an engine."""
    if not isinstance(name, str) or name not in ("auto", "native", "reference"):
        raise ValueError(f"engine must be 'auto', 'native' or 'reference', not {shown(name)}")
    return name


def engine_class(name: str) -> type[EngineLike]:
    """The engine of this name; "auto" is the native one, or the reference where that can't be loaded.

    Raises
    ------
    ValueError
        For an unknown name.
    ImportError
        If the native engine is required and cannot be loaded.
    """
    global _warned_of_fallback
    if engine_name(name) != "reference":
        try:
            from . import native_engine

            native_engine.embree_version()  # loads Embree: what is missing shows here
            return native_engine.Engine
        except (ImportError, RuntimeError) as error:
            if name == "native":
                raise ImportError(f"edgegrad's native engine can't be loaded: {error}") from error
            if not _warned_of_fallback:
                warnings.warn(
                    f"edgegrad's native engine can't be loaded ({error}); using the reference engine, "
                    "which gives the same results much more slowly",
                    RuntimeWarning,
                    stacklevel=3,
                )
                _warned_of_fallback = True
    from ..reference import Engine

    return Engine
