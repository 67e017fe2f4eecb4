"""Fits of colours by the add-on's command line, on the scenes of the comparison with Cycles, as a user runs them.

``python -m tests.benchmarks.corpus.headless_fits SCENE …`` changes the base colour of one object in the .blend, and has
``python -m edgegrad fit`` fit it to Cycles' picture and save it; the colour that is then in the .blend is compared.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene import parameters
from edgegrad_addon import parameters as blender_parameters
from edgegrad_addon.export import export_scene
from tests.benchmarks import versus_cycles
from tests.benchmarks.corpus import fits
from tests.benchmarks.corpus.objects import candidates
from tests.benchmarks.cycles_scenes import CASES


def run(name: str, output: Path) -> tuple[str, float, float]:
    """Return the object, and the largest error of a channel of its colour before and after."""
    case = CASES[name]
    theirs, _ = versus_cycles.by_cycles(case, output, case.samples, versus_cycles.SEEDS)
    exported = export_scene(bpy.context.scene)
    for one in candidates(exported.scene):
        problem = fits.color_problem(exported, theirs, one)
        if problem is not None and problem.expected <= 0.5 * fits.COLOR_ERROR:
            break
    else:
        raise SystemExit(f"{name}: the picture determines no colour of an object")
    start, fitted, target = (output / f"{name}_{what}" for what in ("start.blend", "fitted.blend", "target.exr"))
    truth = np.array(parameters.get(exported.scene, problem.path), np.float64)
    blender_parameters.write(exported, problem.path, truth, problem.start, in_place=False)
    camera, material = bpy.context.scene.camera.name, parameters.split(problem.path)[1]
    bpy.ops.wm.save_as_mainfile(filepath=str(start), copy=True)
    edgegrad.images.write_image(target, np.asarray(theirs.mean(axis=0, dtype=np.float64), np.float32))
    subprocess.run([sys.executable, "-m", "edgegrad", "fit", str(start), "--base-color", material, "--target",
                    f"{camera}={target}", "--iterations", str(fits.ITERATIONS), "--save", str(fitted)],
                   check=True)  # fmt: skip
    return one.name, problem.error(_color(start, problem.path)), problem.error(_color(fitted, problem.path))


def _color(blend: Path, path: str) -> NDArray[np.float64]:
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    return np.array(parameters.get(export_scene(bpy.context.scene).scene, path), np.float64)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", help="names of scenes, as for tests.benchmarks.versus_cycles")
    parser.add_argument("--output", type=Path, default=Path("build/compare-cycles"), help="folder of the files")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    output.mkdir(parents=True, exist_ok=True)
    for name in arguments.scenes:
        one, before, after = run(name, output)
        print(f"| {name} | {one} | {before:.3f} | {after:.3f} |", flush=True)


if __name__ == "__main__":
    main()
