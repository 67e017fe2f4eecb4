"""Numbered files of a film: 'film.%04d.png' and 'film.####.png' stand for one file a frame."""

from __future__ import annotations

import glob
import re
from pathlib import Path

_NUMBER = re.compile(r"%0?(\d*)d|(#+)")


def is_numbered(path: str) -> bool:
    """Whether a path stands for one file a frame."""
    return bool(_NUMBER.search(path))


def file_at(path: str, frame: int) -> str:
    """Return the path of a frame."""
    return _NUMBER.sub(lambda match: f"{frame:0{match[1] or len(match[2] or '')}d}", path)


def first_file(path: Path) -> Path:
    """Return the first file of a film that is there, or the path itself."""
    if path.is_file() or not is_numbered(path.name):
        return path
    between = _NUMBER.split(path.name)[:: _NUMBER.groups + 1]
    return min(path.parent.glob("*".join(glob.escape(one) for one in between)), default=path)
