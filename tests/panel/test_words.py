"""Sentences of the panel."""

from __future__ import annotations

import pytest

pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.panel.words import lines


def test_lines_end_neither_within_a_size_nor_before_a_unit() -> None:
    said = "Colours of 1920 × 1080 pixels, in 12 s or 3 min, as in 'colour 1'"
    for width in range(12, len(said)):
        found = lines(said, width)
        assert " ".join(found) == said.replace("Colours", "Colors")
        assert all(len(line) <= width for line in found)
        for whole in ("1920 × 1080", "12 s", "3 min"):
            assert any(whole in line for line in found), (width, found)
