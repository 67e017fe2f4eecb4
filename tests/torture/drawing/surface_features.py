"""Features of surfaces: several materials of one mesh, patterns, kinds of rays, colors of corners, uneven scale.

Each function changes the scene of a comparison and returns paths that may be requested instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from edgegrad import Material, Medium, Mesh, Mixture
from edgegrad import expression as e
from tests.support import shapes as solids
from tests.support.rich_scene import pose, turn
from tests.torture.drawing.draw import Draw
from tests.torture.tame import Comparison

Feature = Callable[[Draw, Comparison], Sequence[str] | None]


def body_material(made: Comparison) -> str:
    """The name of the material that is looked at."""
    return "one" if "one" in made.scene.materials else "body"


def surface(draw: Draw, made: Comparison) -> str:
    """A material of meshes alone: those of fields may neither glow nor have normal maps."""
    used = [field.material for field in made.scene.fields.values()]
    of_fields = {*used, *(part for name in used for part in _parts(made, name))}
    return draw.one(tuple(name for name in (body_material(made), "floor") if name not in of_fields))


def _parts(made: Comparison, name: str) -> tuple[str, ...]:
    one = made.scene.materials[name]
    return one.parts if isinstance(one, Mixture) else ()


def put(made: Comparison, collection: str, name: str, one: Any) -> None:
    """Add an object to the scene."""
    setattr(made.scene, collection, {**getattr(made.scene, collection), name: one})


def change(made: Comparison, name: str, textures: dict[str, e.Expression] | None = None, **fields: Any) -> None:
    """Change fields and textures of a material."""
    old = made.scene.materials[name]
    assert isinstance(old, Material)
    put(made, "materials", name, replace(old, textures={**old.textures, **(textures or {})}, **fields))


def _smoke(draw: Draw, made: Comparison) -> Sequence[str]:
    """A cube of smoke around the body, clear of the floor."""
    size = draw.log(0.05, 0.5)
    scattering, absorption = (tuple((size * draw.rng.uniform(0.5, 1.0, 3)).tolist()) for _ in range(2))
    smoke = Medium(scattering, absorption, draw.one((0.0, 0.4, -0.4)))
    vertices, faces = solids.cube(2.4)
    put(made, "materials", "smoke", Material(np.ones(3), kind="TRANSPARENT", medium=smoke))
    put(made, "meshes", "smoke", Mesh(vertices + [0.1, 0.0, 0.6], faces, ("smoke",)))
    return tuple(f"materials.smoke.medium.{field}" for field in ("scattering", "absorption", "anisotropy"))


def _second_material(draw: Draw, made: Comparison) -> Sequence[str]:
    """Half of the body's faces have another material: its borders are within the mesh."""
    body = made.scene.meshes.get("body")
    if body is None:
        return ()
    other = draw.one(
        (
            Material(np.array([0.2, 0.7, 0.4])),
            Material(np.array([0.9, 0.8, 0.7]), kind="GLOSSY", roughness=0.3),
            Material(np.array([0.9, 0.8, 0.7]), kind="GLOSSY", roughness=0.0),
            Material(np.array([0.2, 0.7, 0.4]), alpha=0.3),
            Material(np.array([0.3, 0.3, 0.3]), emission=np.array([0.5, 1.0, 2.0])),
        )
    )
    put(made, "materials", "second", other)
    body.materials = (*body.materials, "second")
    body.face_material = draw.rng.integers(0, 2, len(body.faces)).astype(np.int32)
    return ("materials.second.base_color",)


def _pattern(draw: Draw, made: Comparison) -> Sequence[str]:
    """A procedural texture over positions or over the smooth normal."""
    at = e.Coordinates(draw.one(("POSITION", "POSITION", "NORMAL", "REFLECTION")))
    pattern = draw.one(
        (
            e.Noise(at, scale=2.0, detail=1.0),
            e.Voronoi(at, scale=1.5, feature="SMOOTH_F1"),
            e.Wave(at, scale=0.6),
            e.Gradient(at, "SPHERICAL"),
            e.Magic(at, scale=1.0),
        )
    )
    field = draw.one(("base_color", "roughness", "alpha", "specular_ior_level"))
    name = surface(draw, made)
    value = e.MapRange(e.Luminance(pattern), 0.0, 1.0, 0.25, 0.75)
    change(made, name, {field: e.Combine(value, 0.4, value) if field == "base_color" else value})
    return (f"materials.{name}.textures.{field}",)


