"""Say in one sentence what this machine lacks for `make demo` and `make test`; exit with 1 then.

Runs on the machine's own Python, before anything is installed. ``--packages`` only prints the missing Debian packages.
"""

import ctypes
import importlib.util
import os
import shutil
import sys
import sysconfig
from pathlib import Path

# System libraries that Blender's Python module links to and its wheel does not bring: file name, Debian package.
BLENDER_LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libGL.so.1": "libgl1",
}
# Blender's Python module exists for these only.
PYTHONS = ((3, 11), (3, 13))


def missing_libraries():
    """Debian packages of the libraries that the loader does not find."""
    packages = []
    for library, package in BLENDER_LIBRARIES.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            packages.append(package)
    return packages


def missing_packages():
    """Every Debian package that has to be installed, Python itself excepted."""
    version = "python{}.{}".format(*sys.version_info)
    packages = []
    if not any(shutil.which(name) for name in (os.environ.get("CXX", "c++"), "g++", "clang++")):
        packages.append("g++")
    if not (Path(sysconfig.get_paths()["include"]) / "Python.h").exists():
        packages.append(version + "-dev")
    if importlib.util.find_spec("ensurepip") is None:
        packages.append(version + "-venv")
    if sys.platform.startswith("linux"):
        packages += missing_libraries()
    return packages


def main():
    packages = missing_packages()
    if "--packages" in sys.argv:
        print(" ".join(packages))
        return 0
    if sys.version_info[:2] not in PYTHONS:
        print("Edgegrad needs Python 3.11 (or 3.13) for Blender's Python module, and this is {}.{}; "
              "set it with: make PYTHON=/path/to/python3.11 ...".format(*sys.version_info), file=sys.stderr)
        return 1
    if packages:
        print("This machine lacks what Edgegrad's build or Blender's Python module needs; "
              "on Debian and Ubuntu: sudo apt-get install " + " ".join(packages), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
