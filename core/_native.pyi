"""Types of the native module; native/bindings.cpp is its source."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bounces import Bounces
from .tables import Asked, Derivative, Tables
from .texture_program import TextureTables
from .topology import Edges

F32 = NDArray[np.float32]
Progress = Callable[[float], None] | None

def instruction_sets() -> list[str]: ...
def embree_version(path: str) -> str: ...
def texture_operations() -> list[str]: ...
def evaluate_textures(
    tables: TextureTables, points: Any, rows: NDArray[np.float32], instruction_set: str
) -> None: ...

class Scene:
    def __init__(self, tables: Tables, threads: int, instruction_set: str, embree: str) -> None: ...
    def set_edges(self, edges: Edges) -> None: ...
    @property
    def instruction_set(self) -> str: ...
    def update(self, tables: Tables) -> None: ...
    def update_values(self, tables: Tables) -> None: ...
    def move_vertices(self, mesh: int, vertices: NDArray[np.float64], origin: Sequence[float]) -> None: ...
    def set_camera(self, tables: Tables) -> None: ...
    # Light sampling by itself, for tests (native/light_probes.h).
    def sample_lights(self, position: F32, normal: F32, u: F32, v: F32, both_sides: bool) -> dict[str, F32]: ...
    def meet_lights(
        self, position: F32, normal: F32, w: F32, face: NDArray[np.int32], r: F32, bsdf_pdf: F32, kind: int,
        both_sides: bool,
    ) -> dict[str, F32]: ...
    def sample_sky(self, u: F32, v: F32) -> dict[str, F32]: ...
    def look_at_sky(self, w: F32) -> dict[str, F32]: ...
    def render(
        self, spp: int, seed: int, max_depth: int, bounces: Bounces, progress: Progress
    ) -> NDArray[np.float32]: ...
    def forward(
        self,
        tangent: Derivative,
        asked: Asked,
        spp: int,
        seed: int,
        max_depth: int,
        terms: Sequence[str],
        progress: Progress,
    ) -> NDArray[np.float32]: ...
    def backward(
        self,
        adjoint: NDArray[np.float32],
        asked: Asked,
        spp: int,
        seed: int,
        max_depth: int,
        terms: Sequence[str],
        progress: Progress,
    ) -> dict[str, NDArray[np.float64]]: ...
def evaluate_bsdfs(materials: object, points: object, instruction_set: str) -> dict[str, NDArray[np.float32]]: ...
