"""Merges the wheels of one package for several Pythons into one wheel.

Blender 4.2 chooses an extension's wheels by platform, but not by Python version: of two wheels of a package it
installs the one whose file name is the greater. A merged wheel serves each Python. It is smaller, too, because the
shared libraries of the wheels, such as Embree, are the same file. The names of Python's extension modules don't
collide, since they have the Python version in them.
"""

from __future__ import annotations

import base64
import hashlib
import zipfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

# Folders of a wheel with programs and headers, which cholespy has of METIS. They are no part of the package.
NOT_PYTHON = ("bin", "include", "lib")


class WheelName(NamedTuple):
    """Parts of a wheel's file name. Each tag can be several, joined by dots."""

    package: str
    version: str
    pythons: str
    abis: str
    platforms: str

    @classmethod
    def of(cls, path: Path) -> WheelName:
        """Split the file name of a wheel.

        Raises
        ------
        ValueError
            If it is not that of a wheel without a build number.
        """
        parts = path.name.removesuffix(".whl").split("-")
        if path.suffix != ".whl" or len(parts) != 5:
            raise ValueError(f"{path.name}: not the name of a wheel (package-version-python-abi-platform.whl)")
        return cls(*parts)

    @property
    def metadata(self) -> str:
        """Folder of the wheel's metadata."""
        return f"{self.package}-{self.version}.dist-info"


def merged_name(wheels: Sequence[Path]) -> WheelName:
    """Return the name of the wheel that serves what any of the wheels serves, on the platforms that all have.

    Raises
    ------
    ValueError
        If the wheels are of several packages or versions, or have no platform in common.
    """
    names = [WheelName.of(path) for path in wheels]
    if len({(name.package, name.version) for name in names}) != 1:
        raise ValueError(f"wheels of several packages or versions: {', '.join(path.name for path in wheels)}")
    platforms = set.intersection(*(set(name.platforms.split(".")) for name in names))
    if not platforms:
        raise ValueError(f"wheels without a common platform: {', '.join(path.name for path in wheels)}")
    pythons, abis = ({tag for name in names for tag in name[field].split(".")} for field in (2, 3))
    return names[0]._replace(pythons=_joined(pythons), abis=_joined(abis), platforms=_joined(platforms))


def merge(wheels: Sequence[Path], folder: Path) -> Path:
    """Write one wheel with the files of all the wheels into the folder, and return its path.

    Raises
    ------
    ValueError
        If the wheels don't belong together, or have different files of the same name.
    """
    name = merged_name(wheels)
    files: dict[str, tuple[zipfile.ZipInfo, bytes]] = {}
    for path in wheels:
        with zipfile.ZipFile(path) as wheel:
            for info in wheel.infolist():
                if info.is_dir() or info.filename.split("/")[0] in NOT_PYTHON:
                    continue
                content = wheel.read(info)
                _, present = files.setdefault(info.filename, (info, content))
                # Metadata of the wheels may differ in what made them.
                if present != content and not info.filename.startswith(f"{name.metadata}/"):
                    raise ValueError(f"{path.name}: its {info.filename} is not that of {wheels[0].name}")
    for generated in ("WHEEL", "RECORD"):
        files.pop(f"{name.metadata}/{generated}", None)
    merged = folder / f"{'-'.join(name)}.whl"
    record = []
    with zipfile.ZipFile(merged, "w", zipfile.ZIP_DEFLATED) as out:
        def add(info: zipfile.ZipInfo, content: bytes) -> None:
            out.writestr(info, content, zipfile.ZIP_DEFLATED)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record.append(f"{_quoted(info.filename)},sha256={digest},{len(content)}")

        for info, content in sorted(files.values(), key=lambda file: file[0].filename):
            add(info, content)
        add(zipfile.ZipInfo(f"{name.metadata}/WHEEL"), _wheel_file(name).encode())
        record.append(f"{name.metadata}/RECORD,,")
        out.writestr(zipfile.ZipInfo(f"{name.metadata}/RECORD"), "\n".join(record) + "\n", zipfile.ZIP_DEFLATED)
    return merged


def _wheel_file(name: WheelName) -> str:
    tags = product(*(part.split(".") for part in (name.pythons, name.abis, name.platforms)))
    lines = ["Wheel-Version: 1.0", "Generator: edgegrad extension.merge", "Root-Is-Purelib: false"]
    return "\n".join([*lines, *(f"Tag: {'-'.join(tag)}" for tag in tags)]) + "\n"


def _joined(tags: set[str]) -> str:
    return ".".join(sorted(tags))


def _quoted(name: str) -> str:
    return f'"{name}"' if "," in name else name
