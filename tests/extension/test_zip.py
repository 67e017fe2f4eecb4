"""The Blender extension: its zip builds, validates, and installs; no Blender executable is needed."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from typing import Any

import pytest

from extension import build as build_extension

if importlib.util.find_spec("bpy") is None:
    pytest.skip("Blender's Python module isn't installed; its packager is used", allow_module_level=True)


@pytest.fixture(scope="module")
def extension(tmp_path_factory: Any) -> Any:
    """The zip, without wheels."""
    folder = tmp_path_factory.mktemp("extension")
    source = folder / "edgegrad"
    shutil.copytree(build_extension.ADDON, source, ignore=build_extension.NOT_PACKAGED)
    packager("build", "--source-dir", str(source), "--output-dir", str(folder))
    (made,) = folder.glob("*.zip")
    return made


def packager(*arguments: Any) -> Any:
    # The module's packager even where a Blender is installed: they read the same manifest.
    done = subprocess.run([*build_extension.packager(None), *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_zip_validates(extension: Any) -> None:
    assert "error" not in packager("validate", str(extension)).lower()


def test_zip_holds_the_add_on_and_nothing_else(extension: Any) -> None:
    names = zipfile.ZipFile(extension).namelist()
    manifest = tomllib.loads(zipfile.ZipFile(extension).read("blender_manifest.toml").decode())
    assert manifest["id"] == "edgegrad" and manifest["blender_version_min"] == "4.2.0"
    assert {"__init__.py", "command_line.py", "export/scene.py", "operators/fit.py"} <= set(names)
    assert not [name for name in names if "__pycache__" in name]


INSTALLED = """
import json, sys
import bpy
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
from bl_ext.user_default.edgegrad import command_line
code = command_line.main(["render", "missing.blend", "--out", "x.png"])
print(json.dumps({"enabled": "bl_ext.user_default.edgegrad" in bpy.context.preferences.addons,
                  "iterations": bpy.context.scene.edgegrad.iterations, "code": code}))
"""


def test_zip_installs_and_enables(extension: Any, tmp_path: Any) -> None:
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", INSTALLED, str(extension)], env=environment, cwd=tmp_path,
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout.splitlines()[-1]) == {"enabled": True, "iterations": 200, "code": 1}
    assert "missing.blend" in done.stderr
