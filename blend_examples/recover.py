"""Find again what was lost, from pictures, and draw how it went.

    python blend_examples/recover.py              # all of recovery_scenes.RECOVERIES
    python blend_examples/recover.py shadow lamp  # some

A picture for each goes to blend_examples/output/recover_NAME.png: a row per start, with the start, the target, what was
found, and the difference four times enlarged. The last line printed is JSON: what part of each start's error is left.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot
from recovery_scenes import RECOVERIES, Recovery, lost_and_found  # type: ignore[import-not-found]

from edgegrad import images
from edgegrad.progress import ProgressBar

OUTPUT = Path(__file__).resolve().parent / "output"


def main() -> int:
    """Run the searches named on the command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", default=list(RECOVERIES), help=", ".join(RECOVERIES))
    names = parser.parse_args().name
    for name in names:
        if name not in RECOVERIES:
            parser.error(f"there is no '{name}'; there are {', '.join(RECOVERIES)}")
    OUTPUT.mkdir(exist_ok=True)
    print(json.dumps({name: draw(RECOVERIES[name], OUTPUT / f"recover_{name}.png") for name in names}))
    return 0


def draw(recovery: Recovery, path: Path) -> dict[str, float]:
    """Search from every start and draw a row for each; returns what part of their errors is left."""
    left, rows = {}, []
    for start in recovery.starts:
        with ProgressBar(f"{recovery.title}, from '{start}'") as bar:
            found = lost_and_found(recovery, start, progress=bar.update)
        left[start] = round(found.error / found.error_before, 4)
        rows.append((f"{start}\n{found.error_before:.3g} to {found.error:.3g}", found))
    figure, axes = pyplot.subplots(len(rows), 4, figsize=(8.4, 2.2 * len(rows)), squeeze=False)
    for row, (line, (label, found)) in enumerate(zip(axes, rows, strict=True)):
        line[0].set_ylabel(label)
        shown: dict[str, Any] = {"start": found.before, "target": found.target, "found": found.after}
        shown["difference x 4"] = 4.0 * np.abs(found.after - found.target)
        for axis, (title, picture) in zip(line, shown.items(), strict=True):
            axis.imshow(images.linear_to_srgb(np.clip(picture, 0.0, 1.0)), interpolation="nearest")
            axis.set_title("" if row else title, fontsize=9)
            axis.set_xticks([]), axis.set_yticks([])
    figure.suptitle(recovery.title)
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    pyplot.close(figure)
    print(f"picture: {path}", file=sys.stderr)
    return left


if __name__ == "__main__":
    sys.exit(main())
