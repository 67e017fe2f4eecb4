"""``python -m tests.benchmarks.recoveries [CASE …]``: a table of errors before and after fits to Cycles' pictures.

For each case, the scene is built and rendered by Cycles, what is to be found is changed, and the .blend is fitted by
the command line, which saves another .blend; the values there are compared with the truth. The error is the largest of
a case's numbers, of vertices and pixels the median.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad_addon import command_line
from edgegrad_addon.animated import data_path
from tests.benchmarks.recoveries.cases import CASES, Case

TARGET_SAMPLES = 512
EXPOSURE = 0.7  # stops, of coded targets


def values(paths: list[str]) -> NDArray[np.float64]:
    """The numbers of properties, the vertices of objects, or the pixels of images, one after the other."""
    out: list[float] = []
    for path in paths:
        ob = bpy.data.objects.get(path)
        if path in bpy.data.images:
            out += colors(bpy.data.images[path])[..., :3].ravel().tolist()
        elif ob is None:
            out += [place.read() for place in data_path.find(path)]
        else:
            keys = ob.data.shape_keys
            points = ob.data.vertices if keys is None else keys.key_blocks[-1].data
            out += [float(x) for point in points for x in point.co]
    return np.array(out)


def colors(image: Any) -> NDArray[np.float32]:
    """(pixels, channels) of an image."""
    return np.array(image.pixels, np.float32).reshape(-1, image.channels)


def assign(paths: list[str], numbers: NDArray[np.float64]) -> None:
    """Set what `values` returns."""
    rest = iter(numbers.tolist())
    for path in paths:
        ob = bpy.data.objects.get(path)
        if path in bpy.data.images:
            image = bpy.data.images[path]
            pixels = colors(image)
            pixels[:, :3] = [[next(rest) for _ in range(3)] for _ in pixels]
            image.pixels.foreach_set(pixels.ravel())
            image.pack()
        elif ob is None:
            for place in data_path.find(path):
                place.write(next(rest))
        else:
            for vertex in ob.data.vertices:
                vertex.co = [next(rest) for _ in range(3)]
            ob.data.update()
    bpy.context.view_layer.update()


def render(name: str, case: Case, seed: int, denoised: bool, folder: Path) -> list[str]:
    """Render the targets by Cycles; return the options that name them."""
    scene, targets = bpy.context.scene, list[str]()
    cycles, view, output = scene.cycles, scene.view_settings, scene.render.image_settings
    cycles.samples, cycles.seed, view.view_transform = TARGET_SAMPLES, seed, "AgX"
    if case.saved:
        cycles.samples, cycles.use_adaptive_sampling, cycles.adaptive_threshold = 4096, True, 0.01
        cycles.use_denoising, cycles.film_exposure = denoised, 2.0**EXPOSURE
    if case.saved == "agx":
        output.file_format, output.color_depth, scene.render.dither_intensity = "PNG", "8", 1.0
    for camera in case.cameras:
        scene.camera = bpy.data.objects[camera]
        scene.render.filepath = str(folder / f"{name}_{camera}.{'png' if case.saved == 'agx' else 'exr'}")
        bpy.ops.render.render(write_still=True)
        targets += ["--target", f"{camera}={scene.render.filepath}"]
    cycles.film_exposure = 1.0
    return targets


def run(name: str, size: int, samples: int, seed: int, denoised: bool, folder: Path) -> str:
    """Build, render, change and fit a case; return its row."""
    case = CASES[name]
    lost, change = case.build(size)
    paths = list(lost)
    targets = render(name, case, seed, denoised, folder)
    truth = values(paths)
    assign(paths, truth + change)
    before = np.abs(values(paths) - truth)
    start, fitted, out = folder / f"{name}_start.blend", folder / f"{name}_fitted.blend", folder / name
    many = [path for path in paths if path in bpy.data.objects or path in bpy.data.images]
    named = [word for path in paths for word in ("--parameter" if path not in many else "--image"
                                                 if path in bpy.data.images else "--vertices", path)]  # fmt: skip
    bpy.ops.wm.save_as_mainfile(filepath=str(start), copy=True)
    began = time.process_time()
    code = command_line.main(["fit", str(start), *targets, *named, "--iterations", str(case.iterations), "--samples",
                              str(samples), "--seed", str(seed), "--save", str(fitted), "--out", str(out),
                              *case.options])  # fmt: skip
    seconds = time.process_time() - began
    if code:
        return f"| {name} | {case.title} | failed | | {seconds:.0f} |"
    bpy.ops.wm.open_mainfile(filepath=str(fitted))
    after = np.abs(values(paths) - truth)
    report = json.loads((out / "report.json").read_text())
    told = "; ".join(one["sentence"] for one in report["uncertainty"])
    print(f"{name}: {told}", flush=True)
    # Some vertices of a cage, and some pixels of an image, are hidden from all cameras.
    of = np.median if many else np.max
    return f"| {name} | {case.title} | {of(before):.3g} | {of(after):.2g} | {seconds:.0f} |"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help=f"some of {', '.join(CASES)} (default: all)")
    parser.add_argument("--size", type=int, default=128, help="pixels along each side")
    parser.add_argument("--samples", type=int, default=8, help="samples per pixel of each iteration")
    parser.add_argument("--seed", type=int, default=0, help="seed of the targets and of the fits")
    parser.add_argument("--noisy", action="store_true", help="leave Cycles' denoising out where it is on by default")
    parser.add_argument("--output", type=Path, default=Path("build/recoveries"), help="folder of the files")
    arguments = parser.parse_args()
    folder = arguments.output.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in arguments.cases or list(CASES):
        rows.append(run(name, arguments.size, arguments.samples, arguments.seed, not arguments.noisy, folder))
        print(rows[-1], flush=True)
    print("\n".join(["| case | found | error before | after | CPU seconds |", "|---|---|---|---|---|", *rows]))


if __name__ == "__main__":
    main()
