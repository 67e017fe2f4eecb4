"""What the camera alone sees of a world: an image on a sphere around the scene, which lights nothing.

A scene has one environment. If nodes (*Is Camera Ray*) show the camera another image than the one that lights the
scene, this image glows on a sphere just within the camera's clip distance, for rays from the camera only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e
from edgegrad.scene.placement import places

from ..exported import Export, Source
from ..nodes.images import Images
from ..nodes.read_inputs import rows
from .environment import bake_world
from .world import WorldReading

NAME = "(world) seen by camera rays"
AROUND = 48  # faces of the sphere around its equator
WITHIN_CLIP = 0.98  # of the clip distance, beyond which the camera sees nothing
FARTHEST = 1e5  # metres; a clip distance beyond it is as good as none
AWAY = 10.0  # radius relative to the scene's size, if the camera has no clip distance


def add_backdrop(out: Export, seen: WorldReading, images: Images, resolution: int,
                 widths: dict[str, int] | None = None) -> None:  # fmt: skip
    """Add the world that only the camera sees to an exported scene."""
    if seen.baked:
        bake_world(seen, images, resolution, out.report, out.scene.camera, suns=False, widths=widths)
    world = seen.value
    if world.image is None:
        return
    direction = e.VectorMath("SCALE", e.Coordinates("INCOMING"), scale=-1.0)
    picture = e.ImageTexture(world.image, e.Transform(direction, rows(np.c_[world.rotation, np.zeros(3)])),
                             projection="EQUIRECTANGULAR", alpha="NONE")  # fmt: skip
    factor = tuple(float(c) for c in world.color * world.strength)
    emission = e.VectorMath("MULTIPLY", e.VectorMath("MULTIPLY", picture, factor), e.LightPath("CAMERA"))
    glow = edgegrad.Material(np.zeros(3), kind="DIFFUSE", textures={"emission": emission})
    out.scene.materials = {**out.scene.materials, NAME: glow}
    camera = out.scene.camera
    vertices, faces = _sphere(_radius(out), AROUND)
    out.scene.meshes = {**out.scene.meshes, NAME: edgegrad.Mesh(
        vertices + camera.to_world[:3, 3], faces, materials=(NAME,), visible_to=frozenset({"camera"}))}  # fmt: skip
    out.meshes[NAME] = Source("", "", np.eye(4), instance=True, part=NAME)


def _radius(out: Export) -> float:
    camera = out.scene.camera
    if camera.clip_end <= FARTHEST:
        return WITHIN_CLIP * float(camera.clip_end)
    position = camera.to_world[:3, 3]
    far = [np.linalg.norm(mesh.vertices @ place[:, :3].T + place[:, 3] - position, axis=1).max()
           for mesh in out.scene.meshes.values() if len(mesh.vertices)
           for place in places(mesh)]  # fmt: skip
    return AWAY * float(max([1.0, *far]))


def _sphere(radius: float, around: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices and faces of a sphere with this many faces around its equator, which face outwards."""
    up = around // 2
    turn, rise = np.meshgrid(np.arange(around) * 2.0 * np.pi / around, np.linspace(0.0, np.pi, up + 1))
    vertices = radius * np.stack([np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), np.cos(rise)], axis=-1)
    row, column = (x.ravel() for x in np.meshgrid(np.arange(up), np.arange(around), indexing="ij"))
    a, b = row * around + column, row * around + (column + 1) % around
    upper, lower = np.stack([a, a + around, b + around], axis=1), np.stack([a, b + around, b], axis=1)
    # At the poles one triangle of each pair has no area.
    faces = np.concatenate([upper[row < up - 1], lower[row > 0]])
    return vertices.reshape(-1, 3), faces.astype(np.int32)
