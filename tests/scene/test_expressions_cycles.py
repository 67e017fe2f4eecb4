"""Expressions against the shader nodes that they stand for, evaluated by Cycles at the same operands."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
if bpy.app.version < (5, 0, 0):
    pytest.skip("the nodes' sockets are named as in Blender 5.0", allow_module_level=True)

from edgegrad import Image
from tests.support import node_cases
from tests.support.node_cases.blender_nodes import render_nodes
from tests.support.node_cases.texture_points import at_values
from tests.support.scenes import blender_scenes as bs

# Sums of rounded steps; noise is looked up some hundreds away from the origin for its further colours, where the
# coordinates themselves are rounded to 1.5e-5, and grows steep over its octaves.
TOLERANCE = {"textures": 2e-4}


def operands() -> tuple[Any, Any]:
    """Random vectors, a few of them at places where something happens."""
    rng = np.random.default_rng(0)
    p, q = rng.uniform(-1.5, 1.5, (96, 3)), rng.uniform(-0.5, 1.5, (96, 3))
    p[:16] = np.abs(p[:16]) / 1.5
    p[16], p[17], p[18], q[19] = 0.0, 0.5, 1.0, 0.0
    p[20] = q[20]
    return p, q


@pytest.mark.parametrize(
    "group", ["inputs", "shading", "math", "vector_math", "mapping", "mix", "colors", "ranges", "tables", "textures",
              "images"]
)
def test_nodes(group: str, tmp_path: Path) -> None:
    bs.empty()
    cases = getattr(node_cases, group)()
    p, q = operands()
    theirs = render_nodes([node for node, _ in cases.values()], p, q, tmp_path)
    pictures = {name: Image(pixels) for name, pixels in node_cases.image_pixels().items()}
    ours = at_values([expression for _, expression in cases.values()], p, q, pictures)
    wrong = {}
    for name, a, b in zip(cases, ours, theirs, strict=True):
        # For nodes without alpha, Cycles' column is 1.
        count = 4 if np.any(b[:, 3] != 1.0) else 3
        error = np.abs(a - b)[:, :count] / np.maximum(1.0, np.abs(b[:, :count]))
        if not error.max() < TOLERANCE.get(group, 5e-6):
            at = int(error.max(axis=1).argmax())
            wrong[name] = (p[at], q[at], a[at], b[at])
    assert not wrong
    # The comparison sees something: results differ from case to case.
    assert np.ptp(theirs[..., 0]) > 0.1
