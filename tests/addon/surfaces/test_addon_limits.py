"""Limits of bounces, beside Cycles: what the export names where both renderers stop paths in different places."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(name="scene", autouse=True)
def _scene() -> Any:
    scene = bs.empty(32)
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 4
    scene.cycles.samples = 128
    bs.camera()
    return scene


def ground(color: Any = (0.5, 0.5, 0.5)) -> Any:
    return bs.add("Ground", bs.plane("Ground", 20.0, bs.material("Ground", color)))


def mean(made: Any) -> Any:
    limits = made.settings
    picture = edgegrad.Renderer(made.scene).render(spp=64, max_depth=limits.max_depth, bounces=limits.bounces)
    return picture.mean(axis=(0, 1))


def test_paths_that_end_at_the_limit_of_transparent_surfaces_are_named(scene: Any, tmp_path: Path) -> None:
    """In Cycles, the ground behind as many panes as the limit allows is black, although no pane hides its lamp."""
    bs.camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    bs.light("POINT", "Lamp", (0.0, 0.0, 0.8), energy=100.0)
    ground()
    pane = bs.material("Pane", node="ShaderNodeBsdfTransparent")
    for z in (1.0, 2.0):
        bs.add(f"Pane {z:g}", bs.plane("Pane", 9.0, pane), (0.0, 0.0, z))
    for limit in range(4):
        scene.cycles.transparent_max_bounces = limit
        made = bs.export()
        named = [line for line in made.report.lines if "transparent surfaces see the next" in line]
        differs = not np.allclose(mean(made), bs.cycles(tmp_path)[..., :3].mean(axis=(0, 1)), rtol=0.01, atol=0.001)
        assert bool(named) == differs == (limit == 2)
        assert all("only the emission (100 % of the picture's light)" in line for line in named)


def test_emissive_meshes_that_shadow_rays_do_not_meet_are_named() -> None:
    ball = bs.add("Ball", bs.cube("Ball", bs.material("Glow", node="ShaderNodeEmission")))
    assert not bs.export().report.lines
    ball.visible_shadow = False
    assert any("hidden from shadow rays" in line for line in bs.export().report.lines)


def test_limits_of_the_bounces_that_the_world_lights_are_named_with_their_effect(scene: Any, tmp_path: Path) -> None:
    """Cycles does not sample the world's light beyond the limit, but rays that leave the scene bring some of it."""
    bs.camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    bs.world((1.0, 1.0, 1.0))
    ground((0.8, 0.8, 0.8))
    for x in (-2.0, 2.0):
        bs.add(f"Wall {x:g}", bs.cube("Wall", bs.material("Wall", (0.8, 0.8, 0.8))), (x, 0.0, 0.0))
    settings = scene.world.cycles
    lines = {}
    for limit in (0, 1, 1024):
        settings.max_bounces = limit
        made = bs.export()
        (lines[limit],) = [[line for line in made.report.lines if "world lights paths" in line]]
        lost = 1.0 - bs.cycles(tmp_path)[..., :3].mean() / mean(made).mean()
        if lines[limit]:
            share = float(lines[limit][0].rpartition("at most ")[2].partition(" %")[0]) / 100.0
            short = replace(made.settings, max_depth=limit + 2)
            assert share == pytest.approx(1.0 - mean(replace(made, settings=short))[0] / mean(made)[0], abs=0.015)
            assert -0.005 < lost < share + 0.01
        else:
            assert abs(lost) < 0.005
    assert lines[0] and lines[1] and not lines[1024]


def test_lights_with_a_limit_that_rays_may_meet_are_named(scene: Any) -> None:
    ground()
    lamp = bs.light("POINT", "Lamp", (0.0, 0.0, 3.0), energy=100.0, shadow_soft_size=0.2)
    lamp.data.cycles.max_bounces = 1
    assert any("paths of at most 1 bounces" in line for line in bs.export().report.lines)
    lamp.data.shadow_soft_size = 0.0
    assert not bs.export().report.lines
