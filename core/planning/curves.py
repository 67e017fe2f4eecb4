"""Curves that carry jumps and are no edges, in words: where surfaces pass through others or through lights, where spots
without blend end, and outlines of lights. The native engine follows the same rules (curve_terms.cpp,
boundary/pierced_lights.cpp).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence

import numpy as np

from ..derivatives.motion import Motion
from ..geometry.placed_meshes import MOST_PAIRS, Pair, PlacedMeshes
from ..geometry.shape import MOST_COPIES, copies_near, may_cross, pair_words
from ..scene.light import AreaLight, Light, PointLight, SpotLight, SunLight, is_disk, turns_with_point
from ..scene.mesh import Mesh
from ..scene.names import listed, sentence_each
from ..scene.scene import Scene
from ..tables.geometry import area_light_mesh
from ..tables.lights import LEAST_BLEND


def seen_curves(scene: Scene, placed: PlacedMeshes, moves: Motion, camera: bool) -> list[str]:
    """What the primary term has of lights: sentences. `camera`: its rays move."""
    parallel = scene.camera.kind == "ORTHOGRAPHIC"
    shown = {name: light for name, light in scene.lights.items() if has_outline(light)}
    moving = [name for name in shown if camera or name in moves.lights]
    ends = [name for name in moving if not _lens_blurs(scene, shown[name])
            and not (parallel and isinstance(shown[name], SunLight))]
    out = [f"besides edges: the outlines of {listed(ends)}"] if ends else []
    for name, light in shown.items():
        if _turns_by_ray(scene, light):
            continue
        through = _seen_through(light, placed, list(placed) if name in moving else moves.meshes)
        if through:
            out.append(f"besides edges: the lines where {listed(through)} may pass through the light '{name}'")
    return out


def light_curves(scene: Scene, placed: PlacedMeshes, moves: Motion, held: bool) -> Iterator[str]:
    """What the shadow term has of them: sentences. `held`: light moves over all of them (contact.py)."""
    glowing = [pair for pair in _moving_pairs(placed, moves, held) if scene.emits(pair[0]) or scene.emits(pair[1])]
    yield from pair_sentences(placed, glowing, lambda pair: (
        f"besides edges: what {pair} hide of the light of each other where they may pass through each other"))
    for name, light in scene.lights.items():
        # Some turn with what they light, and where that slides, with the camera.
        turns = turns_with_point(light) and bool(moves.meshes or moves.lights or moves.camera)
        against = list(placed) if turns or name in moves.lights else moves.meshes
        through = _through(light, placed, against)
        if through:
            yield f"besides edges: what {listed(through)} hide of the light '{name}' where they may pass through it"
    hard = [name for name, light in scene.lights.items() if isinstance(light, SpotLight) and light.blend < LEAST_BLEND]
    if hard:
        yield f"besides edges: the borders of the cones of {listed(hard)}, which have no blend"


def surface_curves(placed: PlacedMeshes, moves: Motion, held: bool) -> Iterator[str]:
    """The same of the indirect term."""
    yield from crossing_lines(placed, _moving_pairs(placed, moves, held))


def crossing_lines(placed: PlacedMeshes, pairs: Sequence[Pair]) -> list[str]:
    """Sentences on lines that are boundaries as edges are."""
    return pair_sentences(placed, pairs, lambda pair: (
        f"besides edges: the lines where {pair} may pass through each other"))


def pair_sentences(placed: PlacedMeshes, pairs: Sequence[Pair], sentence: Callable[[str], str]) -> list[str]:
    """Sentences on some of the pairs of meshes that may pass through each other."""
    more = bool(pairs) and len(placed.crossing) == MOST_PAIRS
    return sentence_each([pair_words(*pair) for pair in pairs], sentence, "pairs of meshes", more=more)


def missing_curves(scene: Scene, placed: PlacedMeshes, moves: Motion) -> Iterator[str]:
    """Sentences on those that no term has."""
    shown = [name for name, light in scene.lights.items() if (name in moves.lights or moves.camera)
             and has_outline(light) and _lens_blurs(scene, light)]
    if shown:
        yield f"the outlines of {listed(shown)}, suns or disks that an orthographic camera sees through its lens"
    for name, light in scene.lights.items():
        if not (has_outline(light) and _turns_by_ray(scene, light)):
            continue
        moving = moves.camera or name in moves.lights
        through = _seen_through(light, placed, list(placed) if moving else moves.meshes)
        if through:
            yield (f"what the camera sees of the light '{name}' where {listed(through)} may pass through it: a disk "
                   "that faces parallel rays")


def missing_glare(scene: Scene, placed: PlacedMeshes, moves: Motion, lit: Collection[str]) -> Iterator[str]:
    """Sentences on light that jumps on the surfaces `lit` where they pass through what gives it: no term has that."""
    for name, light in scene.lights.items():
        moving = moves.camera or name in moves.lights
        at = set(lit).intersection(placed if moving else moves.meshes)
        through = [] if is_disk(light) else _through(light, placed, at)
        if through:
            yield (f"how the light of '{name}' jumps on {listed(through)} just where they may pass through it: what "
                   "is found of that are samples without a finite variance")


def has_outline(light: Light) -> bool:
    """Whether the camera may see where the light ends."""
    sized = light.angle if isinstance(light, SunLight) else 1.0 if isinstance(light, AreaLight) else light.radius
    return sized > 0.0 and "camera" in light.visible_to


def _turns_by_ray(scene: Scene, light: Light) -> bool:
    """Whether each of the camera's rays sees a disk of its own."""
    return scene.camera.kind == "ORTHOGRAPHIC" and is_disk(light)


