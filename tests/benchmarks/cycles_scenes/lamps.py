"""Blender's lights: point, spot, area, sun."""

from __future__ import annotations

import math

from . import stage
from .case import case


def _things(floor: object = None) -> None:
    stage.add("Floor", stage.plane("Floor", floor or stage.diffuse("Floor", (0.6, 0.6, 0.6)), size=30.0))
    stage.add(
        "Wall", stage.plane("Wall", stage.diffuse("Wall", (0.6, 0.55, 0.5)), size=30.0), (0, 4, 0), (math.pi / 2, 0, 0)
    )
    stage.row([stage.principled("Plastic", (0.2, 0.4, 0.7), Roughness=0.3), stage.diffuse("Chalk"),
               stage.principled("Metal", (0.9, 0.7, 0.4), Metallic=1.0, Roughness=0.25)], gap=1.9)  # fmt: skip
    stage.camera((0, -6.5, 3.2), (0, 0.5, 0.7), 38.0)


@case("Point lights: radius, soft falloff or sphere, colour, exposure, temperature")
def point_lights() -> None:
    """Five lamps above three balls."""
    _things()
    stage.lamp("POINT", "Hard", 60.0, (-2.5, -1.5, 1.6), shadow_soft_size=0.0)
    stage.lamp("POINT", "Soft", 80.0, (0.9, -1.8, 2.2), shadow_soft_size=0.4, color=(1.0, 0.7, 0.4))
    stage.lamp("POINT", "Sphere", 60.0, (2.6, 0.5, 2.0), shadow_soft_size=0.3, use_soft_falloff=False)
    stage.lamp(
        "POINT", "Near the wall", 40.0, (-1.0, 3.6, 2.0), shadow_soft_size=0.2, use_soft_falloff=False, exposure=0.5
    )
    stage.lamp("POINT", "Near the floor", 10.0, (1.0, -2.2, 0.15), shadow_soft_size=0.1, use_temperature=True,
               temperature=3200.0)  # fmt: skip


@case("Spot lights: angle, blend, radius, soft falloff or sphere")
def spot_lights() -> None:
    """Four cones on floor and wall."""
    _things()
    stage.lamp("SPOT", "Hard", 400.0, (-3, -2, 4), (-1.8, 0, 0), spot_size=0.6, spot_blend=0.0, shadow_soft_size=0.0)
    stage.lamp("SPOT", "Blended", 500.0, (0, -2, 4), (0, 0.5, 0), spot_size=0.9, spot_blend=1.0, shadow_soft_size=0.0)
    stage.lamp("SPOT", "Soft", 500.0, (3, -2, 3), (1.8, 0.5, 0), spot_size=0.8, spot_blend=0.3, shadow_soft_size=0.3)
    stage.lamp("SPOT", "Sphere", 300.0, (2, 0, 2.5), (2, 4, 1), spot_size=1.4, spot_blend=0.2, shadow_soft_size=0.2,
               use_soft_falloff=False)  # fmt: skip


@case("A spot light whose object is scaled to an ellipse")
def scaled_spot() -> None:
    """An elliptic cone on the wall, and a round one that is scaled evenly."""
    _things()
    even = stage.lamp("SPOT", "Even", 300.0, (2, 0, 2.5), (2, 4, 1), spot_size=1.0, shadow_soft_size=0.0)
    even.scale = (1.5, 1.5, 1.5)
    wide = stage.lamp("SPOT", "Uneven", 200.0, (-2, 0, 2.5), (-2, 4, 1.5), spot_size=0.7, shadow_soft_size=0.0)
    wide.scale = (2.0, 1.0, 1.0)


@case("Area lights: square, rectangle, disk, ellipse, spread, and their reflections")
def area_lights() -> None:
    """Panels over a glossy floor."""
    _things(stage.principled("Polished", (0.3, 0.3, 0.3), Roughness=0.15))
    stage.lamp("AREA", "Square", 60.0, (-2.6, 1.5, 2.5), (-1.5, 0, 0), size=1.0)
    stage.lamp("AREA", "Rectangle", 60.0, (-0.8, 2.0, 2.6), (-0.5, 0, 0), shape="RECTANGLE", size=1.4, size_y=0.3)
    stage.lamp("AREA", "Disk", 60.0, (1.0, 2.0, 2.6), (0.5, 0, 0), shape="DISK", size=0.9, color=(0.5, 0.8, 1.0))
    stage.lamp("AREA", "Ellipse", 60.0, (2.6, 1.5, 2.5), (1.5, 0, 0), shape="ELLIPSE", size=1.2, size_y=0.5)
    stage.lamp("AREA", "Spread", 30.0, (0.0, -1.5, 3.5), (0, 0, 0), size=0.5, spread=0.6)
    seen = stage.lamp("AREA", "Facing the wall", 20.0, (0.0, 3.0, 1.6), (0, 4, 1.6), shape="DISK", size=0.6, spread=2.0)
    seen.scale = (2.0, 1.0, 1.0)


@case("Suns: without and with an angle, on rough and smooth surfaces")
def suns() -> None:
    """A small and a large sun, and one without size."""
    _things(stage.principled("Polished", (0.3, 0.3, 0.3), Roughness=0.15))
    stage.lamp("SUN", "Hard", 1.0, (0, 0, 5), (1.5, 1.0, 0), angle=0.0, color=(1.0, 0.9, 0.7))
    stage.lamp("SUN", "Half a degree", 1.0, (0, 0, 5), (-2.0, 3.0, 0), angle=0.00918)
    stage.lamp("SUN", "Large", 1.0, (0, 0, 5), (-3.0, 2.0, 1.0), angle=0.5, color=(0.6, 0.8, 1.0))


@case("Lights seen by the camera, hidden from kinds of rays, or without shadow")
def lamp_visibility() -> None:
    """Switches of lights' ray visibility."""
    _things(stage.principled("Polished", (0.3, 0.3, 0.3), Roughness=0.1))
    stage.lamp("AREA", "Not in reflections", 90.0, (-2.2, 2.0, 2.0), (-1.5, 0, 0), size=1.0, visible_glossy=False)
    stage.lamp("AREA", "Only in reflections", 60.0, (0.0, 2.5, 2.0), (0, 0, 0), size=1.0, visible_diffuse=False)
    stage.lamp("AREA", "Seen", 4.0, (2.4, 2.0, 2.0), (1.0, -3, 0.5), size=0.8, visible_camera=True)
    stage.lamp("POINT", "Seen ball", 2.0, (-0.9, -1.2, 1.6), shadow_soft_size=0.15, visible_camera=True)
    bulb = stage.lamp("POINT", "Without shadow", 60.0, (3.0, -1.0, 0.8), shadow_soft_size=0.0)
    bulb.data.use_shadow = False
