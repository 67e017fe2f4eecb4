"""Build the Blender extension: a zip for a platform, with the add-on and wheels of Edgegrad and its dependencies.

    python -m extension.build                                        # for the platform that runs it
    python -m extension.build --platform windows-x64 --wheel A.whl --wheel B.whl

Edgegrad is built from this source tree by two interpreters: Python 3.11, and Python 3.12 or newer for the stable ABI,
which all later Pythons load. Wheels for another platform are built there, and given by --wheel. The dependencies are
downloaded from the package index for each Python of a supported Blender.
Blender's packager builds the zip: that of the Blender executable, or of the bpy module in this Python installation.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path

from extension.platforms import PLATFORMS, this_platform
from extension.wheels import PROJECT, collect

ADDON = PROJECT / "addon"
MANIFEST = "blender_manifest.toml"
NOT_PACKAGED = shutil.ignore_patterns("__pycache__", "*.pyc", ".*")


def with_wheels(manifest: str, platform: str, wheels: Sequence[str]) -> str:
    """Add the platform and the list of wheels to the text of the manifest.

    Raises
    ------
    ValueError
        If the manifest already has one of them.
    """
    entries = {"platforms": [platform], "wheels": list(wheels)}
    for key in entries:
        if key in tomllib.loads(manifest):
            raise ValueError(f"{MANIFEST}: must not list {key}; they are added when the extension is built")
    added = "".join(f"{key} = {json.dumps(value, indent=2)}\n" for key, value in entries.items())
    # A key after the first table header would belong to that table.
    first_table = re.search(r"^\[", manifest, flags=re.MULTILINE)
    split = first_table.start() if first_table else len(manifest)
    return f"{manifest[:split].rstrip()}\n{added}\n{manifest[split:]}"


def packager(blender: str | None) -> list[str]:
    """Return the command of Blender's extension packager, without its sub-command.

    Raises
    ------
    RuntimeError
        If there is neither a Blender executable nor a bpy module.
    """
    executable = blender or shutil.which("blender")
    if executable:
        return [executable, "--background", "--factory-startup", "--command", "extension"]
    bpy = importlib.util.find_spec("bpy")  # searched, not imported: only its files are needed
    if bpy is not None and bpy.origin:
        scripts = sorted(Path(bpy.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
        if scripts:
            return [sys.executable, str(scripts[-1])]
    raise RuntimeError("found neither a Blender executable (--blender PATH) nor the bpy module, whose packager is used")


def interpreters() -> list[str]:
    """Return Python 3.11 and a Python of the stable ABI of this machine.

    Raises
    ------
    RuntimeError
        If there is none of them.
    """
    return [_find("3.11"), _find("3.13", "3.12", "3.14")]


def _find(*versions: str) -> str:
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    for version in versions:
        # A shim of pyenv is there for Pythons that are not active, too, and fails.
        for path in (shutil.which(f"python{version}"), *sorted(root.glob(f"versions/{version}.*/bin/python{version}"))):
            if path and not subprocess.run([path, "-c", ""], capture_output=True, check=False).returncode:
                return str(path)
    raise RuntimeError(f"found no Python {' or '.join(versions)}, which builds a wheel of Edgegrad: install it, or "
                       "name one by --interpreter")  # fmt: skip


def build(platform: str, pythons: list[str], built: list[Path], output: Path, blender: str | None = None) -> None:
    """Write the zip of the extension for the platform into the folder `output`.

    Parameters
    ----------
    platform
        Blender's name of the platform, a key of `PLATFORMS`.
    pythons
        Interpreters to build Edgegrad's wheels with.
    built
        Edgegrad's wheels, if they were built before; else empty.
    output
        Folder for the zip.
    blender
        Blender executable whose packager is used; None: see `packager`.

    Raises
    ------
    RuntimeError
        If a wheel or the packager is missing.
    """
    if platform not in PLATFORMS:
        raise RuntimeError(f"no extension for {platform}: Embree's wheels exist for {', '.join(PLATFORMS)}")
    command = packager(blender)
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        stage = Path(temporary) / "edgegrad"
        shutil.copytree(ADDON, stage, ignore=NOT_PACKAGED)
        folder = stage / "wheels"
        folder.mkdir()
        wheels = collect(PLATFORMS[platform], pythons, built, folder)
        manifest = stage / MANIFEST
        listed = sorted(f"./wheels/{path.name}" for path in wheels)
        manifest.write_text(with_wheels(manifest.read_text(), platform, listed))
        subprocess.run([*command, "build", "--split-platforms", "--source-dir", str(stage), "--output-dir",
                        str(output.resolve())], check=True)  # fmt: skip


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m extension.build", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--platform", default=this_platform(), help=f"{', '.join(PLATFORMS)} (default: this one)")
    parser.add_argument("--interpreter", action="append", help="Python that builds a wheel of Edgegrad (default: "
                        "python3.11, and the first of python3.13, python3.12, python3.14 that is there)")
    parser.add_argument("--wheel", action="append", default=[], type=Path, help="a wheel of Edgegrad, built before")
    parser.add_argument("--blender", help="Blender executable whose packager is used")
    parser.add_argument("--output", type=Path, default=PROJECT / "dist", help="folder for the zip")
    arguments = parser.parse_args()
    try:
        pythons = arguments.interpreter or ([] if arguments.wheel else interpreters())
        build(arguments.platform, pythons, arguments.wheel, arguments.output, arguments.blender)
    except (RuntimeError, ValueError, subprocess.CalledProcessError) as error:
        sys.exit(f"extension.build: {error}")


if __name__ == "__main__":
    main()
