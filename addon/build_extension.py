"""Build the Blender extension: one zip with the add-on and wheels of Edgegrad and of what it needs.

    python addon/build_extension.py --interpreter python3.11 --interpreter python3.13

Each interpreter contributes wheels for its own Python version: Edgegrad built from this source tree, its dependencies
from the package index. 3.11 serves Blender 4.2 to 5.0; 3.12 or newer gives the stable-ABI wheel for Blender 5.1 on.
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


def collect_wheels(interpreter: str, folder: Path) -> None:
    """Put Edgegrad's wheel and its dependencies' wheels for one interpreter into the folder.

    Raises
    ------
    RuntimeError
        If a wheel cannot be built or does not exist for this Python version.
    """
    pip = [interpreter, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    commands = {
        "build Edgegrad's wheel": [*pip, "wheel", "--no-deps", "--wheel-dir", str(folder), str(PROJECT)],
        # --no-deps: all that these need is numpy, or named in the project itself.
        "get the dependencies' wheels": [*pip, "download", "--no-deps", "--only-binary=:all:",
                                         "--dest", str(folder), *requirements()],
    }
    for task, command in commands.items():
        if subprocess.run(command, check=False).returncode:
            raise RuntimeError(f"could not {task} with {interpreter}")


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


def build(interpreters: list[str], output: Path, blender: str | None = None) -> None:
    """Write the extension's zip into the folder `output`."""
    command = packager(blender)
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        stage = Path(temporary) / "edgegrad"
        shutil.copytree(ADDON, stage, ignore=NOT_PACKAGED)
        wheels = stage / "wheels"
        wheels.mkdir()
        for interpreter in interpreters:
            collect_wheels(interpreter, wheels)
        manifest = stage / MANIFEST
        listed = [f"./wheels/{path.name}" for path in sorted(wheels.glob("*.whl"))]
        manifest.write_text(with_wheels(manifest.read_text(), listed))
        subprocess.run([*command, "build", "--source-dir", str(stage), "--output-dir", str(output.resolve())],
                       check=True)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interpreter", action="append", help="Python to make wheels for (default: this one)")
    parser.add_argument("--blender", help="Blender executable whose packager is used")
    parser.add_argument("--output", type=Path, default=PROJECT / "dist", help="folder of the zip")
    arguments = parser.parse_args()
    try:
        build(arguments.interpreter or [sys.executable], arguments.output, arguments.blender)
    except (RuntimeError, ValueError, subprocess.CalledProcessError) as error:
        sys.exit(f"build_extension: {error}")


if __name__ == "__main__":
    main()
