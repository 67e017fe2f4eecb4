"""Build the Blender extension: one zip with the add-on and wheels of Edgegrad and of what it needs.

    python addon/build_extension.py --interpreter python3.11 --interpreter python3.13 --python-version 3.14

Each interpreter contributes wheels for its own Python version: Edgegrad built from this source tree, its dependencies
from the package index. 3.11 serves Blender 4.2 to 5.0; 3.12 or newer gives the stable-ABI wheel for Blender 5.1 on.
Versions that no interpreter here has, like those of Blenders that Linux distributions build with their own Python, get
the dependencies alone: the stable-ABI wheel serves them.
The zip is built by Blender's own packager: that of the Blender executable, or of the bpy module installed beside this
Python. Not part of the installed add-on.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ADDON = Path(__file__).resolve().parent
PROJECT = ADDON.parent
MANIFEST = "blender_manifest.toml"
# Blender brings its own numpy, and a second one in the same process would break it.
BROUGHT_BY_BLENDER = ("numpy",)
NOT_PACKAGED = shutil.ignore_patterns(Path(__file__).name, "__pycache__", "*.pyc", ".*")


def requirements() -> list[str]:
    """The project's run-time dependencies that Blender does not bring."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]
    names = {text: re.split(r"[^A-Za-z0-9_.-]", text, maxsplit=1)[0].lower() for text in project["dependencies"]}
    return [text for text, name in names.items() if name not in BROUGHT_BY_BLENDER]


def build_wheel(interpreter: str, folder: Path) -> None:
    """Put Edgegrad's wheel, built by the interpreter, into the folder.

    Raises
    ------
    RuntimeError
        If it cannot be built.
    """
    if subprocess.run([*_pip(interpreter), "wheel", "--no-deps", "--wheel-dir", str(folder), str(PROJECT)],
                      check=False).returncode:
        raise RuntimeError(f"could not build Edgegrad's wheel with {interpreter}")


def collect_dependencies(interpreter: str, folder: Path, version: str | None = None) -> None:
    """Put the wheels of Edgegrad's dependencies into the folder.

    Parameters
    ----------
    interpreter
        The Python whose pip gets them.
    folder
        Where to put them.
    version
        The Python version that they are for, like "3.14"; None: the interpreter's own.

    Raises
    ------
    RuntimeError
        If one does not exist for this Python version.
    """
    # --no-deps: all that these need is numpy, or named in the project itself.
    command = [*_pip(interpreter), "download", "--no-deps", "--only-binary=:all:", "--dest", str(folder)]
    command += ["--implementation", "cp", "--python-version", version] if version else []
    if subprocess.run([*command, *requirements()], check=False).returncode:
        served = f"Python {version}" if version else interpreter
        raise RuntimeError(f"could not get the dependencies' wheels for {served}")


def _pip(interpreter: str) -> list[str]:
    return [interpreter, "-m", "pip", "--quiet", "--disable-pip-version-check"]


def with_wheels(manifest: str, wheels: list[str]) -> str:
    """The manifest's text with the list of wheels added.

    Raises
    ------
    ValueError
        If it has a list of wheels already.
    """
    if "wheels" in tomllib.loads(manifest):
        raise ValueError(f"{MANIFEST}: must not list wheels; they are added when the extension is built")
    entry = f"wheels = {json.dumps(wheels, indent=2)}\n\n"
    # A key after the first table header would belong to that table.
    first_table = re.search(r"^\[", manifest, flags=re.MULTILINE)
    split = first_table.start() if first_table else len(manifest)
    return f"{manifest[:split].rstrip()}\n{entry}{manifest[split:]}"


def packager(blender: str | None) -> list[str]:
    """Command of Blender's extension packager, without its sub-command.

    Raises
    ------
    RuntimeError
        If there is neither a Blender executable nor a bpy module.
    """
    executable = blender or shutil.which("blender")
    if executable:
        return [executable, "--background", "--factory-startup", "--command", "extension"]
    bpy = importlib.util.find_spec("bpy")  # found, not imported: only its files are needed
    if bpy is not None and bpy.origin:
        scripts = sorted(Path(bpy.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
        if scripts:
            return [sys.executable, str(scripts[-1])]
    raise RuntimeError("found neither a Blender executable (--blender PATH) nor the bpy module, whose packager is used")


def build(interpreters: list[str], versions: list[str], output: Path, blender: str | None = None) -> None:
    """Write the extension's zip into the folder `output`.

    Raises
    ------
    RuntimeError
        If a wheel or the packager is missing, or a version has no wheel of Edgegrad that serves it.
    """
    command = packager(blender)
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        stage = Path(temporary) / "edgegrad"
        shutil.copytree(ADDON, stage, ignore=NOT_PACKAGED)
        wheels = stage / "wheels"
        wheels.mkdir()
        for interpreter in interpreters:
            build_wheel(interpreter, wheels)
            collect_dependencies(interpreter, wheels)
        if versions and not list(wheels.glob("edgegrad-*-abi3-*.whl")):
            raise RuntimeError("--python-version needs the stable-ABI wheel: add --interpreter of Python 3.12 or newer")
        for version in versions:
            collect_dependencies(interpreters[0], wheels, version)
        manifest = stage / MANIFEST
        listed = [f"./wheels/{path.name}" for path in sorted(wheels.glob("*.whl"))]
        manifest.write_text(with_wheels(manifest.read_text(), listed))
        subprocess.run([*command, "build", "--source-dir", str(stage), "--output-dir", str(output.resolve())],
                       check=True)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interpreter", action="append", help="Python to make wheels for (default: this one)")
    parser.add_argument("--python-version", action="append", default=[],
                        help="version, like 3.14, that no interpreter here has but a Blender does")
    parser.add_argument("--blender", help="Blender executable whose packager is used")
    parser.add_argument("--output", type=Path, default=PROJECT / "dist", help="folder of the zip")
    arguments = parser.parse_args()
    try:
        build(arguments.interpreter or [sys.executable], arguments.python_version, arguments.output, arguments.blender)
    except (RuntimeError, ValueError, subprocess.CalledProcessError) as error:
        sys.exit(f"build_extension: {error}")


if __name__ == "__main__":
    main()