def _by_ray(draw: Draw, made: Comparison) -> None:
    """Another color for some kinds of rays, or for the back."""
    switch = draw.one(
        (
            e.LightPath("CAMERA"),
            e.LightPath("SHADOW"),
            e.LightPath("DIFFUSE"),
            e.LightPath("GLOSSY"),
            e.Backfacing(),
            e.Math("MINIMUM", e.Math("MULTIPLY", e.RayLength(), 0.2), 1.0),
        )
    )
    field = draw.one(("base_color", "alpha", "emission"))
    value = e.MapRange(switch, 0.0, 1.0, 0.2, 0.7)
    change(made, surface(draw, made), {field: value if field == "alpha" else e.Combine(value, value, 0.5)})


def _corner_colors(draw: Draw, made: Comparison) -> Sequence[str]:
    """Colors of corners that differ between faces, on the body or on the floor."""
    mesh, name = draw.one((("body", body_material(made)), ("floor", "floor")))
    if mesh not in made.scene.meshes:
        mesh, name = "floor", "floor"
    held = made.scene.meshes[mesh]
    colors = draw.rng.uniform(0.2, 0.8, (*held.faces.shape, 3)).astype(np.float32)
    held.attributes = {**held.attributes, "colors": colors}
    change(made, name, {"base_color": e.Attribute("colors", required=False)})
    return (f"meshes.{mesh}.attributes.colors",)


def _shape_of_facets(draw: Draw, made: Comparison) -> None:
    name = body_material(made)
    material = made.scene.materials[name]
    if isinstance(material, Material) and material.kind in ("PRINCIPLED", "GLOSSY", "GLASS", "REFRACTION"):
        kind = draw.one(("BECKMANN", "ASHIKHMIN_SHIRLEY") if material.kind == "GLOSSY" else ("BECKMANN",))
        if draw.chance(0.3) and material.kind != "REFRACTION":
            change(made, name, multiscatter=True)
        else:
            change(made, name, distribution=kind)


def _uneven(draw: Draw, made: Comparison) -> Sequence[str]:
    """A transform with uneven scale and shear on the body."""
    body = made.scene.meshes.get("body")
    if body is None:
        return ()
    scale = turn(*draw.rng.normal(size=3)) @ np.diag([draw.one((-1.0, 1.0)), 0.6, 1.3])
    body.transform = pose(scale, 0.05, 0.0, 0.1) @ body.transform
    return "meshes.body.transform", "meshes.body.vertices"


def _placed(draw: Draw, made: Comparison) -> Sequence[str]:
    """Copies of the body with values of their own."""
    body = made.scene.meshes.get("body")
    if body is None:
        return ()
    other = pose(0.5 * turn(*draw.rng.normal(size=3)), -1.2, 0.7, 0.4)
    body.instances = np.stack([np.eye(4), other])
    body.instance_attributes = {"own": draw.rng.uniform(0.2, 0.8, (2, 3)).astype(np.float32)}
    change(made, body_material(made), {"base_color": e.Attribute("own", required=False)})
    return "meshes.body.instances", "meshes.body.instance_attributes.own"


def _glow(draw: Draw, made: Comparison) -> Sequence[str]:
    """A small glowing mesh beside the body."""
    vertices, faces = draw.one((lambda: solids.cube(0.3), lambda: solids.ball(2, 0.25), lambda: solids.sheet(2, 0.5)))()
    put(made, "meshes", "glow", Mesh(vertices @ turn(0.4, 0.9, 0.0).T + [-1.0, -0.9, 1.1], faces, ("glow",)))
    put(made, "materials", "glow", Material(np.zeros(3), emission=np.array([8.0, 6.0, 3.0])))
    return "meshes.glow.vertices", "materials.glow.emission"


def _lens(draw: Draw, made: Comparison) -> None:
    """A ball of glass or a mirror between the camera and the body."""
    vertices, faces = solids.ball(2, 0.35)
    eye = made.scene.camera.to_world[:3, 3]
    place = 0.35 * eye + [0.3, 0.2, 0.45]
    put(made, "meshes", "lens", Mesh(vertices + place, faces, ("lens",), smoothing=faces.copy()))
    put(made, "materials", "lens", draw.one((Material(np.ones(3), kind="GLASS", roughness=0.0, ior=1.3),
                                             Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0))))  # fmt: skip


FEATURES: dict[str, Feature] = {
    "second material": _second_material,
    "pattern": _pattern,
    "by ray": _by_ray,
    "colors of corners": _corner_colors,
    "shape of facets": _shape_of_facets,
    "uneven scale": _uneven,
    "values of copies": _placed,
    "glow": _glow,
    "lens before": _lens,
    "smoke": _smoke,
}
