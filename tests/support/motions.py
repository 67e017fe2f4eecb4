"""Scenes of tests that move: their cameras and lights, by rates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import edgegrad
from tests.support.rich_scene import turn
from tests.support.small_scenes import Make


def camera_moves(make_scene: Callable[[], edgegrad.Scene], turns: ArrayLike = (0.0, 0.0, 0.0)) -> Make:
    """The camera moves, and turns by this rotation vector."""

    def make(theta: float) -> edgegrad.Scene:
        scene = make_scene()
        to_world = np.array(scene.camera.to_world)
        to_world[:3, :3] = turn(*(theta * np.asarray(turns))) @ to_world[:3, :3]
        to_world[:3, 3] += theta * np.array([0.5, -0.3, 0.4])
        scene.camera = replace(scene.camera, to_world=to_world)
        return scene

    return make


def lamp_changes(make_scene: Callable[[], edgegrad.Scene], field: str, rate: ArrayLike) -> tuple[Make, list[str]]:
    """A number of the light "lamp" grows; of its pose the rotation vector, and it moves besides."""

    def make(theta: float) -> edgegrad.Scene:
        scene = make_scene()
        lamp = scene.lights["lamp"]
        if field == "to_world":
            value = np.array(getattr(lamp, field))
            value[:3, :3] = turn(*(theta * np.asarray(rate))) @ value[:3, :3]
            value[:3, 3] += theta * np.array([0.6, -0.4, 0.3])
        else:
            value = getattr(lamp, field) + theta * np.asarray(rate)
        change: dict[str, Any] = {field: float(value) if np.ndim(value) == 0 else value}
        scene.lights = {**scene.lights, "lamp": replace(lamp, **change)}
        return scene

    return make, [f"lights.lamp.{field}"]
