"""A whole interior: a room with a window, furniture, several materials and lamps."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case
from .textures import picture


def _box(name: str, one: Any, low: Any, high: Any) -> Any:
    low, high = np.asarray(low, float), np.asarray(high, float)
    return stage.add(name, stage.cube(name, one, size=1.0), tuple(0.5 * (low + high)), (0, 0, 0), list(high - low))


def _planks() -> Any:
    """Boards: a tiled picture in base colour and roughness."""
    rng = np.random.default_rng(1)
    boards = np.repeat(rng.uniform(0.25, 0.6, (8, 1, 1)), 8, axis=0) * np.array([1.0, 0.7, 0.45])
    pixels = (boards * rng.uniform(0.85, 1.0, (64, 64, 1))).astype(np.float32)

    def shader(tree: Any) -> Any:
        where = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
        where = stage.node(tree, "ShaderNodeMapping", {"Vector": where, "Scale": (3.0, 2.0, 1.0)})
        wood = stage.node(tree, "ShaderNodeTexImage", {"Vector": where}, image=stage.image("Planks", pixels))
        shine = stage.node(tree, "ShaderNodeMapRange", {"Value": wood.outputs["Color"], "To Min": 0.5, "To Max": 0.25})
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": wood.outputs["Color"], "Roughness": shine})

    return stage.material("Planks", shader)


def _painting() -> Any:
    def shader(tree: Any) -> Any:
        paint = stage.node(tree, "ShaderNodeTexImage", image=stage.image("Painting", picture(64)))
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": paint.outputs["Color"]})

    return stage.material("Painting", shader)


def _room(wall: Any) -> None:
    """4 x 5 x 2.6 m with a window in the wall at x = 2."""
    _box("Floor", _planks(), (-2, -3, -0.1), (2, 2, 0))
    _box("Ceiling", wall, (-2, -3, 2.6), (2, 2, 2.7))
    _box("Left wall", stage.diffuse("Green wall", (0.35, 0.45, 0.3)), (-2.1, -3, 0), (-2, 2, 2.6))
    _box("Back wall", wall, (-2, 2, 0), (2, 2.1, 2.6))
    _box("Front wall", wall, (-2, -3.1, 0), (2, -3, 2.6))
    _box("Below the window", wall, (2, -3, 0), (2.15, 2, 0.8))
    _box("Above the window", wall, (2, -3, 2.2), (2.15, 2, 2.6))
    _box("Beside the window", wall, (2, 1.2, 0.8), (2.15, 2, 2.2))
    _box("Before the window", wall, (2, -3, 0.8), (2.15, -0.8, 2.2))
    _box("Cross bar", stage.principled("White paint", Roughness=0.3), (2.03, -0.8, 1.47), (2.08, 1.2, 1.53))
    _box("Upright", bpy.data.materials["White paint"], (2.03, 0.17, 0.8), (2.08, 0.23, 2.2))


def _furniture() -> None:
    wood = stage.principled("Dark wood", (0.25, 0.12, 0.06), Roughness=0.35, Coat_Weight=0.5)
    _box("Table top", wood, (-0.7, -0.2, 0.72), (0.9, 0.8, 0.77))
    leg = stage.cylinder("Leg", wood, radius=0.04, depth=0.72, segments=16)
    for x in (-0.6, 0.8):
        for y in (-0.1, 0.7):
            stage.add("Leg", leg, (x, y, 0.36))
    velvet = stage.principled("Velvet", (0.35, 0.05, 0.08), Roughness=0.9, Sheen_Weight=0.8)
    _box("Seat", velvet, (-1.95, -1.2, 0.15), (-1.15, 0.8, 0.45))
    _box("Back rest", velvet, (-1.95, -1.2, 0.45), (-1.7, 0.8, 0.95))
    stage.add("Cushion", stage.sphere("Cushion", stage.diffuse("Linen", (0.7, 0.65, 0.5)), segments=32),
              (-1.5, 0.4, 0.62), (0.4, 0.3, 0.2), [0.12, 0.28, 0.22])  # fmt: skip
    stage.add("Painting", stage.plane("Painting", _painting(), size=0.9), (-0.3, 1.985, 1.6), (math.pi / 2, 0, 0))
    steel = stage.principled("Steel", (0.7, 0.7, 0.72), Metallic=1.0, Roughness=0.2)
    stage.add("Pot", stage.sphere("Pot", steel, segments=48), (0.55, 0.45, 0.92), scale=0.15)
    china = stage.principled("Porcelain", (0.9, 0.9, 0.88), Roughness=0.1)
    stage.add("Bowl", stage.cylinder("Bowl", china, radius=0.09,
                                     top=0.17, depth=0.12, segments=48, smooth=False), (0.0, 0.2, 0.83))  # fmt: skip
    stage.add("Head", stage.monkey("Head", stage.principled("Bronze", (0.6, 0.35, 0.15), Metallic=1.0, Roughness=0.45)),
              (-0.35, 0.5, 0.94), (0.0, 0, 0.6), 0.2)  # fmt: skip
    shade = stage.simple("Paper", "ShaderNodeBsdfTranslucent", {"Color": (0.9, 0.8, 0.6)})
    stage.add("Lamp stand", stage.cylinder("Lamp stand", steel, radius=0.02, depth=1.4, segments=12), (1.4, 1.5, 0.7))
    open_shade = stage.cylinder("Shade", shade, radius=0.25, top=0.15, depth=0.35, segments=32)
    stage.add("Shade", open_shade, (1.4, 1.5, 1.55))
    glow = stage.emitter("Bulb", (1.0, 0.75, 0.45), 40.0)
    stage.add("Bulb", stage.sphere("Bulb", glow, radius=0.05, segments=16, smooth=False),
              (1.4, 1.5, 1.55))  # fmt: skip


@case("An interior: a room with a window, furniture, wood, metal, velvet, lamps", bounces=6, samples=96)
def interior() -> None:
    """Sun and sky through a window, a standing lamp, an area lamp on the ceiling."""
    _room(stage.diffuse("Plaster", (0.75, 0.73, 0.7)))
    _furniture()
    stage.world((0.55, 0.7, 1.0), 1.5)
    stage.lamp("SUN", "Sun", 3.0, (5, 0, 5), (-1.5, -0.8, 0), angle=0.02, color=(1.0, 0.9, 0.75))
    bpy.data.objects["Sun"].rotation_euler = stage.aim((5, 1.5, 4.5), (0, 0, 0.5))
    stage.lamp("AREA", "Ceiling lamp", 15.0, (0.1, -0.8, 2.55), (0.1, -0.8, 0), shape="DISK", size=0.5)
    stage.camera((0.9, -2.8, 1.5), (-0.25, 0.6, 0.95), 24.0)
