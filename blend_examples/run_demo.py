"""The main job, end to end: build a .blend, render targets with Cycles, fit headless, measure against the truth.

    python blend_examples/run_demo.py

Pictures and the loss curve go to blend_examples/output/. The last line printed is JSON.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import build_sculpt  # type: ignore[import-not-found]
import numpy as np
from matplotlib import pyplot
from measure import Measured, measure  # type: ignore[import-not-found]

from edgegrad import images

OUTPUT = build_sculpt.OUTPUT
ITERATIONS = 112
SAMPLES = 4
VIEWS_PER_ITERATION = 4
# Spreads a vertex's move over a few edges only: the patches' borders then tell where each vertex belongs.
SMOOTHNESS = 8.0
VERTEX_STEP = 0.009
# The glaze's borders show where vertices slide along the surface, so all of that motion is kept.
SLIDE = 1.0


def main() -> int:
    """Run the demo; returns the exit code."""
    started = time.monotonic()
    say("1/4  building the scene and rendering its targets with Cycles")
    targets = build_sculpt.build(OUTPUT)
    say("2/4  derivative of the first picture for growing along the normals")
    edgegrad("gradient", "start.blend", "--vertices", build_sculpt.SCULPT, "--out", str(OUTPUT / "gradient.png"))
    say("3/4  fitting shape and colours, headless")
    edgegrad("fit", "start.blend", *fit_arguments(targets))
    say("4/4  measuring and drawing")
    before, after = (measure(OUTPUT / name, OUTPUT / "true.blend") for name in ("start.blend", "fitted.blend"))
    before_images, after_images = read_pictures("before", targets), read_pictures("after", targets)
    target_images = [images.read_image(path) for path in targets.values()]
    draw_pictures(list(targets), before_images, target_images, after_images, OUTPUT / "comparison.png")
    # Every other view: small enough for a README.
    draw_pictures(
        list(targets)[::2], before_images[::2], target_images[::2], after_images[::2], OUTPUT / "summary.png"
    )
    draw_losses(json.loads((OUTPUT / "report.json").read_text())["losses"], OUTPUT / "loss.png")
    result = numbers(before, after) | {
        "image_error_before": image_error(before_images, target_images),
        "image_error": image_error(after_images, target_images),
        "seconds": time.monotonic() - started,
    }
    say(f"pictures: {OUTPUT / 'comparison.png'}, gradient.png, loss.png; result: fitted.blend")
    print(json.dumps({name: round(value, 6) for name, value in result.items()}), flush=True)
    return 0


def say(text: str) -> None:
    """One line of progress."""
    print(text, file=sys.stderr, flush=True)


def edgegrad(command: str, blend: str, *arguments: str) -> None:
    """Run Edgegrad's public command line on a .blend of the output folder; its progress shows in the terminal."""
    subprocess.run([sys.executable, "-m", "edgegrad", command, str(OUTPUT / blend), *arguments], check=True)


def fit_arguments(targets: dict[str, Path]) -> list[str]:
    """What ``python -m edgegrad fit start.blend`` is told."""
    out = ["--vertices", build_sculpt.SCULPT]
    for name in build_sculpt.MATERIALS:
        out += ["--base-color", name]
    for camera, path in targets.items():
        out += ["--target", f"{camera}={path}"]
    out += ["--iterations", str(ITERATIONS), "--samples", str(SAMPLES), "--smoothness", str(SMOOTHNESS)]
    out += ["--vertex-step", str(VERTEX_STEP), "--slide", str(SLIDE)]
    out += ["--views-per-iteration", str(VIEWS_PER_ITERATION)]
    return [*out, "--out", str(OUTPUT), "--save", str(OUTPUT / "fitted.blend")]


def numbers(before: Measured, after: Measured) -> dict[str, float]:
    """The measures before and after, by the names of the last line."""
    return {
        "iou_before": before.iou,
        "iou": after.iou,
        "vertex_error_before": before.vertex_error,
        "vertex_error": after.vertex_error,
    }


def read_pictures(prefix: str, targets: dict[str, Path]) -> list[Any]:
    """The pictures that the fit wrote, in the order of the targets."""
    written = json.loads((OUTPUT / "report.json").read_text())["pictures"]
    return [images.read_image(OUTPUT / written[camera][prefix][0]) for camera in targets]


def image_error(pictures: list[Any], targets: list[Any]) -> float:
    """Mean absolute difference of all pictures to their targets, linear."""
    return float(np.mean([np.abs(a - b).mean() for a, b in zip(pictures, targets, strict=True)]))


def draw_pictures(names: list[str], before: list[Any], target: list[Any], after: list[Any], path: Path) -> None:
    """A row each for start, target (Cycles), result and remaining difference; a column per camera."""
    rows = {
        "start": before,
        "target (Cycles)": target,
        "fitted": after,
        "difference x 4": [4.0 * np.abs(a - b) for a, b in zip(after, target, strict=True)],
    }
    figure, axes = pyplot.subplots(len(rows), len(names), figsize=(1.9 * len(names), 1.95 * len(rows)), squeeze=False)
    for line, (label, pictures) in zip(axes, rows.items(), strict=True):
        line[0].set_ylabel(label)
        for axis, name, picture in zip(line, names, pictures, strict=True):
            axis.imshow(images.linear_to_srgb(np.clip(picture, 0.0, 1.0)))
            axis.set_xticks([])
            axis.set_yticks([])
            if label == "start":
                axis.set_title(name, fontsize=9)
    figure.tight_layout(pad=0.4)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def draw_losses(losses: list[float], path: Path) -> None:
    """The loss curve."""
    figure, axis = pyplot.subplots(figsize=(6, 3.5))
    axis.semilogy(losses)
    axis.set_xlabel("iteration")
    axis.set_ylabel("loss")
    axis.grid(alpha=0.3, which="both")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


if __name__ == "__main__":
    sys.exit(main())
