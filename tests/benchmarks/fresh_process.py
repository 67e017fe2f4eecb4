"""One renderer's first picture in a process of its own: seconds and memory."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass
class FirstPicture:
    """Seconds of the import, and of the first picture after it (scene construction included); peak memory."""

    import_seconds: float
    seconds: float
    peak_mib: float


def peak_mib() -> float:
    """The process's largest resident memory so far."""
    # Not getrusage: a child's ru_maxrss starts with its parent's.
    status = Path("/proc/self/status").read_text()
    line = next(line for line in status.splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def measure(renderer: str, scene: dict[str, Any], spp: int, threads: int, home: Path | None = None) -> FirstPicture:
    """Start a process in which "edgegrad" or "mitsuba" renders its first picture of a scene of `scenes`.

    `home` is the folder of Mitsuba's cache of compiled kernels; None: the user's.
    """
    environment = os.environ | ({"HOME": str(home)} if home else {})
    with tempfile.TemporaryDirectory() as folder:
        stored = Path(folder) / "scene"
        stored.write_bytes(pickle.dumps(scene))
        module = "tests.benchmarks.fresh_process"
        command = [sys.executable, "-m", module, renderer, str(stored), str(spp), str(threads)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{done.stderr[-2000:]}")
    return FirstPicture(**json.loads(done.stdout.splitlines()[-1]))


def _first_picture(renderer: str, scene: dict[str, Any], spp: int, threads: int) -> FirstPicture:
    start = time.perf_counter()
    if renderer == "edgegrad":
        import edgegrad
        from tests.support import peer_scenes

        imported = time.perf_counter()
        prepared = edgegrad.Renderer(peer_scenes.to_edgegrad(scene), threads=threads, engine="native")
        prepared.render(spp=spp, max_depth=int(scene["max_depth"]))
    else:
        from tests.benchmarks.mitsuba_peer import MitsubaPeer, load_mitsuba

        load_mitsuba(threads)
        imported = time.perf_counter()
        MitsubaPeer(scene, threads).render(spp=spp, seed=0)
    return FirstPicture(imported - start, time.perf_counter() - imported, peak_mib())


def _main() -> None:
    renderer, stored, spp, threads = sys.argv[1:]
    scene = pickle.loads(Path(stored).read_bytes())
    print(json.dumps(vars(_first_picture(renderer, scene, int(spp), int(threads)))))


if __name__ == "__main__":
    _main()
