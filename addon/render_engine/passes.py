"""Render passes other than the picture: what the camera sees, as colours that surfaces emit.

A channel is the picture of a scene in which each surface emits its value (depth, normal, colour) instead of scattering
light. Transparent parts of materials stay transparent. So channels have the pixel filter, depth of field and textures
of the picture, and with equal samples they show what its samples have hit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Expression, Operand
from edgegrad.scene.camera import PANORAMAS

from ..export.geometry.attributes import INDEX
from ..export.materials.holdouts import HELD
from ..export.materials.shaders import mixture, product, weighted
from ..export.nodes.camera_view import CameraView
from ..export.surroundings.backdrop import NAME as BACKDROP

F32 = NDArray[np.float32]

DEPTH, NORMAL, ALBEDO, OBJECT_INDEX = "depth", "normal", "albedo", "object index"
# Depth of pixels that see no surface, as in Cycles.
FAR = 1e10
# Values that have no mean (depth, index) are those at the pixel's centre, which this filter width samples.
CENTER_WIDTH = 1e-3

Closures = list[tuple[edgegrad.Material, Operand]]


def has_alpha(scene: edgegrad.Scene, film_transparent: bool) -> bool:
    """Whether a pixel of the picture may be transparent."""
    return film_transparent or any(name.endswith(HELD) for name in scene.materials)


def alpha_scene(scene: edgegrad.Scene, film_transparent: bool) -> edgegrad.Scene:
    """Make the scene whose picture is 1 minus the alpha of the picture of `scene`."""
    def emitted(name: str, closures: Closures) -> Operand:
        return 1.0 if name.endswith(HELD) else 0.0

    return _emitting(scene, emitted, 1.0 if film_transparent else 0.0)


def channel(export_scene: edgegrad.Scene, name: str, samples: int, seed: int, transparent: edgegrad.Bounces,
            progress: Callable[[float], None] | None, threads: int = 0) -> F32:  # fmt: skip
    """Render a channel.

    Parameters
    ----------
    name
        `DEPTH`, `NORMAL`, `ALBEDO` or `OBJECT_INDEX`; the last reads the attribute `INDEX` of the meshes.
    transparent
        Its limit of transparent surfaces is used.

    Returns
    -------
    (height, width, 1 or 3) float32.
    """
    def picture(scene: edgegrad.Scene, samples: int) -> F32:
        renderer = edgegrad.Renderer(scene, threads=threads, watched=False)
        return renderer.render(spp=samples, seed=seed, max_depth=1, bounces=transparent, progress=progress)

    if name == ALBEDO:
        return picture(_emitting(export_scene, _albedo), samples)
    if name == NORMAL:
        # Emission is not negative: the picture is that of (n + 1) / 2.
        covered = picture(_emitting(export_scene, lambda *_: 1.0), samples)
        return 2.0 * picture(_emitting(export_scene, _normal), samples) - covered
    camera = replace(export_scene.camera, filter="BOX", filter_width=CENTER_WIDTH, aperture_radius=0.0)
    scene = replace(export_scene, camera=camera)
    value = _depth(camera) if name == DEPTH else e.Attribute(INDEX, required=False)
    found = picture(_emitting(scene, lambda *_: e.Combine(value, 1.0, 0.0)), 1)
    covered = found[..., 1:2]
    values = np.divide(found[..., :1], covered, out=np.zeros_like(covered), where=covered > 0.0)
    if name == DEPTH:
        return np.where(covered > 0.0, values, np.float32(FAR))
    return np.rint(values)


def _depth(camera: edgegrad.Camera) -> Expression:
    """Distance along the view axis; for panoramas the distance to the camera."""
    rows = tuple(tuple(map(float, row)) for row in CameraView.of(camera).world_to_camera[:3])
    place = e.Transform(e.Coordinates("POSITION"), rows)  # type: ignore[arg-type]
    if camera.kind in PANORAMAS:
        return e.VectorMath("LENGTH", place)
    return e.Channel(place, 2)


def _emitting(scene: edgegrad.Scene, emitted: Callable[[str, Closures], Operand], world: float = 0.0) -> edgegrad.Scene:
    """Make a scene whose materials emit `emitted(name, closures)` where they are opaque; `world`: its radiance.

    Only what is seen of the world is dimmed by media.
    """
    used = {name for mesh in scene.meshes.values() for name in mesh.materials}
    materials: dict[str, edgegrad.Material | edgegrad.Mixture] = {}
    for name in used:
        materials |= _emitter(scene, name, emitted, world > 0.0)
    meshes = {name: mesh for name, mesh in scene.meshes.items() if name != BACKDROP}
    sky = edgegrad.World(np.full(3, world), medium=scene.world.medium if world > 0.0 else None)
    return replace(scene, meshes=meshes, materials=materials, lights={}, world=sky)


def _emitter(scene: edgegrad.Scene, name: str, emitted: Callable[[str, Closures], Operand], filled: bool) -> dict[
        str, edgegrad.Material | edgegrad.Mixture]:  # fmt: skip
    closures = weighted(scene.materials[name], scene.closures(name))
    layers: Closures = []
    for part, weight in closures:
        clear = _clearness(part)
        if part.kind == "TRANSPARENT":
            layers.append((part.as_surface(), weight))
        elif clear != 0.0:
            layers.append((edgegrad.Material(np.ones(3), kind="TRANSPARENT"), product(weight, clear)))
    opaque = _opaqueness(closures)
    # A layer that is nowhere opaque would end half of the paths, so that channels of one sample miss what lies behind
    if opaque != 0.0:
        value = _scaled(emitted(name, closures), opaque)
        glow = edgegrad.Material(np.zeros(3), kind="DIFFUSE")
        if isinstance(value, Expression):
            glow.textures = {"emission": value}
        else:
            glow.emission = np.broadcast_to(np.asarray(value, np.float64), 3).copy()
        layers.append((glow, 1.0))
    medium = closures[0][0].medium if filled else None
    parts = {f"{name} / {k}": replace(part, medium=medium) for k, (part, _) in enumerate(layers)}
    return {**parts, name: mixture({key: weight for key, (_, weight) in zip(parts, layers, strict=True)})}


def _clearness(part: edgegrad.Material) -> Operand:
    """Fraction of a closure that is transparent."""
    if part.kind == "TRANSPARENT":
        return 1.0
    if part.kind == "PRINCIPLED" and (part.alpha < 1.0 or "alpha" in part.textures):
        return _rest(part.textures.get("alpha", part.alpha))
    return 0.0


def _rest(value: Operand) -> Operand:
    return e.Math("SUBTRACT", 1.0, value, clamp=True) if isinstance(value, Expression) else 1.0 - float(value)  # type: ignore[arg-type]


def _sum(terms: list[Operand]) -> Operand:
    total: Operand = 0.0
    for term in terms:
        if isinstance(total, float) and isinstance(term, float):
            total += term
        else:
            total = term if total == 0.0 else e.Math("ADD", total, term)
    return total


def _opaqueness(closures: Closures) -> Operand:
    clear = _sum([product(weight, _clearness(part)) for part, weight in closures])
    return _rest(clear if isinstance(clear, Expression) else min(clear, 1.0))


def _scaled(value: Operand, factor: Operand) -> Operand:
    """Product of a colour or vector and a number."""
    if factor == 1.0:
        return value
    if isinstance(value, Expression) or isinstance(factor, Expression):
        return e.VectorMath("SCALE", value, scale=factor)
    return tuple(float(component) for component in np.multiply(value, factor) * np.ones(3))


def _added(values: list[Operand]) -> Operand:
    """Sum of colours or vectors."""
    total: Operand | None = None
    for value in values:
        total = value if total is None else e.VectorMath("ADD", total, value)
    return (0.0, 0.0, 0.0) if total is None else total


def _albedo(name: str, closures: Closures) -> Operand:
    """Colour of the diffuse closures."""
    return _added([_scaled(_diffuse_color(part), weight) for part, weight in closures
                   if part.kind in ("DIFFUSE", "TRANSLUCENT", "PRINCIPLED")])  # fmt: skip


def _diffuse_color(part: edgegrad.Material) -> Operand:
    color: Operand = part.textures.get("base_color", tuple(float(c) for c in part.base_color))
    if part.kind != "PRINCIPLED":
        return color
    for field in ("metallic", "transmission"):
        color = _scaled(color, _rest(part.textures.get(field, float(getattr(part, field)))))
    return color


def _normal(name: str, closures: Closures) -> Operand:
    """(n + 1) / 2 for the mean shading normal n of the closures that are not transparent."""
    solid = [(part, product(weight, _rest(_clearness(part)))) for part, weight in closures
             if part.kind != "TRANSPARENT"]  # fmt: skip
    if not solid:
        return (0.0, 0.0, 0.0)
    mean: Operand = _shading_normal(solid[0][0])
    if len({_shading_normal(part) for part, _ in solid}) > 1:
        mean = e.VectorMath("NORMALIZE", _added([_scaled(_shading_normal(part), weight) for part, weight in solid]))
    return e.VectorMath("MULTIPLY_ADD", mean, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5))


def _shading_normal(part: edgegrad.Material) -> Expression:
    color = part.textures.get("normal")
    smooth = part.textures.get("smooth_normal", e.Coordinates("NORMAL"))
    if color is None:
        return smooth
    if part.normal_space == "WORLD":
        return color
    return e.NormalMap(color, part.textures.get("normal_strength", part.normal_strength), part.normal_uv)
