"""Make the pictures of the concepts page: a scene, its derivative term by term, and finite differences beside it.

    python -m docs.make_pictures              # all
    python -m docs.make_pictures all_terms    # some of picture_scenes.CASES

The pictures go to docs/pictures/NAME.png. For each the script prints how far the sum of the terms is from the
finite difference, relative to the derivative, in means over 8 x 8 pixels.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot
from numpy.typing import NDArray

import edgegrad
from docs.picture_scenes import CASES, Case
from edgegrad import images, parameters

PICTURES = Path(__file__).resolve().parent / "pictures"
PICTURE_SPP, DERIVATIVE_SPP, DIFFERENCE_SPP = 512, 1024, 8192
NAMES = {
    "interior": "interior", "primary": "primary boundary", "shadow": "shadow boundary", "indirect": "indirect boundary",
}  # fmt: skip


def main() -> int:
    """Make the pictures named on the command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", default=list(CASES), help=", ".join(CASES))
    names = parser.parse_args().name
    for name in names:
        if name not in CASES:
            parser.error(f"there is no '{name}'; there are {', '.join(CASES)}")
    PICTURES.mkdir(exist_ok=True)
    for name in names:
        print(f"{name}: error of blocks {draw(CASES[name](), PICTURES / f'{name}.png'):.3f}", flush=True)
    return 0


def draw(case: Case, path: Path) -> float:
    """Draw one case; returns the relative error of the sum of all terms in means over blocks."""
    picture = edgegrad.render(case.scene, PICTURE_SPP, max_depth=case.max_depth)
    parts = {
        term: edgegrad.render_forward(case.scene, case.tangent, DERIVATIVE_SPP, max_depth=case.max_depth, terms=[term])
        for term in edgegrad.TERMS
    }
    total = np.sum(list(parts.values()), axis=0)
    difference = finite_difference(case)
    scale = float(np.quantile(np.abs(difference).mean(axis=2), 0.99))
    shown: list[tuple[str, NDArray[Any]]] = [("picture", images.linear_to_srgb(np.clip(picture, 0.0, 1.0)))]
    derivatives = [(NAMES[term], parts[term]) for term in case.terms]
    derivatives += [("sum of all terms", total), ("finite difference", difference)]
    shown += [(title, images.derivative_image(part, scale)) for title, part in derivatives]
    columns = {6: 3, 7: 4}.get(len(shown), len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = pyplot.subplots(rows, columns, figsize=(2.3 * columns, 2.0 * rows + 0.3), squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for axis, (title, part) in zip(axes.flat, shown, strict=False):
        axis.imshow(part, interpolation="nearest")
        axis.set_title(title, fontsize=9)
    figure.suptitle(case.title, fontsize=10)
    figure.tight_layout(pad=0.4)
    figure.savefig(path, dpi=110, pil_kwargs={"optimize": True})
    pyplot.close(figure)
    return float(np.linalg.norm(blocks(total - difference)) / np.linalg.norm(blocks(difference)))


def finite_difference(case: Case) -> NDArray[np.float32]:
    """The central difference of two pictures with the same random numbers."""
    ends = []
    for sign in (-0.5, 0.5):
        scene = replace(case.scene, meshes={name: replace(mesh) for name, mesh in case.scene.meshes.items()})
        for path, tangent in case.tangent.items():
            parameters.put(scene, path, parameters.get(scene, path) + sign * case.step * tangent)
        ends.append(edgegrad.render(scene, DIFFERENCE_SPP, max_depth=case.max_depth))
    return np.asarray((ends[1] - ends[0]) / case.step, np.float32)


def blocks(picture: NDArray[np.float32], size: int = 8) -> NDArray[np.float32]:
    """Means over size x size pixels."""
    height, width = (side // size for side in picture.shape[:2])
    cut = picture[: height * size, : width * size]
    return np.asarray(cut.reshape(height, size, width, size, -1).mean(axis=(1, 3)))


if __name__ == "__main__":
    sys.exit(main())
