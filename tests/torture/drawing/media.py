"""Media in materials and in the world: from thin to dense, with and without scattering, also in open meshes."""

from __future__ import annotations

import numpy as np

from edgegrad import Material, Medium, Scene
from tests.torture.drawing.draw import Draw

# Share of the scenes that have media.
MEDIA = 0.1


def medium(draw: Draw, scale: float) -> Medium:
    """A medium of any density in a world of this size."""
    def coefficients() -> tuple[float, ...]:
        return tuple((draw.log(1e-3, 1e3) / scale * draw.color()).tolist()) if draw.chance(0.8) else (0.0, 0.0, 0.0)

    return Medium(coefficients(), coefficients(), draw.one((0.0, 0.0, 0.5, -0.7, 0.999, -0.999, 1e-6)))


def add_media(draw: Draw, scene: Scene, scale: float) -> None:
    """Sometimes fill the world, or the meshes of all materials or of one that is no part of a mixture."""
    if not draw.chance(MEDIA):
        return
    if draw.chance(0.4):
        scene.world.medium = medium(draw, scale)
        if draw.chance(0.5):
            return
    of_fields = {one.material for one in scene.fields.values()}
    shaders = {name: one for name, one in scene.materials.items() if isinstance(one, Material)}
    mixed = {part for one in scene.materials.values() if not isinstance(one, Material) for part in one.parts}
    if of_fields & {name for name in scene.materials if name not in shaders} or (mixed and draw.chance(0.5)):
        mixed = mixed | of_fields
    filled = medium(draw, scale)
    free = [name for name in shaders if name not in mixed | of_fields]
    chosen = list(shaders) if not of_fields and draw.chance(0.3) else free and [draw.one(tuple(free))]
    for name in chosen:
        shaders[name].medium = filled
        shaders[name].absorption = np.zeros(3)
        if draw.chance(0.5):
            shaders[name].kind = "TRANSPARENT"
            shaders[name].distribution = "GGX"
