"""A process with little room: ``python -m tests.torture.limited CALL`` prints what became of the call in ever less."""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from edgegrad import Renderer
from tests.torture.dense import dense_scene

MEGABYTE = 1 << 20


@contextmanager
def room(megabytes: int) -> Iterator[None]:
    """Limit the memory to the memory in use and some megabytes."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + megabytes * MEGABYTE, resource.RLIM_INFINITY))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def main() -> None:
    scene = dense_scene(300)
    box, path = scene.meshes["box"], "meshes.box.vertices"
    scene.camera.width = scene.camera.height = 512
    start = box.vertices
    renderer = Renderer(scene, threads=2)
    options: dict[str, Any] = {"spp": 1, "max_depth": 3, "seed": 1}
    adjoint = np.ones((512, 512, 3), np.float32)
    expected = renderer.render(**options)

    def update() -> None:
        box.vertices = start * 1.5
        renderer.update()

    calls: dict[str, Callable[[], object]] = {
        "picture": lambda: renderer.render(**options),
        "gradient": lambda: renderer.render_backward(adjoint, [path], **options),
        "construction": lambda: Renderer(scene, threads=2).render(**options),  # builds the BVH
        "update": update,
    }
    for megabytes in (1, 2, 4, 8, 16, 32, 64):
        try:
            with room(megabytes):
                calls[sys.argv[1]]()
            print(megabytes, "done")
        except MemoryError:
            print(megabytes, "MemoryError")
        box.vertices = start
        renderer.update()
        # Refitted or built anew, a BVH finds the same surfaces.
        assert np.mean(np.abs(renderer.render(**options) - expected) > 1e-3 * expected.max()) < 1e-3


if __name__ == "__main__":
    main()
