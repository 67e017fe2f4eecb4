"""Paths of the files of the reference cases."""

from __future__ import annotations

import os
import pathlib

import pytest

HERE = pathlib.Path(__file__).parents[1]
FOLDERS = [HERE / "references", pathlib.Path(os.environ.get("EDGEGRAD_REFS", HERE.parents[1] / "shared" / "refs"))]


def find(case: str) -> pathlib.Path:
    """Path of a case's file; skips the test where there is none."""
    for folder in FOLDERS:
        if (folder / f"{case}.npz").exists():
            return folder / f"{case}.npz"
    pytest.skip(f"no reference data for {case} (set EDGEGRAD_REFS)")
