"""CPU seconds of exports from Blender of a grid of a million triangles.

    python -m tests.benchmarks.blender.export_seconds

The same grid flat, smooth with a picture, with a normal map, which needs tangents, and this with sharp edges.
"""

from __future__ import annotations

import time
from typing import Any

import bpy
import numpy as np

from tests.support.scenes import blender_scenes as bs

SIDE = 708  # vertices
REPEATS = 12


def grid(case: str) -> Any:
    """Blender's mesh: a wavy grid of quads with a UV map."""
    x, y = (one.reshape(-1) for one in np.meshgrid(*2 * [np.linspace(-1.0, 1.0, SIDE)], indexing="ij"))
    first = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).reshape(-1, 1)
    quads = first + (0, SIDE, SIDE + 1, 1)
    made = bs.mesh("Grid", np.stack([x, y, 0.1 * np.sin(7.0 * x) * np.cos(5.0 * y)], axis=1), quads, material(case))
    (made.shade_flat if case == "flat" else made.shade_smooth)()
    uv = np.stack([x, y], axis=1)[quads.reshape(-1)].astype(np.float32)
    made.uv_layers.new(name="UVMap").uv.foreach_set("vector", uv.reshape(-1))
    if case == "sharp":
        marks = np.arange(len(made.edges)) % 50 == 0
        made.attributes.new("sharp_edge", "BOOLEAN", "EDGE").data.foreach_set("value", marks)
    return made


def material(case: str) -> Any:
    """A plain material, one with a picture, or one with a normal map."""
    if case in ("normal map", "sharp"):
        return bs.normal_mapped(1.0)
    made = bs.material("Plain")
    if case == "picture":
        texture = made.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = bpy.data.images.new("Picture", 8, 8)
        made.node_tree.links.new(texture.outputs["Color"], bs.shader(made).inputs["Color"])
    return made


def main() -> None:
    """Print the least and the median seconds of each case."""
    for case in ("flat", "picture", "normal map", "sharp"):
        bs.empty()
        bs.camera()
        bs.light("POINT")
        bs.add("Grid", grid(case))
        spent = []
        for _ in range(REPEATS):
            begin = time.process_time()
            bs.export()
            spent.append(time.process_time() - begin)
        print(f"{case:10}: least {min(spent):.3f} s, median {np.median(spent):.3f} s")


if __name__ == "__main__":
    main()
