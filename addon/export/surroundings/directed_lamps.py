"""Point and spot lights whose nodes make them shine differently in different directions: IES profiles.

Such a light becomes a small octahedron, which has few faces to sample. Its radiance depends on the direction alone: it
is the intensity, divided by the area that the octahedron shows in this direction. Rays pass through it, as through
lights.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e
from edgegrad.scene.placement import stretches

from ..exported import Export
from ..nodes.links import reached
from ..nodes.read_inputs import rows

LIGHT = "light"  # `Source.part` of the bodies
SIGNS = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, -1).T  # of the normals of an octahedron's faces
LEAST_RADIUS = 1e-3  # of a light without a size, relative to the distance of what it lights
# Nodes whose value depends on the distance from the light.
OF_DISTANCE = ("LIGHT_FALLOFF", "LIGHT_PATH")


def may_be_directed(out: Export, name: str, light: Any) -> bool:
    """Whether a light can become a sphere: its nodes do not depend on the distance, and nothing is linked to it."""
    exported, source = out.scene.lights[name], out.lights[name]
    return (isinstance(exported, edgegrad.PointLight | edgegrad.SpotLight) and exported.casts_shadow
            and exported.receivers is None and exported.blockers is None
            and not stretches(source.matrix[:3, :3])
            and not any(node.type in OF_DISTANCE for node in reached(light.node_tree)))  # fmt: skip


def replace_light(out: Export, name: str, tint: NDArray[np.float64], factors: NDArray[np.float64],
                  reach: float) -> None:  # fmt: skip
    """Replace a light of an export by a sphere.

    Parameters
    ----------
    tint
        (3,) colour of the light without its nodes.
    factors
        (H, W, 3) factor of its power in each direction, as a panorama in the axes of the light.
    reach
        Typical distance of the surfaces that it lights.
    """
    light, source = out.scene.lights[name], out.lights[name]
    assert isinstance(light, edgegrad.PointLight | edgegrad.SpotLight)
    radius = max(light.radius, LEAST_RADIUS * reach)
    half = radius * np.sqrt(np.pi / np.sqrt(3.0))  # seen from all directions, its area is that of a sphere on average
    intensity = light.power * tint / (4.0 * np.pi)
    shown = np.maximum(factors, 0.0) / shown_area(half, len(factors))[..., None]
    image, glow, clear, both = (f"(light) {name}{part}" for part in (": directions", ": glow", ": clear", ""))
    out.scene.images = {**out.scene.images, image: edgegrad.Image(shown.astype(np.float32))}
    turn = source.matrix[:3, :3] / np.linalg.norm(source.matrix[:3, :3], axis=0)
    # Incoming is the direction from the light to what it lights.
    local = e.Transform(e.Coordinates("INCOMING"), rows(np.c_[turn.T, np.zeros(3)]))
    picture = e.ImageTexture(image, local, projection="EQUIRECTANGULAR", alpha="NONE")
    emission = e.VectorMath("MULTIPLY", picture, tuple(float(c) for c in intensity))
    out.scene.materials = {
        **out.scene.materials,
        glow: edgegrad.Material(np.zeros(3), kind="DIFFUSE", emission_two_sided=False, textures={"emission": emission}),
        clear: edgegrad.Material(np.ones(3), kind="TRANSPARENT"),
        both: edgegrad.Mixture((glow, clear), np.ones(2)),
    }
    vertices, faces = _octahedron(half)
    mesh = edgegrad.Mesh(vertices @ turn.T + source.matrix[:3, 3], faces, materials=(both,),
                         visible_to=frozenset(light.visible_to) - {"shadow"})  # fmt: skip
    key = name
    while key in out.scene.meshes:
        key += " (light)"
    out.scene.meshes = {**out.scene.meshes, key: mesh}
    source.part = LIGHT
    out.meshes[key] = source
    del out.lights[name]
    out.scene.lights = {other: one for other, one in out.scene.lights.items() if other != name}


def _octahedron(half: float) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices on the axes at the distance `half`, and faces that face outwards."""
    vertices = half * np.concatenate([np.eye(3), -np.eye(3)])
    corners = np.where(SIGNS > 0, np.arange(3), np.arange(3) + 3)
    corners[SIGNS.prod(axis=1) < 0] = corners[SIGNS.prod(axis=1) < 0][:, ::-1]
    return vertices, corners.astype(np.int32)


def shown_area(half: float, height: int) -> NDArray[np.float64]:
    """(height, 2 height) area of the octahedron as seen from the directions of a panorama's pixels."""
    rise = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None]
    turn = 2.0 * np.pi * (0.5 - (np.arange(2 * height) + 0.5) / (2 * height))[None]
    direction = np.stack(np.broadcast_arrays(np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)))
    # A face has the area sqrt(3) / 2 half^2.
    return np.asarray(0.5 * half**2 * np.maximum(np.tensordot(SIGNS, direction, axes=1), 0.0).sum(axis=0))
