"""Pictures of a field beside those of its finely triangulated mesh, within the noise of both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from edgegrad import AreaLight, Camera, Material, Mesh, PointLight, Renderer, Scene, SunLight, World
from edgegrad._check import RAYS
from tests.support import block_statistics
from tests.support.fields.splines import exact_sphere
from tests.support.small_scenes import camera, matte, need, rectangle

RADIUS = 0.6
SEEDS, SPP = 8, 64


def sphere_mesh(radius: float, cuts: int = 160) -> Mesh:
    """A smooth-shaded sphere: one with so many triangles that its outline is that of the field up to a thousandth."""
    theta, phi = np.linspace(0.0, np.pi, cuts + 1), np.linspace(0.0, 2.0 * np.pi, 2 * cuts, endpoint=False)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    vertices = radius * np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(cuts), np.arange(2 * cuts), indexing="ij")
    a, b = row * 2 * cuts + column, row * 2 * cuts + (column + 1) % (2 * cuts)
    c, d = a + 2 * cuts, b + 2 * cuts
    quads = np.stack([a, c, d, a, d, b], axis=-1).reshape(-1, 3).astype(np.int32)
    area = np.linalg.norm(np.cross(vertices[quads[:, 1]] - vertices[quads[:, 0]],
                                   vertices[quads[:, 2]] - vertices[quads[:, 0]]), axis=1)
    faces = quads[area > 1e-12]
    return Mesh(vertices, faces, ("ball",), smoothing=faces)


def lit(kind: str) -> dict[str, object]:
    """Lights and world of a kind."""
    if kind == "world":
        return {"world": World(np.array([0.7, 0.8, 1.0]))}
    to_world = np.eye(4)
    to_world[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # -Z axis down
    to_world[:3, 3] = 0.3, 2.5, 0.5
    lamp = {
        "point": lambda: PointLight(np.array([1.5, 2.0, 2.0]), power=200.0),
        "sun": lambda: SunLight(np.array([-0.4, -1.0, -0.7]), strength=3.0, angle=0.1),
        "area": lambda: AreaLight(to_world, power=60.0, size=np.array([1.0, 1.0])),
    }[kind]()
    return {"lights": {"lamp": lamp}}


MATERIALS = {
    "matte": matte(0.8, 0.5, 0.3),
    "glossy": Material(np.array([0.9, 0.7, 0.5]), metallic=1.0, roughness=0.3, kind="PRINCIPLED"),
    "glass": Material(np.ones(3), kind="GLASS", roughness=0.0, ior=1.45),
    "rough glass": Material(np.ones(3), kind="GLASS", roughness=0.3, ior=1.3),
    "half transparent": Material(np.array([0.8, 0.3, 0.3]), alpha=0.4, kind="PRINCIPLED", roughness=0.5),
    "mirror": Material(np.ones(3) * 0.9, kind="GLOSSY", roughness=0.0),
}


def pair(material: Material, light: str, seen_by: Camera | None = None) -> tuple[Scene, Scene]:
    """A ball over a floor beside a wall, as a field and as a mesh."""
    meshes = {"floor": rectangle((0, -0.7, 0), (0, 0, 3), (3, 0, 0), "white"),
              "wall": rectangle((-1.2, 0.5, 0), (0, 1.2, 0), (0, 0, 3), "red")}
    mesh = Scene(seen_by or camera((0.5, 0.8, 3.2), (0, -0.1, 0), 24),
                 {**meshes, "ball": sphere_mesh(RADIUS)},
                 {"white": matte(0.7, 0.7, 0.7), "red": matte(0.7, 0.2, 0.2), "ball": material},
                 **lit(light))  # type: ignore[arg-type]
    field = replace(mesh, meshes=meshes, fields={"ball": exact_sphere(RADIUS, 24, material="ball")})
    return field, mesh


def check_same(field: Scene, mesh: Scene, depth: int, first_seed: int = 0) -> None:
    """The pictures of both agree within their noise, up to the flatness of the triangles."""
    pictures = [np.stack([Renderer(scene).render(spp=SPP, max_depth=depth, seed=100 * k + j + first_seed)
                          for j in range(SEEDS)]) for k, scene in enumerate((field, mesh))]
    one, other = (np.stack([block_statistics.block_sums(p) for p in of]) for of in pictures)
    # The mesh's outline and normals differ from the field's by about this part.
    flat = 2e-3 * float(np.abs(other).max())
    assert block_statistics.means_p_value(one.reshape(SEEDS, -1), other.reshape(SEEDS, -1), flat) > (
        block_statistics.ALARM)


@pytest.mark.parametrize("light", ["world", "point", "sun", "area"])
@pytest.mark.parametrize("name", MATERIALS)
def test_a_field_looks_like_its_mesh(name: str, light: str) -> None:
    """Shadows of the field on meshes and back, reflections and refractions, in all lights."""
    need("native")
    if name == "glass" and light in ("point", "sun", "area"):
        pytest.skip("caustics of small lights have no finite variance")
    check_same(*pair(MATERIALS[name], light), depth=5)


@pytest.mark.parametrize("kind", ["ORTHOGRAPHIC", "EQUIRECTANGULAR", "lens", "inside"])
def test_all_cameras_see_fields(kind: str) -> None:
    need("native")
    seen_by = camera((0.5, 0.8, 3.2), (0, -0.1, 0), 24)
    if kind == "lens":
        seen_by = replace(seen_by, aperture_radius=0.1, focus_distance=3.0)
    elif kind == "inside":
        seen_by = camera((0.1, 0.05, 0.1), (0, 0, -1), 24, 1.2)
    elif kind == "ORTHOGRAPHIC":
        seen_by = replace(seen_by, kind=kind, ortho_width=3.0)
    else:
        seen_by = replace(seen_by, kind=kind)
    material = MATERIALS["half transparent"] if kind == "inside" else MATERIALS["glossy"]
    check_same(*pair(material, "world", seen_by), depth=4)


@pytest.mark.parametrize("hidden", ["camera", "diffuse", "shadow", "glossy"])
def test_fields_can_be_hidden_from_rays(hidden: str) -> None:
    need("native")
    field, mesh = pair(matte(0.8, 0.5, 0.3), "area")
    rays = frozenset(RAYS) - {hidden}
    field.fields["ball"].visible_to = rays
    mesh.meshes["ball"].visible_to = rays
    check_same(field, mesh, depth=4)


def test_light_linking_takes_names_of_fields() -> None:
    need("native")
    field, mesh = pair(matte(0.8, 0.5, 0.3), "point")
    for scene in (field, mesh):
        scene.lights["lamp"].receivers = ("ball", "floor")
        scene.lights["lamp"].blockers = ("wall",)
    check_same(field, mesh, depth=3)
