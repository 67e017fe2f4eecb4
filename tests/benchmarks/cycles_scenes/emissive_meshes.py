"""Meshes that give light."""

from __future__ import annotations

import numpy as np

from . import stage
from .case import case


@case("Eighty emissive meshes of different size and strength in a hall", bounces=2, samples=72)
def many_emitters() -> None:
    """Small lamps under a ceiling and on the floor."""
    rng = np.random.default_rng(3)
    stage.add("Floor", stage.plane("Floor", stage.diffuse("Floor", (0.5, 0.5, 0.5)), size=16.0))
    stage.add("Ceiling", stage.plane("Ceiling", stage.diffuse("Ceiling", (0.7, 0.7, 0.7)), size=16.0), (0, 0, 3.2))
    stage.add(
        "Wall", stage.plane("Wall", stage.diffuse("Wall", (0.6, 0.5, 0.4)), size=16.0), (0, 8, 1), (np.pi / 2, 0, 0)
    )
    glow = [
        stage.emitter(f"Glow {k}", rng.uniform(0.2, 1.0, 3), float(4.0 * 3.0 ** rng.uniform(0, 2))) for k in range(8)
    ]
    bulb = [stage.sphere(f"Bulb {k}", one, radius=0.06, segments=12, smooth=False) for k, one in enumerate(glow)]
    for k in range(80):
        x, y = rng.uniform(-6, 6), rng.uniform(-5, 7)
        z = 2.9 if k % 3 else 0.1
        stage.add(f"Lamp {k}", bulb[k % 8], (x, y, z), (0, 0, 0), float(rng.uniform(0.6, 1.8)))
    stage.row([stage.diffuse("Chalk"), stage.principled("Plastic", (0.2, 0.4, 0.7), Roughness=0.3),
               stage.principled("Metal", (0.9, 0.7, 0.4), Metallic=1.0, Roughness=0.3)], gap=1.9)  # fmt: skip
    stage.camera((0, -7.5, 1.7), (0, 0.5, 1.2), 28.0)


@case("Emission that varies over a surface, two-sided, and beside reflection", bounces=3)
def textured_emitters() -> None:
    """A screen with a picture, a glowing panel, a warm ball."""
    from .textures import picture

    stage.add("Floor", stage.plane("Floor", stage.principled("Floor", (0.4, 0.4, 0.4), Roughness=0.3), size=20.0))
    stage.add(
        "Wall", stage.plane("Wall", stage.diffuse("Wall", (0.5, 0.5, 0.5)), size=20.0), (0, 3, 0), (np.pi / 2, 0, 0)
    )

    def screen(tree: object) -> object:
        texture = stage.node(tree, "ShaderNodeTexImage", image=stage.image("Screen", picture()))
        return stage.node(tree, "ShaderNodeEmission", {"Color": texture.outputs["Color"], "Strength": 4.0})

    stage.add(
        "Screen", stage.plane("Screen", stage.material("Screen", screen), size=1.8), (-1.6, 1.5, 1.2), (1.5, 0, 0.3)
    )
    stage.add("Panel", stage.plane("Panel", stage.emitter("Panel", (0.6, 0.8, 1.0), 3.0), size=0.8), (1.4, 1.6, 1.6),
              (0.4, 0.3, 0))  # fmt: skip
    stage.row([stage.diffuse("Chalk"), stage.principled("Plastic", (0.7, 0.2, 0.1), Roughness=0.25),
               stage.principled("Ember", (0.3, 0.1, 0.05), Emission_Color=(1.0, 0.4, 0.1), Emission_Strength=1.5)],
              gap=1.5, y=-0.5)  # fmt: skip
    stage.camera((0, -6.0, 2.4), (0, 0.5, 0.8), 38.0)
