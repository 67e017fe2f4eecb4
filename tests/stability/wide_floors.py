"""Noise over the width of a floor: ``python -m tests.stability.wide_floors [--spp N] [--seeds N]``.

A box of 1 m moves over a floor. The standard deviation of block means (8 x 8 pixels) over seeds is shown by light, by
term and by the floor's side in metres.
"""

from __future__ import annotations

import argparse

import numpy as np

from edgegrad import AreaLight, Material, Mesh, Renderer, Scene, SunLight, World
from edgegrad.scene.light import Light
from tests.support.block_statistics import block_sums
from tests.support.shapes import camera, cube, sheet

SIDES = (8.0, 40.0, 200.0, 1000.0, 10000.0)


def scene(side: float, light: str) -> Scene:
    """A box over a floor, under a lamp, a sun or a sky."""
    (vertices, faces), (floor, floor_faces) = cube(1.0), sheet(2, side)
    place = np.eye(4)
    place[:3, 3] = [1.0, -1.0, 4.0]
    lights: dict[str, Light] = {}
    if light == "lamp":
        lights["light"] = AreaLight(to_world=place, size=np.ones(2), power=300.0)
    elif light == "sun":
        lights["light"] = SunLight(np.array([0.3, 0.2, -1.0]))
    meshes = {"box": Mesh(vertices + [0.0, 0.0, 0.8], faces, ("clay",)), "floor": Mesh(floor, floor_faces, ("clay",))}
    return Scene(camera((4.0, -6.0, 4.0), size=(64, 64)), meshes, {"clay": Material(np.full(3, 0.7))}, lights,
                 World(np.full(3, 0.0 if lights else 0.6)))  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--seeds", type=int, default=16)
    options = parser.parse_args()
    shift = np.tile([1.0, 0.0, 0.0], (8, 1))
    print(f"{'':16}" + "".join(f"{side:>10,.0f}" for side in SIDES))
    for light in ("lamp", "sun", "sky"):
        for term in ("shadow", "indirect"):
            row = []
            for side in SIDES:
                renderer = Renderer(scene(side, light))
                pictures = [renderer.render_forward({"meshes.box.vertices": shift}, spp=options.spp, max_depth=3,
                                                    seed=seed, terms=[term])
                            for seed in range(options.seeds)]  # fmt: skip
                means = np.array([block_sums(picture) for picture in pictures]) / 64.0
                row.append(float(np.sqrt(means.var(axis=0, ddof=1).mean())))
            print(f"{light + ', ' + term:16}" + "".join(f"{value:10.2g}" for value in row), flush=True)


if __name__ == "__main__":
    main()
