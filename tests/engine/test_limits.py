"""Failing allocations, over-large scenes and interrupts raise; the process lives and renders on."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import edgegrad
from edgegrad import Camera, Renderer, Scene
from tests.support.small_scenes import camera, matte, need, rectangle, white_world


def floor() -> Scene:
    return Scene(camera(), {"floor": rectangle((0, 0, 0), (1, 0, 0), (0, 0, 1), "clay")},
                 {"clay": matte(0.5, 0.5, 0.5)}, world=white_world())


def test_an_interrupted_render_raises_and_the_next_one_is_whole() -> None:
    renderer = Renderer(floor())
    expected = renderer.render(spp=16)

    def stop(fraction: float) -> None:
        raise edgegrad.Cancelled("enough")

    with pytest.raises(edgegrad.Cancelled, match="enough"):
        renderer.render(spp=4096, max_depth=8, progress=stop)
    np.testing.assert_array_equal(renderer.render(spp=16), expected)


def test_an_over_large_scene_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edgegrad.tables.geometry, "MAX_FACES", 1)
    with pytest.raises(ValueError, match="scene: has 2 triangles; 1 are the most"):
        Renderer(floor())


def test_an_over_large_picture_is_refused() -> None:
    scene = floor()
    scene.camera = Camera(np.eye(4), width=60000, height=60000)
    with pytest.raises(ValueError, match="camera: a picture of 60000 x 60000 pixels is too large"):
        Renderer(scene)


_STARVED = """
import resource
import numpy as np
import edgegrad
from tests.engine.test_limits import floor
from edgegrad import Mesh, Renderer

before = Renderer(floor(), threads=1).render(spp=4)
n = 1200
grid = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2)
vertices = np.concatenate([grid / n, np.zeros((n * n, 1))], axis=1)
at = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1, 1)
faces = np.concatenate([at + [0, n, n + 1], at + [0, n + 1, 1]]).astype(np.int32)
scene = floor()
scene.meshes = {"grid": Mesh(vertices, faces, ("clay",))}
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
raised = 0
for room in EXTRA:
    resource.setrlimit(resource.RLIMIT_AS, (used + room, resource.RLIM_INFINITY))
    try:
        Renderer(scene, threads=1).render(spp=1)
    except MemoryError:
        raised += 1
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
np.testing.assert_array_equal(Renderer(floor(), threads=1).render(spp=4), before)
print("raised", raised)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits its own address space")
def test_a_failing_allocation_raises() -> None:
    """2.9 million triangles where there is room for none of them, for the tables, for half a BVH."""
    need("native")
    extra = "[50 << 20, 130 << 20, 200 << 20, 300 << 20, 400 << 20]"
    out = subprocess.run([sys.executable, "-c", _STARVED.replace("EXTRA", extra)], capture_output=True, text=True,
                         check=False, timeout=120)
    assert out.returncode == 0, out.stderr[-2000:]
    assert int(out.stdout.split()[-1]) >= 3
