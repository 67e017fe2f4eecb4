"""Curves that carry jumps and are no edges, in words: where surfaces pass through others or through lights, where spots
without blend end, and outlines of lights. The native engine follows the same rules (curve_terms.cpp).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from .geometry_table import area_light_mesh
from .light import AreaLight, Light, PointLight, SpotLight, SunLight, is_disk
from .light_table import LEAST_BLEND
from .mesh import Mesh
from .motion import Motion
from .scene import Scene
from .shape import copy_boxes, crossing_pairs, may_cross, pair_words


def outlines(scene: Scene, lights: Collection[str], camera: bool) -> str:
    """What the primary term has of them, if one of some lights or the camera moves: a sentence, or nothing."""
    parallel = scene.camera.kind == "ORTHOGRAPHIC"
    seen = [name for name, light in scene.lights.items() if _has_outline(light) and (camera or name in lights)
            and not _lens_blurs(scene, light) and not (parallel and isinstance(light, SunLight))]
    return f"besides edges: the outlines of {', '.join(seen)}" if seen else ""


def light_curves(scene: Scene, placed: Mapping[str, Mesh], moves: Motion, held: bool) -> Iterator[str]:
    """What the shadow term has of them: sentences. `held`: light moves over all of them (contact.py)."""
    for one, other in _moving_pairs(placed, moves, held):
        if scene.emits(one) or scene.emits(other):
            yield (f"besides edges: what '{one}' and '{other}' hide of the light of each other where they may pass "
                   "through each other")
    for name, light in scene.lights.items():
        through = _through_flat(light, placed, _moving_against(placed, moves, name))
        if through:
            yield f"besides edges: what {', '.join(through)} hide of the light '{name}' where they may pass through it"
    hard = [name for name, light in scene.lights.items() if isinstance(light, SpotLight) and light.blend < LEAST_BLEND]
    if hard:
        yield f"besides edges: the borders of the cones of {', '.join(hard)}, which have no blend"


def surface_curves(placed: Mapping[str, Mesh], moves: Motion, held: bool) -> Iterator[str]:
    """The same of the indirect term."""
    for one, other in _moving_pairs(placed, moves, held):
        yield f"besides edges: the lines where {pair_words(one, other)} may pass through each other"


def missing_curves(scene: Scene, placed: Mapping[str, Mesh], moves: Motion) -> Iterator[str]:
    """Sentences on those that no term has."""
    shown = [name for name, light in scene.lights.items() if (name in moves.lights or moves.camera)
             and _has_outline(light) and _lens_blurs(scene, light)]
    if shown:
        yield f"the outlines of {', '.join(shown)}, suns or disks that an orthographic camera sees through its lens"
    for name, light in scene.lights.items():
        against = list(placed) if moves.camera else _moving_against(placed, moves, name)
        through = _through_flat(light, placed, against) if "camera" in light.visible_to else []
        if through:
            yield f"what the camera sees of the light '{name}' where {', '.join(through)} may pass through it"
        if not isinstance(light, PointLight | SpotLight) or light.radius == 0.0:
            continue
        through = [m for m in _moving_against(placed, moves, name) if _reaches(placed[m], light.position, light.radius)]
        if through:
            yield f"what {', '.join(through)} may hide of the light '{name}' by passing through it is left out"


def _has_outline(light: Light) -> bool:
    """Whether the camera may see where the light ends."""
    sized = light.angle if isinstance(light, SunLight) else 1.0 if isinstance(light, AreaLight) else light.radius
    return sized > 0.0 and "camera" in light.visible_to


def _lens_blurs(scene: Scene, light: Light) -> bool:
    """Whether an outline is none in the picture, or no circle, for one point of the lens."""
    lens = scene.camera.kind == "ORTHOGRAPHIC" and scene.camera.aperture_radius > 0.0
    return lens and (is_disk(light) or isinstance(light, SunLight))


def _moving_pairs(placed: Mapping[str, Mesh], moves: Motion, held: bool) -> list[tuple[str, str]]:
    return [(one, other) for one, other in crossing_pairs(placed)
            if held or one in moves.meshes or other in moves.meshes]


def _moving_against(placed: Mapping[str, Mesh], moves: Motion, light: str) -> list[str]:
    """Meshes that move against a light, or it against them."""
    return [name for name in placed if name in moves.meshes or light in moves.lights]


def _through_flat(light: Light, placed: Mapping[str, Mesh], names: Collection[str]) -> list[str]:
    """Those of some meshes that may pass through an area light."""
    if not isinstance(light, AreaLight):
        return []
    flat = Mesh(*area_light_mesh(light), ())
    return [name for name in names if may_cross(placed[name], flat)]


def _reaches(mesh: Mesh, center: NDArray[np.float64], radius: float) -> bool:
    """Whether a bounding box of the mesh, or of a copy of it, meets a ball."""
    return bool((np.linalg.norm(center - np.clip(center, *copy_boxes(mesh)), axis=1) < radius).any())
