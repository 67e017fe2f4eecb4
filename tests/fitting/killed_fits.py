"""Fits whose process is killed at random moments, and that go on from their checkpoints.

``python -m tests.fitting.killed_fits --count 50`` kills 50 processes. Each one begins or goes on with a fit until it is
killed; the fit that is left is then finished. Its result must have the bits of a fit that nobody interrupted.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import edgegrad
from edgegrad.fitting.checkpoints.checkpoint_file import read_tree
from edgegrad.images.output_files import TEMPORARY
from tests.support.fits import COLOR, POWER, VERTICES, ball, picture

ITERATIONS = 60


def fit(result: Path, checkpoint: Path | None) -> None:
    """Fit the ball from its start or from the checkpoint, and store the result."""
    scene = ball()
    found = edgegrad.fit(
        scene, edgegrad.Target(picture(ball(1.2))), [VERTICES, COLOR, POWER], iterations=ITERATIONS, spp=2, threads=1,
        checkpoint=checkpoint, checkpoint_every=1, resume=checkpoint is not None,
        callback=None if checkpoint is None else lambda _: print("step", flush=True),
    )  # fmt: skip
    np.savez(result, losses=np.array(found.losses), best=found.best, **found.values)


def kill_fits(folder: Path, count: int, seed: int = 0) -> tuple[int, int]:
    """Kill `count` fits one after the other, each a while after its first step, and finish the last one.

    Returns
    -------
    How many were killed before their end, and how many of these had left a temporary file.

    Raises
    ------
    AssertionError
        If a checkpoint is damaged, or if the result is another one than without interruptions.
    """
    chance = random.Random(seed)
    checkpoint, plain, resumed = folder / "fit.npz", folder / "plain.npz", folder / "resumed.npz"
    fit(plain, None)
    killed = left = 0
    for _ in range(count):
        if checkpoint.exists() and read_tree(checkpoint)["state"]["done"] > ITERATIONS // 2:
            checkpoint.unlink()  # begin again, so that there is something to kill
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.fitting.killed_fits", "--run", str(checkpoint)], stdout=subprocess.PIPE,
            env=os.environ, cwd=Path(__file__).parents[2],
        )  # fmt: skip
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(chance.uniform(0.0, 0.2))
        if process.poll() is None:
            killed += 1
        process.kill()
        process.communicate()
        for path in folder.glob(f"{TEMPORARY}*"):
            left += 1
            path.unlink()
        if checkpoint.exists():
            read_tree(checkpoint)
    fit(resumed, checkpoint)
    with np.load(plain) as a, np.load(resumed) as b:
        assert a.files == b.files
        for name in a.files:
            assert np.array_equal(a[name], b[name]), f"'{name}' is another one after {killed} kills"
    return killed, left


def main() -> None:
    """Kill fits and print what happened."""
    parser = argparse.ArgumentParser(description="Kill fits at random moments, and compare what they find in the end.")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--run", type=Path, help="run one fit with this checkpoint")
    arguments = parser.parse_args()
    if arguments.run is not None:
        fit(arguments.run.with_name("result.npz"), arguments.run)
        return
    with tempfile.TemporaryDirectory() as folder:
        killed, left = kill_fits(Path(folder), arguments.count, arguments.seed)
    print(f"{killed} of {arguments.count} fits were killed before their end, {left} of them while they wrote a file; "
          "every checkpoint was whole, and the result has the bits of a fit without an interruption")  # fmt: skip


if __name__ == "__main__":
    main()
