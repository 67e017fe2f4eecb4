"""The scene as flat tables, which both engines read; `table_derivatives` has their derivatives by the parameters."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import derived
from ..geometry import topology
from ..geometry.mesh_batches import batches
from ..scene.camera import FILTERS, Camera
from ..scene.camera import KINDS as CAMERA_KINDS
from ..scene.light import AreaLight
from ..scene.material import Material, Mixture
from ..scene.parameters import MEDIUM, split
from ..scene.placement import placed_meshes
from ..scene.scene import Scene, validated
from .camera import camera_row
from .fields import FieldTable
from .geometry import geometry, ray_bits
from .lights import LightTable, light_table
from .materials import TWO_SIDED, MaterialTable, material_table
from .mean_color import mean_expression
from .media import medium_row, medium_table
from .textures.program import compile_textures
from .textures.texture_tables import TextureTables

F32 = NDArray[np.float32]

# Fields of `Tables`, besides the vertices, from which engines build their own structures.
_BUILT_IN = (
    "faces", "face_material", "mesh_first_vertex", "mesh_first_face", "visible", "mesh_mask", "mesh_receivers",
    "mesh_terminator", "mesh_dimming", "corner_normal", "mesh_first_normal", "mesh_custom", "custom_normals",
    "instance_mesh", "instance_to_world",
)

# Collections of parameters that are not geometry.
_VALUED = ("materials", "lights", "world", "camera")


@dataclass
class Tables:
    """A scene as arrays: V vertices, F faces, S meshes (behind the scene's those of fields, then those of area
    lights), M materials.

    World positions are relative to `origin`, so that float32 keeps its precision far from the origin of the world.
    """

    origin: NDArray[np.float64]  # (3,)
    vertices: F32  # (V, 3) relative to origin
    faces: NDArray[np.uint32]  # (F, 3) into vertices
    face_material: NDArray[np.int32]  # (F,)
    mesh_first_vertex: NDArray[np.int64]  # (S + 1,)
    mesh_first_face: NDArray[np.int64]  # (S + 1,)
    mesh_names: tuple[str, ...]  # of the meshes of the scene; meshes of area lights have no name
    fields: tuple[FieldTable, ...]
    field_names: tuple[str, ...]
    visible: NDArray[np.uint8]  # (S,) 1: rays can hit it; 0: an area light, which rays pass through
    mesh_mask: NDArray[np.uint32]  # (S,) bits of rays that hit it: 1 << kind of ray, 1 << (FIRST_BLOCKERS + set)
    mesh_receivers: NDArray[np.uint32]  # (S,) bits of the sets of receivers that contain it
    mesh_terminator: F32  # (S,) Mesh.terminator_offset
    mesh_dimming: F32  # (S,) factor on the angle of arriving light, by Mesh.terminator_shading; 1: none
    corner_normal: NDArray[np.int32]  # (F, 3) indices of shading normals, -1: flat; (0, 3): all faces are flat
    mesh_first_normal: NDArray[np.int64]  # (S + 1,) first shading normal of each mesh
    mesh_custom: NDArray[np.uint8]  # (S,) 1: custom shading normals, 0: computed from the vertices
    custom_normals: F32  # (N, 3) custom normals, of unit length; (0, 3): there are none
    instance_mesh: NDArray[np.int32]  # (I,) mesh of each instance
    instance_to_world: F32  # (I, 3, 4) transforms, relative to origin
    materials: MaterialTable  # all closures of all materials
    lights: LightTable  # all lights that are not meshes
    media: F32  # (M, 8) media within closed meshes (`media.medium_row`)
    world_medium: F32  # (8,) and around them
    environment_rotation: F32  # (3, 3) from world space to the image's
    environment_mask: int  # bits of the kinds of rays that it is visible to
    emission: F32  # (M, 3) mean over textures and closures, for the choice of lights
    environment: F32  # (3,) radiance
    camera: F32  # (30,) row of the camera (`camera.PLACES`)
    camera_kind: int  # index in camera.KINDS
    aperture_blades: int
    full_size: NDArray[np.int32]  # (2,) width and height of the full picture
    window: NDArray[np.int32]  # (2,) first pixel of the rendered window
    filter_kind: int  # index in camera.FILTERS
    filter_width: float  # pixels
    width: int  # of the rendered window
    height: int
    clip_start: float
    clip_end: float
    textures: TextureTables | None  # None: nothing in the scene is textured
    environment_pixels: F32 | None  # (h, w, 3) image of the environment, row 0 on top

    @cached_property
    def mesh_number(self) -> dict[str, int]:
        """Name of a mesh -> index in `mesh_names`."""
        return {name: k for k, name in enumerate(self.mesh_names)}

    @property
    def emission_two_sided(self) -> NDArray[np.uint8]:
        """(M,) 1: faces of the material emit from both sides."""
        first = np.take(self.materials.flags, self.materials.first_closure[:-1])
        return ((first & TWO_SIDED) != 0).astype(np.uint8)

    def same_geometry(self, other: Tables) -> bool:
        """Whether the meshes and their vertices are the same as in other tables."""
        return self.same_but_vertices(other) and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in ("origin", "vertices")
        ) and all(map(FieldTable.same_values, self.fields, other.fields))

    def same_but_vertices(self, other: Tables) -> bool:
        """Whether an update from other tables needs no rebuild: all from which engines build structures is the same."""
        return self.mesh_names == other.mesh_names and self.same_fields(other) and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in _BUILT_IN
        )

    def same_fields(self, other: Tables) -> bool:
        """Whether the fields have the same names and sizes."""
        sizes = [[table.values.shape for table in tables.fields] for tables in (self, other)]
        return self.field_names == other.field_names and sizes[0] == sizes[1]

    def edges(self) -> topology.Edges:
        """Return the edges of all meshes that rays can hit; area lights are left out."""
        parts, vertex_first, face_first = [], [], []
        counts = np.diff(self.mesh_first_vertex)
        for first, last in batches((counts + np.diff(self.mesh_first_face))[: len(self.mesh_names)]):
            (v, v_end), (f, f_end) = (begin[[first, last]] for begin in (self.mesh_first_vertex, self.mesh_first_face))
            faces = self.faces[f:f_end].astype(np.int64) - v
            of = np.repeat(np.arange(last - first), counts[first:last])
            label = topology.weld(self.vertices[v:v_end].astype(np.float64), of=of)
            parts.append(topology.edges(faces.astype(np.int32), label, self.vertices[v:v_end], of))
            vertex_first.append(int(v))
            face_first.append(int(f))
        return topology.join(parts, vertex_first, face_first)


def camera_fields(camera: Camera, origin: NDArray[np.float64]) -> dict[str, Any]:
    """Return the fields of `Tables` that depend on the camera."""
    x0, y0, _, _ = camera.window
    height, width = camera.size
    return {
        "camera": camera_row(camera, origin).astype(np.float32),
        "camera_kind": CAMERA_KINDS.index(camera.kind),
        "aperture_blades": camera.aperture_blades,
        "full_size": np.array([camera.width, camera.height], np.int32),
        "window": np.array([x0, y0], np.int32),
        "filter_kind": FILTERS.index(camera.filter),
        "filter_width": camera.filter_width,
        "width": width,
        "height": height,
        "clip_start": camera.clip_start,
        "clip_end": camera.clip_end,
    }


def flatten(
    scene: Scene, origin: NDArray[np.float64] | None = None, earlier: TextureTables | None = None
) -> Tables:
    """Make the tables of a scene, relative to `origin` (None: the centre of its bounding box).

    The arrays of `earlier` textures are shared if images and attributes have not changed since (`compile_textures`).
    Raises ``ValueError`` as `Scene.validate` does.
    """
    validated(scene)
    meshes = placed_meshes(scene)
    placed = geometry(scene, meshes, origin)
    origin = placed["origin"]
    textures = compile_textures(scene, origin, meshes, earlier=earlier) if _needs_textures(scene) else None
    return Tables(**placed, **_values(scene, origin, textures), textures=textures,
                  environment_pixels=environment_pixels(scene) if shows_image(scene) else None)


def with_values(scene: Scene, tables: Tables, paths: Collection[str] | None = None) -> Tables:
    """Return tables with the same geometry and textures, and the present materials, lights, world and camera.

    Parameters
    ----------
    paths
        Parameter paths of what has changed; nothing else is read. None: everything may have changed.
    """
    if paths is None:
        held = [("materials", name) for name in scene.materials] + [("lights", name) for name in scene.lights]
        held += [("world", ""), ("camera", "")]
    else:
        held = sorted({split(path)[:2] for path in paths})
    for collection, name in held:
        if name:
            getattr(scene, collection)[name].validate(name)
        else:
            getattr(scene, collection).validate()
    if paths is None or any(split(path)[2].startswith(MEDIUM) for path in paths):
        for name in scene.materials:
            scene.check_medium(name)
    return replace(tables, **_values(scene, tables.origin, tables.textures, {collection for collection, _ in held}))


def shows_image(scene: Scene) -> bool:
    """Whether the environment has an image and is not black."""
    return scene.world.image is not None and bool(np.any(scene.world.color * scene.world.strength))


def _needs_textures(scene: Scene) -> bool:
    return any(
        material.textures or (isinstance(material, Material) and material.anisotropy != 0.0)
        for material in scene.materials.values()
    )


def environment_pixels(scene: Scene) -> F32 | None:
    """Return the image of the environment with three channels; None if it has no image."""
    if scene.world.image is None:
        return None
    pixels = scene.images[scene.world.image].pixels
    return np.ascontiguousarray(np.broadcast_to(pixels[..., :3], (*pixels.shape[:2], 3)), np.float32)


def _values(
    scene: Scene, origin: NDArray[np.float64], textures: TextureTables | None, collections: Collection[str] = _VALUED
) -> dict[str, Any]:
    """Return the fields of `Tables` that hold materials, lights, the environment and the camera."""
    out: dict[str, Any] = {}
    if "materials" in collections:
        out |= _material_values(scene, {} if textures is None else textures.least_blue)
    if "lights" in collections:
        out["lights"] = light_table(scene, origin)
    if "world" in collections:
        out |= {
            "environment_rotation": scene.world.rotation.astype(np.float32),
            "environment_mask": ray_bits(scene.world.visible_to),
            "world_medium": medium_row(scene.world.medium),
            "environment": (scene.world.color * scene.world.strength).astype(np.float32),
        }
    if "camera" in collections:
        out |= camera_fields(scene.camera, origin)
    return out


def _material_values(scene: Scene, least_blue: dict[str, float]) -> dict[str, Any]:
    radiances = [_area_radiance(light) for light in scene.lights.values() if isinstance(light, AreaLight)]
    return {
        "materials": material_table(scene, radiances, least_blue),
        "media": medium_table(scene, len(radiances)),
        "emission": _rows([mean_emission(scene, name) for name in scene.materials] + radiances),
    }


def mean_emission(scene: Scene, name: str) -> NDArray[np.float64]:
    """(3,) mean emission of a material: the weighted sum over a mixture, and the mean of textures."""
    material = scene.materials[name]
    weights = material.weights if isinstance(material, Mixture) else np.ones(1)
    total = np.zeros(3)
    for closure, weight in zip(scene.closures(name), weights, strict=True):
        expression = closure.textures.get("emission")
        total += weight * (closure.emission if expression is None else mean_expression(scene, expression))
    derived(f"material '{name}'", "its emission", total)
    return total


def _rows(rows: list[Any], dtype: Any = np.float32) -> NDArray[Any]:
    """Stack rows of three numbers into one (n, 3) array; n may be 0."""
    return np.ascontiguousarray(np.concatenate([np.reshape(r, (-1, 3)) for r in rows]) if rows
                                else np.zeros((0, 3)), dtype)


def area(light: AreaLight) -> float:
    """Emitting area in m²."""
    full = float(light.size[0] * light.size[1])
    return full if light.shape == "RECTANGLE" else full * np.pi / 4.0


def _area_radiance(light: AreaLight) -> NDArray[np.float64]:
    """Radiance of a one-sided Lambertian emitter of power P and area A: P / (pi A)."""
    return light.power * light.color / (np.pi * area(light))
