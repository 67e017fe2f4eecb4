"""The command line: ``python -m edgegrad COMMAND …``.

``render``, ``gradient`` and ``fit`` work on .blend files and need the bpy module. They run the same code as
``blender --command edgegrad …``. ``info`` needs neither Blender nor bpy.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import platform
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

BLENDER_COMMANDS = ("render", "gradient", "fit")
ADDON = "edgegrad_addon.command_line"

USAGE = """\
usage: python -m edgegrad COMMAND [options]

  render FILE.blend ...    render a picture
  gradient FILE.blend ...  render the derivative of a picture
  fit FILE.blend ...       fit the scene to its target pictures
  info                     show the engine, its instruction set, the Embree library and the number of threads

python -m edgegrad COMMAND --help lists the options of a command."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return the exit code of the process; 2 means wrong usage."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    command = arguments[0] if arguments else ""
    if command in ("-h", "--help", "help"):
        print(USAGE)
        return 0
    if command == "info":
        return _info(arguments[1:])
    if command in BLENDER_COMMANDS:
        return _blender(arguments)
    if command:
        print(f"edgegrad: there is no command '{command}'", file=sys.stderr)
    print(USAGE, file=sys.stderr)
    return 2


def _info(options: list[str]) -> int:
    if options:
        print(f"edgegrad info: takes no options, but was given {' '.join(options)}", file=sys.stderr)
        return 2
    for name, value in information().items():
        print(f"{name:<17} {value}")
    return 0


def information() -> dict[str, str]:
    """Engine, instruction sets, threads and versions of this installation, by name."""
    out = {"edgegrad": _version("edgegrad"), "Python": f"{platform.python_version()}, {platform.machine()}"}
    try:
        from .rendering import native_engine

        out["engine"] = "native"
        out["instruction set"] = ", ".join(native_engine.instruction_sets()) + " (the first is used)"
        out["Embree"] = f"{native_engine.embree_version()} ({native_engine.embree_library()})"
    except (ImportError, RuntimeError) as error:
        out["engine"] = f"reference (the native engine cannot be loaded: {error})"
    out["threads"] = str(os.cpu_count() or 1)
    out |= {name: _version(name) for name in ("embreex", "numpy", "OpenEXR", "cholespy", "pillow", "bpy")}
    return out


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def _blender(arguments: list[str]) -> int:
    """Run a command of the add-on, which reads .blend files."""
    command = arguments[0]
    if importlib.util.find_spec("bpy") is None:
        print(
            f"edgegrad {command}: needs Blender's Python module; install it with  pip install edgegrad[blender]  "
            f"or run  blender --background FILE.blend --command edgegrad {command}",
            file=sys.stderr,
        )
        return 1
    try:
        addon = importlib.import_module(ADDON)
    except ModuleNotFoundError as error:
        if error.name is None or not ADDON.startswith(error.name):
            raise
        print(f"edgegrad {command}: the add-on's module '{ADDON}' is not installed", file=sys.stderr)
        return 1
    return int(addon.main(arguments))


if __name__ == "__main__":
    sys.exit(main())
