"""Numbered files of a film: 'film.%04d.png' and 'film.####.png' stand for one file a frame."""

from __future__ import annotations

import glob
import re
from collections.abc import Callable
from pathlib import Path

_NUMBER = re.compile(r"%0?(\d*)d|(#+)")


def is_numbered(path: str) -> bool:
    """Whether the name in a path stands for one file a frame; its folders have no numbers of frames."""
    return bool(_NUMBER.search(path, _name_from(path)))


def file_at(path: str, frame: int) -> str:
    """Return the path of a frame."""
    start = _name_from(path)
    name = _NUMBER.sub(lambda match: f"{frame:0{match[1] or len(match[2] or '')}d}", path[start:])
    return path[:start] + name


def _name_from(path: str) -> int:
    """Where the name begins, in a path as Blender has it on any system."""
    return max(path.rfind("/"), path.rfind("\\")) + 1


def frame_of_sequence(path: Path, number: Callable[[int], int]) -> Path | None:
    """Return the file of a sequence with another number, which is a function of that of `path`; None: it has none."""
    parts = re.fullmatch(r"(.*?)(\d+)(\D*)", path.name)
    if parts is None:
        return None
    before, digits, after = parts.groups()
    return path.with_name(f"{before}{number(int(digits)):0{len(digits)}d}{after}")


def first_file(path: Path) -> Path:
    """Return the first file of a film that is there, or the path itself."""
    if path.is_file() or not is_numbered(path.name):
        return path
    between = _NUMBER.split(path.name)[:: _NUMBER.groups + 1]
    return min(path.parent.glob("*".join(glob.escape(one) for one in between)), default=path)