def _lens_blurs(scene: Scene, light: Light) -> bool:
    """Whether an outline is none in the picture, or no circle, for one point of the lens."""
    lens = scene.camera.kind == "ORTHOGRAPHIC" and scene.camera.aperture_radius > 0.0
    return lens and (is_disk(light) or isinstance(light, SunLight))


def _moving_pairs(placed: PlacedMeshes, moves: Motion, held: bool) -> list[tuple[str, str]]:
    moving = set(moves.meshes)
    return [pair for pair in placed.crossing if held or not moving.isdisjoint(pair)]


def _seen_through(light: Light, placed: PlacedMeshes, names: Collection[str]) -> list[str]:
    """Those of some meshes that the camera sees and that may pass through a light."""
    return _through(light, placed, [name for name in names if "camera" in placed[name].visible_to])


def _through(light: Light, placed: PlacedMeshes, names: Collection[str]) -> list[str]:
    """Those of some meshes, or of copies of them, that may pass through a light, in the scene's order."""
    if isinstance(light, AreaLight):
        flat = Mesh(*area_light_mesh(light), ())
        near = placed.near(names, flat.vertices.min(axis=0), flat.vertices.max(axis=0))
        return [name for name in near if may_cross(placed[name], flat)]
    if isinstance(light, SunLight) or light.radius == 0.0:
        return []
    near = placed.near(names, light.position - light.radius, light.position + light.radius)
    return [name for name in near if _reaches(placed[name], light)]


def _reaches(mesh: Mesh, light: PointLight | SpotLight) -> bool:
    """Whether a face of a copy may pass through the sphere of a light or, of a disk that turns, into the ball of its
    places.
    """
    near = copies_near(mesh, light.position - light.radius, light.position + light.radius)
    return any(tried == MOST_COPIES or _copy_reaches(copy, light) for tried, copy in enumerate(near))


def _copy_reaches(mesh: Mesh, light: PointLight | SpotLight) -> bool:
    faces = mesh.faces
    for axis in range(3):
        across = mesh.vertices[faces, axis] - light.position[axis]
        faces = faces[(across.min(axis=1) < light.radius) & (across.max(axis=1) > -light.radius)]
    corners = mesh.vertices[faces] - light.position
    nearest = np.clip(0.0, corners.min(axis=1), corners.max(axis=1))
    near = np.linalg.norm(nearest, axis=1) < light.radius
    return bool((np.linalg.norm(corners[near], axis=2) > light.radius).any() if light.sphere else near.any())
