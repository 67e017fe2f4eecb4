"""Cost and noise of derivatives of the tests' scenes: ``python -m tests.benchmarks.case_noise MODULE [name ...]``.

MODULE is a module below `tests` with a table CASES, such as ``support.scenes.mirrors_and_glass``. Each row has the
processor seconds of a derivative, the variance over seeds of 8 x 8 block means and of pixels (means over the picture),
and the fraction of blocks that are exactly 0 with one seed, though not with all. ``--save FILE`` writes the rows.
``--before FILE`` prints ratios to saved rows instead, and their geometric mean: save, change a constant, build, and
compare.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pathlib
import time
from typing import Any

import numpy as np

from edgegrad import TERMS, Renderer
from tests.support.block_statistics import block_sums
from tests.support.small_scenes import Make, along

BLOCK = 8
COLUMNS = ("seconds", "variance of blocks", "variance of pixels", "missed blocks")


def parts(case: Any, depth: int) -> tuple[Make, list[str], dict[str, Any]]:
    """The motion, the parameters and the options of a row of CASES."""
    if isinstance(case, tuple):
        make, paths, *more = (*case[0], *case[1:]) if isinstance(case[0], tuple) else case
        given = more[0] if more else depth
        return make, paths, {"max_depth": given.get("max_depth", depth) if isinstance(given, dict) else given}
    return case.make, [case.path], {"max_depth": case.max_depth, "bounces": case.bounces}


def measure(make: Make, paths: list[str], spp: int, seeds: int, **options: Any) -> list[float]:
    """The row of a case."""
    scene, rate = along(make, paths)(0.0)
    renderer = Renderer(scene)
    renderer.render_forward(rate, spp=1, **options)  # builds the BVH, and finds the edges
    start = time.process_time()
    pictures = np.array([renderer.render_forward(rate, spp=spp, seed=seed, **options) for seed in range(seeds)])
    seconds = (time.process_time() - start) / seeds
    blocks = np.array([block_sums(picture, BLOCK) for picture in pictures]) / BLOCK**2
    variances = [float(np.mean(np.var(values, axis=0, ddof=1))) for values in (blocks, pictures)]
    return [seconds, *variances, float(np.mean((blocks == 0.0) & (blocks != 0.0).any(axis=0)))]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("module")
    parser.add_argument("names", nargs="*")
    parser.add_argument("--terms", nargs="+", choices=TERMS, default=list(TERMS))
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--depth", type=int, default=4, help="path segments of cases that do not name them")
    parser.add_argument("--save", type=pathlib.Path)
    parser.add_argument("--before", type=pathlib.Path)
    args = parser.parse_args()
    cases = importlib.import_module(f"tests.{args.module}").CASES
    before = json.loads(args.before.read_text()) if args.before else {}
    rows: dict[str, list[float]] = {}
    print(f"{'':>45}", *(f"{column:>18}" for column in COLUMNS))
    for name in args.names or cases:
        make, paths, options = parts(cases[name], args.depth)
        rows[name] = measure(make, paths, args.spp, args.seeds, terms=args.terms, **options)
        with np.errstate(divide="ignore", invalid="ignore"):
            shown = np.divide(rows[name], before[name]) if name in before else rows[name]
        print(f"{name:>45}", *(f"{value:18.3g}" for value in shown), flush=True)
    if common := [name for name in rows if name in before]:
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = np.array([np.divide(rows[name], before[name]) for name in common])
            mean = np.exp(np.nanmean(np.log(np.where(ratios > 0.0, ratios, np.nan)), axis=0))
        print(f"{'geometric mean':>45}", *(f"{value:18.3g}" for value in mean))
    if args.save:
        args.save.write_text(json.dumps(rows))


if __name__ == "__main__":
    main()
