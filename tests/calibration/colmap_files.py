"""Text models of COLMAP."""

from __future__ import annotations

from pathlib import Path


def colmap(folder: Path, cameras: str, pictures: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cameras.txt").write_text("# Camera list\n" + cameras)
    (folder / "images.txt").write_text("# Image list with two lines of data per image:\n" + pictures)
    return folder
