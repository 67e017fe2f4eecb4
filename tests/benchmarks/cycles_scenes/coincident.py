"""Faces and lamps that lie exactly on each other: rounding decides, so that they can only be reported."""

from __future__ import annotations

from typing import Any

import bpy

from . import stage
from .case import case

FACES = "faces of two materials lie exactly on each other: rounding decides which is seen; the export names them"
LAMP = "an area light lies exactly on a face: in Cycles rounding decides how much of its light passes; it is named"
DOUBLED = "faces lie twice at the same place: in Cycles they shadow each other by rounding; the export names them"


def _set() -> Any:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96
    stage.lamp("AREA", "Key", 200.0, (-2.0, -2.0, 4.0), (0, 0, 0.5), size=2.0)
    stage.world((0.5, 0.5, 0.55), 0.5)
    stage.camera((0.0, -4.5, 2.2), (0, 0, 0.5), 50.0)
    return stage.diffuse("Floor", (0.4, 0.4, 0.42))


@case("A decal exactly on the floor, and a second one a millimetre above it", bounces=2, differs=[FACES])
def decal() -> None:
    """Two planes at the same height."""
    stage.add("Floor", stage.grid("Floor", _set(), size=12.0, cells=5))
    for k, height in enumerate((0.0, 0.001)):
        sign = stage.diffuse(f"Sign {k}", (0.7, 0.2 + 0.4 * k, 0.1))
        stage.add(f"Sign {k}", stage.plane(f"Sign {k}", sign, size=1.2), (-0.9 + 1.8 * k, 0, height))


@case("Boxes that stand exactly on the floor and side by side: their hidden faces touch, nothing differs", bounces=2)
def touching_boxes() -> None:
    """Coincident faces that nobody sees."""
    stage.add("Floor", stage.grid("Floor", _set(), size=12.0, cells=5))
    for k in range(3):
        stage.add(f"Box {k}", stage.cube(f"Box {k}", stage.diffuse(f"Box {k}", (0.2 + 0.2 * k, 0.4, 0.6)), size=0.8),
                  (-0.8 + 0.8 * k, 0, 0.4))


@case("Two objects of one material that overlap exactly", bounces=2, differs=[DOUBLED])
def doubled() -> None:
    """The duplicate that was left in place."""
    stage.add("Floor", stage.grid("Floor", _set(), size=12.0, cells=5))
    paint = stage.diffuse("Paint", (0.6, 0.3, 0.2))
    for k in range(2):
        stage.add(f"Ball {k}", stage.sphere(f"Ball {k}", paint, radius=0.6, segments=32), (0, 0, 0.6))


@case("An area light exactly on the ceiling of a room", bounces=2, differs=[LAMP])
def lamp_on_ceiling() -> None:
    """The lamp that was snapped to the ceiling."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96
    wall = stage.diffuse("Wall", (0.6, 0.6, 0.6))
    stage.add("Floor", stage.plane("Floor", wall, size=4.0))
    stage.add("Ceiling", stage.plane("Ceiling", stage.diffuse("Ceiling", (0.7, 0.6, 0.5)), size=4.0), (0, 0, 2.4))
    stage.lamp("AREA", "Lamp", 60.0, (0, 0, 2.4), size=1.0)
    stage.world((0.2, 0.2, 0.2), 0.5)
    stage.camera((0.0, -1.9, 1.2), (0, 0, 1.2), 22.0)


@case("A luminous panel exactly in the ceiling", bounces=2, differs=[FACES])
def panel_in_ceiling() -> None:
    """Emission on a coincident face."""
    lamp_on_ceiling()
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    stage.add("Panel", stage.plane("Panel", stage.emitter("Panel", (1, 1, 1), 8.0), size=1.0), (0, 0, 2.4))
