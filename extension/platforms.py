"""Platforms and Python versions of the Blenders that the extension supports."""

from __future__ import annotations

import platform
import sys
from dataclasses import dataclass

# Blender 4.2 to 5.0 have Python 3.11, later ones 3.13. Linux distributions build Blender with their own: 3.14.
PYTHONS = ("3.11", "3.13", "3.14")


@dataclass(frozen=True)
class Platform:
    """A platform of Blender.

    Attributes
    ----------
    name
        Blender's name of it, as in the manifest.
    tags
        Platform tags of wheels that run on it, the newest first.
    target
        Target of the portable compiler, without which Edgegrad is built for this machine alone; None: the platform's
        own compiler builds wheels for every supported machine.
    """

    name: str
    tags: tuple[str, ...]
    target: str | None = None


# Embree's wheels exist for these only.
PLATFORMS = {
    known.name: known for known in (
        # manylinux_2_28: Blender itself needs glibc 2.28.
        Platform("linux-x64", (*(f"manylinux_2_{minor}_x86_64" for minor in range(28, 16, -1)), "manylinux2014_x86_64"),
                 target="x86_64-linux-gnu.2.28"),
        Platform("windows-x64", ("win_amd64",)),
        Platform("macos-arm64", tuple(f"macosx_{major}_0_{machine}" for major in range(13, 10, -1)
                                      for machine in ("arm64", "universal2"))),
    )
}  # fmt: skip


def this_platform() -> str:
    """Return Blender's name of the platform that this Python runs on."""
    system = {"linux": "linux", "darwin": "macos", "win32": "windows"}.get(sys.platform, sys.platform)
    machine = platform.machine().lower()
    return f"{system}-{ {'x86_64': 'x64', 'amd64': 'x64', 'aarch64': 'arm64'}.get(machine, machine)}"
