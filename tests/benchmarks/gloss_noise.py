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

from tests.support.scenes.gloss.glossy_ball import BODIES, TERMS, noise, scene

Floats = NDArray[np.float64]
Figures = dict[str, dict[str, list[float]]]  # by scene and term, over ROUGHNESS
ROUGHNESS = (0.0, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2, 0.3, 0.5, 0.7, 1.0)
# The floor: none, one that emits light and scatters none, or one that the ball lights.
FLOORS = ("none", "glowing", "matte")
# The light above the ball.
LIGHTS = ("sky", "image", "area", "sphere", "mesh", "point", "sun")


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
    """Measure, print and plot."""
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
