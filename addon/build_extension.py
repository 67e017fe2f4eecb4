"""Build the Blender extension: one zip with the add-on, and wheels of Edgegrad and its dependencies.

    python addon/build_extension.py --interpreter python3.11 --interpreter python3.13 --python-version 3.14

Each interpreter provides wheels for its own Python version: Edgegrad is built from this source tree, and its
dependencies are downloaded from the package index. Blender 4.2 to 5.0 use Python 3.11. Python 3.12 or newer builds the
stable-ABI wheel, which Blender 5.1 and later use. Linux distributions build Blender with other Python versions. For
these, --python-version adds the dependencies only, and the stable-ABI wheel serves them.
Blender's packager builds the zip: that of the Blender executable, or of the bpy module in this Python installation.
This file is not part of the installed add-on.
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
# Blender includes numpy. A second numpy in the same process would break it.
INCLUDED_IN_BLENDER = ("numpy",)
NOT_PACKAGED = shutil.ignore_patterns(Path(__file__).name, "__pycache__", "*.pyc", ".*")


def requirements() -> list[str]:
    """List the run-time dependencies of the project that Blender does not include."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]
    names = {text: re.split(r"[^A-Za-z0-9_.-]", text, maxsplit=1)[0].lower() for text in project["dependencies"]}
    return [text for text, name in names.items() if name not in INCLUDED_IN_BLENDER]


def build_wheel(interpreter: str, folder: Path) -> None:
    """Build Edgegrad's wheel with the interpreter, and put it into the folder.

    Raises
    ------
    RuntimeError
        If the wheel cannot be built.
    """
    if subprocess.run([*_pip(interpreter), "wheel", "--no-deps", "--wheel-dir", str(folder), str(PROJECT)],
                      check=False).returncode:
        raise RuntimeError(f"could not build Edgegrad's wheel with {interpreter}")


def collect_dependencies(interpreter: str, folder: Path, version: str | None = None) -> None:
    """Put the wheels of Edgegrad's dependencies into the folder.

    Parameters
    ----------
    interpreter
        The Python interpreter whose pip downloads them.
    folder
        Folder for the wheels.
    version
        Python version of the wheels, such as "3.14"; None: that of the interpreter.

    Raises
    ------
    RuntimeError
        If a dependency has no wheel for this Python version.
    """
    # --no-deps: the dependencies need only numpy and other dependencies of this project.
    command = [*_pip(interpreter), "download", "--no-deps", "--only-binary=:all:", "--dest", str(folder)]
    command += ["--implementation", "cp", "--python-version", version] if version else []
    if subprocess.run([*command, *requirements()], check=False).returncode:
        served = f"Python {version}" if version else interpreter
        raise RuntimeError(f"could not get the dependencies' wheels for {served}")


def _pip(interpreter: str) -> list[str]:
    return [interpreter, "-m", "pip", "--quiet", "--disable-pip-version-check"]


def with_wheels(manifest: str, wheels: list[str]) -> str:
    """Add the list of wheels to the text of the manifest.

    Raises
    ------
    ValueError
        If the manifest already has a list of wheels.
    """
    if "wheels" in tomllib.loads(manifest):
        raise ValueError(f"{MANIFEST}: must not list wheels; they are added when the extension is built")
    entry = f"wheels = {json.dumps(wheels, indent=2)}\n\n"
    # A key after the first table header would belong to that table.
    first_table = re.search(r"^\[", manifest, flags=re.MULTILINE)
    split = first_table.start() if first_table else len(manifest)
    return f"{manifest[:split].rstrip()}\n{entry}{manifest[split:]}"


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


def build(interpreters: list[str], versions: list[str], output: Path, blender: str | None = None) -> None:
    """Write the zip of the extension into the folder `output`.

    Raises
    ------
    RuntimeError
        If a wheel or the packager is missing, or if no wheel of Edgegrad supports a version.
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
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interpreter", action="append",
                        help="Python interpreter to make wheels for (default: this one)")
    parser.add_argument("--python-version", action="append", default=[],
                        help="Python version of some Blender, such as 3.14, for which no interpreter is given")
    parser.add_argument("--blender", help="Blender executable whose packager is used")
    parser.add_argument("--output", type=Path, default=PROJECT / "dist", help="folder for the zip")
    arguments = parser.parse_args()
    try:
        build(arguments.interpreter or [sys.executable], arguments.python_version, arguments.output, arguments.blender)
    except (RuntimeError, ValueError, subprocess.CalledProcessError) as error:
        sys.exit(f"build_extension: {error}")


if __name__ == "__main__":
    main()
