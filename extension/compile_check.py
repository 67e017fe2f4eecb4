"""Compile the native sources for the platforms of the extension, to see that they are portable.

    python -m extension.compile_check                          # all targets, some minutes of two cores
    python -m extension.compile_check x86_64-windows-gnu

Zig's C++ compiler makes object files, without optimisation, of all sources that do not include Python's headers, with
one set of kernels. Nothing is linked or run. CMake, Ninja and nanobind (pip install --group build) and ziglang
(pip install --group extension) must be installed.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from extension.wheels import PROJECT, portable_compiler

# Set of kernels by processor: the narrowest vectors.
KERNELS = {"x86_64": "sse42", "aarch64": "simd4"}
TARGETS = ("x86_64-linux-gnu.2.28", "aarch64-linux-gnu.2.28", "x86_64-windows-gnu", "aarch64-macos.13.0")
# What CMake writes for Linux that other compilers refuse, and optimisation, which would take most of the time.
LEFT_OUT = {"windows": ("-fPIC",)}
# Folders of the objects of targets that include Python's headers.
WITH_PYTHON = ("CMakeFiles/_native.dir/", "CMakeFiles/nanobind")
OPTIMISED = ("-O1", "-O2", "-O3")


@dataclass(frozen=True)
class Compilation:
    """One call of the compiler.

    Attributes
    ----------
    source
        File that is compiled.
    folder
        Folder that it is called in.
    options
        Words behind the name of the compiler, without those on its output.
    """

    source: str
    folder: str
    options: tuple[str, ...]


def of_database(entries: list[dict[str, str]], target: str) -> list[Compilation]:
    """Return the calls for a target from those for Linux, but for sources with Python's headers."""
    left_out = OPTIMISED + tuple(word for name, words in LEFT_OUT.items() if name in target for word in words)
    found = []
    for entry in entries:
        words = shlex.split(entry["command"])
        if Path(words[0]).name == "ccache":
            del words[0]
        at = words.index("-o")
        if words[at + 1].startswith(WITH_PYTHON):
            continue
        options = words[1:at] + words[at + 2 :]
        kept = tuple(word for word in options if word not in left_out)
        found.append(Compilation(entry["file"], entry["directory"], kept))
    return found


def check(target: str) -> list[str]:
    """Compile everything for a target; return what the compiler says of each file that it refuses.

    Raises
    ------
    RuntimeError
        If CMake fails, or if the compiler is not installed.
    """
    processor = target.partition("-")[0]
    with tempfile.TemporaryDirectory() as temporary:
        build = Path(temporary)
        for_linux = portable_compiler(f"{processor}-linux-gnu.2.28", build / "linux")
        configure = ["cmake", "-S", str(PROJECT), "-B", str(build), "-G", "Ninja", "-DCMAKE_SYSTEM_NAME=Linux",
                     f"-DCMAKE_SYSTEM_PROCESSOR={processor}", f"-DEDGEGRAD_KERNELS={KERNELS[processor]}",
                     "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON",
                     f"-DPython_EXECUTABLE={sys.executable}", f"-DPython_INCLUDE_DIR={sysconfig.get_path('include')}",
                     f"-DCMAKE_CXX_COMPILER={for_linux['CXX']}"]  # fmt: skip
        done = subprocess.run(configure, env=os.environ | for_linux, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"CMake failed for {processor}:\n{done.stderr}")
        calls = of_database(json.loads((build / "compile_commands.json").read_text()), target)
        environment = os.environ | portable_compiler(target, build / "target")

        def compile_one(number: int) -> str:
            call = calls[number]
            command = [environment["CXX"], *call.options, "-O0", "-o", str(build / f"{number}.o")]
            done = subprocess.run(command, cwd=call.folder, env=environment, capture_output=True, text=True,
                                  check=False)  # fmt: skip
            return f"{call.source}:\n{done.stderr}" if done.returncode else ""

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            return [said for said in pool.map(compile_one, range(len(calls))) if said]


def main() -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m extension.compile_check", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", nargs="*", default=list(TARGETS), help=", ".join(TARGETS))
    failed = 0
    for target in parser.parse_args().target:
        said = check(target)
        failed += len(said)
        print(target, f"{len(said)} files do not compile" if said else "compiles", *said, sep="\n", flush=True)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
