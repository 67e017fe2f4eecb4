"""The add-on in a real Blender: its own Embree and TBB are in the process there, unlike with the bpy module.

    make test-gui BLENDER=/path/to/blender EXTENSION=dist/edgegrad-0.1.0-linux_x64.zip
"""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess

import pytest

pytestmark = pytest.mark.gui

BLENDER = os.environ.get("BLENDER") or shutil.which("blender")
EXTENSION = os.environ.get("EXTENSION", "")

# Native engine, Cycles (which uses Blender's Embree), native engine again: the same picture, from the wheel's Embree.
SCRIPT = """
import bpy, numpy, edgegrad
scene = edgegrad.Scene(
    edgegrad.Camera(numpy.eye(4), 0.7, 32, 32),
    {"t": edgegrad.Mesh([[-1, -1, -3], [1, -1, -3], [0, 1, -3]], [[0, 1, 2]], ("m",))},
    {"m": edgegrad.Material()}, world=edgegrad.World(numpy.ones(3)))
first = edgegrad.render(scene, 16, engine="native")
bpy.context.scene.render.engine = "CYCLES"
bpy.context.scene.cycles.samples = 1
bpy.context.scene.render.resolution_percentage = 5
bpy.ops.render.render()
second = edgegrad.render(scene, 16, engine="native")
assert first.std() > 0 and numpy.array_equal(first, second)
with open("/proc/self/maps") as maps:
    loaded = {line.split()[-1] for line in maps if "libembree4" in line or "libtbb" in line}
print("LOADED", *sorted(loaded))
assert any("embreex.libs/libembree4" in path for path in loaded)
assert {"FINISHED"} == bpy.ops.edgegrad.render()
print("ALL WELL")
"""


@pytest.fixture
def environment(tmp_path: pathlib.Path) -> dict[str, str]:
    if not BLENDER or not EXTENSION:
        pytest.skip("needs a Blender executable (BLENDER=…) and the extension's zip (EXTENSION=…)")
    return dict(os.environ, BLENDER_USER_RESOURCES=str(tmp_path))


def test_native_engine_beside_blenders_own_embree(environment: dict[str, str], tmp_path: pathlib.Path) -> None:
    install = [str(BLENDER), "--offline-mode", "--command", "extension", "install-file", "--repo", "user_default",
               "--enable", EXTENSION]
    said = subprocess.run(install, env=environment, capture_output=True, text=True, check=True).stdout
    assert "STATUS Installed" in said, said  # it ends with 0 even where it fails
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    start = [str(BLENDER), "--background", "--offline-mode", "--python-exit-code", "1", "--python", str(script)]
    run = subprocess.run(start, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0 and "ALL WELL" in run.stdout, run.stdout + run.stderr
