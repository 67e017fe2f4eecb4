"""Cost of the two estimators of the indirect boundary: ``python -m tests.benchmarks.indirect_estimators [name ...]``.

Seconds x variance of the indirect term's forward derivative: of samples that start at edges, of samples that start at
the camera, and of both by the alpha at which the engine divides lobes between them. Relative to the edges' one: above
1 it is worse. By blocks of 8 x 8 pixels, and by pixels. The means of both are compared, too.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.options import RenderOptions
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.block_statistics import block_sums, compare
from tests.support.engine_options import set_options
from tests.support.scenes.cornell_box import cornell
from tests.support.scenes.lit_by_surfaces import (
    BOX,
    SIZE,
    behind_rough_glass,
    bounced_light,
    mirrored_edge,
    mirrored_room,
    moving,
)
from tests.support.small_scenes import along, camera, glowing, matte, rectangle

Make = Callable[[float], edgegrad.Scene]
SPP, SEEDS = 128, 96
# Estimators by `RenderOptions.camera_sampled_alpha`: none, all glossy lobes and glosses, and as it is.
ESTIMATORS: dict[str, float] = {"edges": 0.0, "camera": 4.0, "chosen": RenderOptions(1).camera_sampled_alpha}


@dataclass(frozen=True)
class Case:
    """A scene's motion and the paths that are rendered."""

    make: Make
    path: str = "meshes.box.vertices"
    max_depth: int = 3


def behind_glass(roughness: float) -> edgegrad.Scene:
    """A box before a wall behind a sheet of this roughness."""
    scene = behind_rough_glass()
    glass = scene.closures("glass")[0]
    return replace(scene, materials={**scene.materials, "glass": replace(glass, roughness=roughness)})


def glossy_lamp() -> edgegrad.Scene:
    """A glowing ball and a wall that it lights, over a floor of rough metal."""
    vertices, faces = shapes.ball(2, 0.3)
    ball = edgegrad.Mesh(vertices + [0.0, 0.5, 0.0], faces, ("lamp",))
    metal = edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=math.sqrt(0.1))
    return edgegrad.Scene(
        camera((0, 1.0, 2.2), (0, 0.1, 0), SIZE, 0.7),
        {
            "floor": rectangle((0, 0, 0.2), (0, 0, 0.8), (0.9, 0, 0), "metal"),
            "wall": rectangle((0, 0.7, -1.2), (1.5, 0, 0), (0, 1.0, 0), "wall"),
            "box": ball,
        },
        {"metal": metal, "wall": matte(0.8, 0.6, 0.5), "lamp": glowing(5.0)},
    )


def dense_body() -> edgegrad.Scene:
    """A bumpy body of 18,000 edges in place of the box over metal of alpha 0.1."""
    scene = mirrored_edge(0.1)
    vertices, faces = shapes.ball(5, 0.25)
    vertices = vertices * (1.0 + 0.1 * np.sin(17 * vertices[:, :1]) * np.sin(23 * vertices[:, 1:2]))
    body = edgegrad.Mesh(vertices + [0.1, 0.45, -0.2], faces, ("black",))
    return replace(scene, meshes={**scene.meshes, "box": body})


def polished() -> edgegrad.Scene:
    """The floor under the box has a diffuse colour and a gloss."""
    scene = mirrored_edge(0.1)
    gloss = edgegrad.Material(np.array([0.5, 0.4, 0.3]), roughness=0.25, specular_ior_level=0.5)
    return replace(scene, materials={**scene.materials, "metal": gloss})


MOVE = (1.0, 0.5, 0.3)
CASES: dict[str, Case] = {
    **{
        f"edge in metal, alpha {alpha}": Case(moving(partial(mirrored_edge, alpha), "box", MOVE))
        for alpha in (0.05, 0.1, 0.2, 0.3, 0.5)  # narrower ones are followed
    },
    "edge behind glass, alpha 0.04": Case(moving(lambda: behind_glass(0.2), "box", MOVE)),
    "edge behind glass, alpha 0.25": Case(moving(lambda: behind_glass(0.5), "box", MOVE)),
    "glossy floor, Principled": Case(moving(polished, "box", MOVE)),
    "dense body in metal, alpha 0.1": Case(moving(dense_body, "box", MOVE)),
    "glowing ball over metal": Case(moving(glossy_lamp, "box", MOVE)),
    "bounces in metal, alpha 0.05": Case(moving(mirrored_room, "box", BOX), max_depth=4),
    "bounced light, order 2": Case(moving(bounced_light, "box", BOX)),
    "bounced light, order 3": Case(moving(bounced_light, "box", BOX), max_depth=4),
    "Cornell box, depth 6": Case(cornell, "meshes.tall.vertices", 6),
}


def derivatives(case: Case, alpha: float) -> tuple[NDArray[np.float64], float]:
    """(SEEDS, H, W, 3) derivatives, and the least processor seconds of one."""
    scene, tangent = along(case.make, [case.path])(0.0)
    renderer = Renderer(scene, threads=1)
    set_options(renderer, camera_sampled_alpha=alpha)
    found, seconds = [], math.inf
    for seed in range(SEEDS):
        start = time.process_time()
        found.append(
            renderer.render_forward(tangent, spp=SPP, seed=seed, max_depth=case.max_depth, terms=("indirect",))
        )
        seconds = min(seconds, time.process_time() - start)
    return np.asarray(found, np.float64), seconds


def main(names: list[str]) -> None:
    """Print the table."""
    print("scene | " + " | ".join(f"{name}: blocks, pixels, seconds" for name in ESTIMATORS) + " | p of equal means")
    for name in names or CASES:
        found = {key: derivatives(CASES[name], alpha) for key, alpha in ESTIMATORS.items()}
        cost = {
            key: [seconds * float(a.var(axis=0, ddof=1).sum()) for a in (block_sums(samples), samples)]
            for key, (samples, seconds) in found.items()
        }
        columns = []
        for key in ESTIMATORS:
            blocks, pixels = (own / max(base, 1e-300) for own, base in zip(cost[key], cost["edges"], strict=True))
            columns.append(f"{blocks:.3g}, {pixels:.3g}, {found[key][1]:.3f}")
        edges = found["edges"][0]
        agreement = compare(found["camera"][0], edges.mean(axis=0), edges.std(axis=0, ddof=1) / math.sqrt(SEEDS))
        print(f"{name} | " + " | ".join(columns) + f" | {agreement.p_value:.2g}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
