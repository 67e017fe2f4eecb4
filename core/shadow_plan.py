"""What the shadow boundary term leaves out, in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ._check import RAYS
from .light import AreaLight, PointLight, SpotLight, SunLight
from .motion import Motion
from .scene import Scene

# Blends below this share of a spot's angle are steps in its picture.
_STEP = 1e-3


def missing_shadows(scene: Scene, moves: Motion) -> Iterator[str]:
    """Sentences on jumps of direct light that no edge carries: nothing computes them."""
    hard = [name for name, light in scene.lights.items() if isinstance(light, SpotLight) and light.blend < _STEP]
    if hard:
        yield f"the border of the cones of spots without blend ({', '.join(hard)}): a jump that is no edge"
    sized = any(isinstance(light, AreaLight) or (isinstance(light, PointLight | SpotLight) and light.radius > 0.0)
                or (isinstance(light, SunLight) and light.angle > 0.0) for light in scene.lights.values())
    sized = sized or any(scene.emits(name) for name in scene.meshes)
    sky = bool(np.any(scene.world.color * scene.world.strength))
    smooth = [name for name in moves.meshes if scene.meshes[name].smoothing is not None]
    if smooth and (sized or sky):
        yield (f"the horizon of the flat faces that stand for smooth ones ({', '.join(smooth)}): where it cuts lights "
               "or the sky is left out")
    scattered = set(RAYS) - {"camera"}
    partly = [name for name, mesh in scene.meshes.items() if 0 < len(scattered & mesh.visible_to) < len(scattered)]
    if partly and (sized or sky):
        yield (f"shadows of {', '.join(partly)}, which only some kinds of rays meet: taken as those of shadow rays, or "
               "of diffuse ones under a sky of one colour")
