"""The Cornell box."""

from __future__ import annotations

from edgegrad import Scene
from tests.support.small_scenes import (
    box,
    camera,
    glowing,
    matte,
    moved,
    rectangle,
)


def cornell(theta: float) -> Scene:
    """The tall box of a Cornell box moves."""
    walls = {
        "floor": rectangle((0, -1, 0), (0, 0, 1), (1, 0, 0), "white"),
        "ceiling": rectangle((0, 1, 0), (1, 0, 0), (0, 0, 1), "white"),
        "back": rectangle((0, 0, -1), (1, 0, 0), (0, 1, 0), "white"),
        "right": rectangle((1, 0, 0), (0, 1, 0), (0, 0, 1), "green"),
        "left": rectangle((-1, 0, 0), (0, 0, 1), (0, 1, 0), "red"),
        "tall": box((-0.33, -0.395, -0.28), (0.3, 0.6, 0.3), "white", 0.28),
        "short": box((0.33, -0.695, 0.38), (0.3, 0.3, 0.3), "white", -0.28),
        "lamp": rectangle((0, 0.99, 0), (0.25, 0, 0), (0, 0, 0.25), "lamp"),
    }
    materials = {"white": matte(0.725, 0.71, 0.68), "red": matte(0.63, 0.065, 0.05), "green": matte(0.14, 0.45, 0.091),
                 "lamp": glowing(18.0)}  # fmt: skip
    return moved(Scene(camera((0, 0, 3.9), size=24), walls, materials), theta, "tall", (1.0, 0.0, 0.0))
