"""Noise of a derivative over the roughness of what moves: ``python -m tests.benchmarks.gloss_noise [--plot FILE]``.

A ball of metal or of glass, alone or over a floor, moves along x. What is printed is the standard deviation over seeds
of the derivative's block means (8 x 8 pixels; root mean square over blocks) by roughness, for all terms together and
for each by itself, and how far its largest value is above the larger one of both ends. ``--save`` writes the figures to
a JSON file; ``--before`` takes such a file's as the dashed lines of the plot.
"""

from __future__ import annotations

import argparse
import json
import pathlib
from itertools import product

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.block_statistics import block_sums
from tests.support.small_scenes import camera, glowing, matte, rectangle

Floats = NDArray[np.float64]
Figures = dict[str, dict[str, list[float]]]  # by scene and term, over ROUGHNESS
SIZE, BLOCK, MAX_DEPTH = 16, 8, 5
ROUGHNESS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2, 0.3, 0.5, 0.7, 1.0)
TERMS = ("interior", "primary", "shadow", "indirect")
BODIES = ("metal", "glass")
# What is below it: nothing, a floor that gives light and scatters none, or one that the ball lights.
FLOORS = ("none", "glowing", "matte")
# What the ball is under.
LIGHTS = ("sky", "image", "area", "sphere", "mesh", "point", "sun")


def sky_image() -> Floats:
    """A smooth sky, bright on one side."""
    v, u = np.meshgrid(np.linspace(0.0, 1.0, 16), np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False), indexing="ij")
    level = 0.6 + 0.4 * np.cos(u) * np.sin(np.pi * v) + 0.3 * np.cos(np.pi * v)
    return np.stack([level, 0.8 * level + 0.1, np.full_like(level, 0.5)], axis=-1)


def body(kind: str, roughness: float) -> edgegrad.Material:
    """The ball's material."""
    if kind == "glass":
        return edgegrad.Material(np.full(3, 0.95), kind="GLASS", roughness=roughness, ior=1.45)
    return edgegrad.Material(np.array([0.9, 0.8, 0.6]), kind="GLOSSY", roughness=roughness)


def scene(kind: str, roughness: float, light: str, floor: str) -> edgegrad.Scene:
    """A ball, alone or over a floor."""
    vertices, faces = shapes.ball(3, 0.5)
    meshes = {"ball": edgegrad.Mesh(vertices, faces, ("ball",), smoothing=faces)}
    materials = {"floor": matte(0.6, 0.4, 0.3) if floor == "matte" else glowing(0.4), "ball": body(kind, roughness)}
    if floor != "none":
        meshes["floor"] = rectangle((0, -0.6, 0), (0, 0, 3), (3, 0, 0), "floor")
    place = np.array([0.8, 1.6, 0.9])
    world = edgegrad.World(np.full(3, 0.2))
    images: dict[str, edgegrad.Image] = {}
    lights: dict[str, edgegrad.PointLight | edgegrad.SunLight] = {}
    if light == "sky":
        world = edgegrad.World(np.ones(3))
    elif light == "image":
        world, images = edgegrad.World(np.ones(3), image="sky"), {"sky": edgegrad.Image(sky_image().astype(np.float32))}
    elif light == "area":
        meshes["lamp"] = rectangle(place, (0, 0, 0.4), (-0.4, 0, 0), "lamp")
        materials["lamp"] = glowing(8.0)
    elif light == "mesh":
        vertices, faces = shapes.ball(3, 0.3)
        meshes["lamp"] = edgegrad.Mesh(vertices + place, faces, ("lamp",))
        materials["lamp"] = glowing(8.0)
    elif light == "sphere":
        lights["lamp"] = edgegrad.PointLight(place, power=40.0, radius=0.3, sphere=True)
    elif light == "point":
        lights["lamp"] = edgegrad.PointLight(place, power=40.0)
    else:
        lights["lamp"] = edgegrad.SunLight(-place / np.linalg.norm(place), strength=2.0, angle=0.05)
    return edgegrad.Scene(
        camera((0, 0.9, 2.6), (0, -0.1, 0), SIZE, 0.5), meshes, materials, lights, world, images
    )


def noise(made: edgegrad.Scene, term: str, spp: int, seeds: int, what: str) -> float:
    """Root mean square over blocks of the standard deviation of their means."""
    path, tangent = f"meshes.{what}.vertices", np.zeros_like(made.meshes[what].vertices)
    tangent[:, 0] = 1.0
    terms = TERMS if term == "all" else (term,)
    renderer = Renderer(made)
    blocks = [
        block_sums(
            renderer.render_forward({path: tangent}, spp=spp, seed=seed, max_depth=MAX_DEPTH, terms=terms), BLOCK
        ) / BLOCK**2
        for seed in range(seeds)
    ]
    return float(np.sqrt(np.mean(np.var(blocks, axis=0, ddof=1))))


def measure(
    lights: list[str], bodies: list[str], floors: list[str], terms: list[str], spp: int, seeds: int, what: str
) -> Figures:
    """The noise over roughness, printed as it is found."""
    figures: Figures = {}
    for light, floor, kind in product(lights, floors, bodies):
        name = f"{kind}, {light}" + (f", {floor} floor" if floor != "none" else "")
        figures[name] = {}
        for term in terms:
            row = [noise(scene(kind, r, light, floor), term, spp, seeds, what) for r in ROUGHNESS]
            figures[name][term] = row
            peak = max(row) / max(row[0], row[-1], 1e-30)
            print(f"{name:>27} {term:>9}", *(f"{x:8.1e}" for x in row), f"peak {peak:.1f}", flush=True)
    return figures


def plot(figures: Figures, before: Figures, path: pathlib.Path) -> None:
    """Draw the noise of all terms over roughness."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4.5), layout="constrained")
    axes = figure.subplots()
    for number, (name, terms) in enumerate(figures.items()):
        color = f"C{number}"
        if name in before:
            axes.plot(ROUGHNESS, before[name]["all"], "--", color=color, alpha=0.6, label=f"{name}, before")
        axes.plot(ROUGHNESS, terms["all"], "o-", color=color, label=name)
    axes.set_xscale("symlog", linthresh=0.01)
    axes.set_yscale("log")
    axes.set_xlabel("roughness of the ball")
    axes.set_ylabel("standard deviation of 8 x 8 block means")
    axes.legend(fontsize="small")
    figure.savefig(path)


def main() -> None:
    """Measure, print, and plot what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lights", nargs="+", choices=LIGHTS, default=["image"])
    parser.add_argument("--floors", nargs="+", choices=FLOORS, default=["none", "glowing"])
    parser.add_argument("--bodies", nargs="+", choices=BODIES, default=list(BODIES))
    parser.add_argument("--terms", nargs="+", choices=("all", *TERMS), default=["all", *TERMS])
    parser.add_argument("--moves", default="ball", help="mesh that moves along x")
    parser.add_argument("--spp", type=int, default=512)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--save", type=pathlib.Path)
    parser.add_argument("--before", type=pathlib.Path)
    parser.add_argument("--plot", type=pathlib.Path)
    args = parser.parse_args()
    if args.plot and "all" not in args.terms:
        parser.error("--plot draws all terms together: --terms must name 'all'")
    figures = measure(args.lights, args.bodies, args.floors, args.terms, args.spp, args.seeds, args.moves)
    if args.save:
        args.save.write_text(json.dumps({"roughness": ROUGHNESS, "noise": figures}))
    if args.plot:
        plot(figures, json.loads(args.before.read_text())["noise"] if args.before else {}, args.plot)


if __name__ == "__main__":
    main()
