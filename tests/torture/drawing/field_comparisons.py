"""Scenes of distance fields whose derivatives can be compared with differences: ordinary sizes, one parameter each.

Each kind of surroundings meets each kind of parameter. Shapes, materials, lights and cameras are drawn beside them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import (
    AreaLight,
    Camera,
    Field,
    Image,
    Material,
    Mesh,
    Mixture,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
    World,
)
from edgegrad import expression as e
from edgegrad.scene import parameters
from edgegrad.scene.light import Light
from tests.support import shapes as solids
from tests.support.fields.splines import exact_sphere, sampled, torus
from tests.support.rich_scene import pose, turn
from tests.torture.drawing.draw import Draw
from tests.torture.tame import ABSENT as TAME
from tests.torture.tame import Comparison, curve_of, lamp_paths

F64 = NDArray[np.float64]

# Beginnings of the plan's sentences on parts that do not keep derivatives from being compared.
ABSENT = (*TAME, "seen in mirrors", "seen in lobes")
# What is around the field.
SURROUNDINGS = ("nothing", "floor", "ball beside", "mirror below", "narrow lobes below", "pane before",
                "glass ball before", "field beside", "mesh across", "field across", "floor across", "lamp above",
                "mirror ball beside", "rough glass before", "clear sheet before")  # fmt: skip
PARAMETERS = ("values", "transform", "box", "grid", "light place", "light size", "light direction", "camera pose",
              "camera lens", "other", "material", "sky rotation")  # fmt: skip
SHAPES: dict[str, Callable[[Draw], Field]] = {
    "ball": lambda draw: exact_sphere(0.75, 12),
    "torus": lambda draw: sampled(torus, 16),
    "two balls": lambda draw: sampled(_two_balls, 20),
    "slab": lambda draw: sampled(lambda p: np.linalg.norm(p * [0.8, 1.0, 2.5], axis=-1) - 0.7, (14, 12, 18)),
    "bumps": lambda draw: sampled(
        lambda p: np.linalg.norm(p, axis=-1) - 0.65 - 0.08 * np.sin(5.0 * p).prod(axis=-1), 24),
    "shell": lambda draw: sampled(lambda p: np.abs(np.linalg.norm(p, axis=-1) - 0.6) - 0.12, 24),
}
MATERIALS: dict[str, dict[str, Any]] = {
    "matte": {}, "rough diffuse": {"kind": "DIFFUSE", "diffuse_roughness": 0.6},
    "metal": {"metallic": 1.0, "roughness": 0.35}, "plastic": {"specular_ior_level": 0.5, "roughness": 0.3},
    "coat": {"coat_weight": 0.8, "coat_roughness": 0.2}, "sheen": {"sheen_weight": 0.8},
    "narrow": {"kind": "GLOSSY", "roughness": 0.06}, "mirror": {"kind": "GLOSSY", "roughness": 0.0},
    "glass": {"kind": "GLASS", "roughness": 0.0, "ior": 1.3}, "rough glass": {"kind": "GLASS", "roughness": 0.35},
    "refraction": {"kind": "REFRACTION", "roughness": 0.3, "ior": 1.2}, "veil": {"alpha": 0.5},
    "transparent": {"kind": "TRANSPARENT"}, "translucent": {"kind": "TRANSLUCENT"}, "velvet": {"kind": "SHEEN"},
    "mixture": {},
}  # fmt: skip


def _two_balls(p: F64) -> F64:
    one, other = (np.linalg.norm(p - [x, 0.0, 0.1 * x], axis=-1) - 0.4 for x in (-0.38, 0.38))
    return np.asarray(-np.log(np.exp(-8.0 * one) + np.exp(-8.0 * other)) / 8.0)


def comparison(seed: int) -> Comparison:
    """The comparison of a seed; consecutive seeds go through all pairs of surroundings and parameter."""
    draw = Draw((seed, 5))
    around = SURROUNDINGS[seed % len(SURROUNDINGS)]
    parameter = PARAMETERS[(seed + seed // len(SURROUNDINGS)) % len(PARAMETERS)]
    material = draw.one(tuple(MATERIALS))
    scene = Scene(_camera(draw, parameter), {}, _materials(draw, material, parameter),
                  {"lamp": _light(draw, parameter)}, _world(draw, parameter), _images(draw),
                  {"solid": _field(draw, "body")})  # fmt: skip
    _surround(draw, scene, around)
    used = {name for one in scene.meshes.values() for name in one.materials} | {"body", "one", "two"}
    used |= {one.material for one in scene.fields.values()}
    scene.materials = {name: one for name, one in scene.materials.items() if name in used}
    path = _path(draw, scene, parameter)
    curve, step = curve_of(draw, scene, path)
    words = f"{material}, {around}, {type(scene.lights['lamp']).__name__}, {scene.camera.kind}"
    return Comparison(scene, path, curve, step, draw.one((2, 3, 4)), words, parameter)


# ---- What is in the scene ----
def _field(draw: Draw, material: str, size: float = 0.55, at: tuple[float, float, float] = (0.1, 0.0, 0.5)) -> Field:
    shape = SHAPES[draw.one(tuple(SHAPES))](draw)
    grid = (*draw.rng.integers(1, 6, 3).tolist(), 3)
    linear = turn(*draw.rng.normal(scale=0.7, size=3))
    if draw.chance(0.4):  # no rotation: it stretches and shears
        linear = linear + draw.rng.normal(scale=0.15, size=(3, 3))
    return replace(shape, material=material, transform=pose(size * linear, *at),
                   attributes={"paint": draw.rng.uniform(0.2, 0.8, grid).astype(np.float32)})


def _materials(draw: Draw, name: str, parameter: str) -> dict[str, Material | Mixture]:
    base: dict[str, Any] = {"base_color": draw.rng.uniform(0.4, 0.8, 3)} | MATERIALS[name]
    paint = e.Attribute("paint")
    textures: dict[str, e.Expression] = {}
    if parameter == "grid" or draw.chance(0.3):
        textures["base_color"] = paint
        if draw.chance(0.4) and base.get("roughness", 0.5) > 0.2:
            textures["roughness"] = e.Channel(paint, 1)
    floor = Material(np.array([0.6, 0.5, 0.4]))
    made: dict[str, Material | Mixture] = {
        "floor": floor, "cold": Material(np.array([0.3, 0.5, 0.7])),
        "glow": Material(np.zeros(3), np.array([6.0, 5.0, 4.0])),
        "mirror": Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0),
        "glossy": Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.06),
        "glass": Material(np.full(3, 0.95), kind="GLASS", roughness=0.0, ior=1.4),
        "rough glass": Material(np.full(3, 0.95), kind="GLASS", roughness=0.3, ior=1.2),
        "clear": Material(np.full(3, 0.6), kind="TRANSPARENT"),
    }  # fmt: skip
    if name == "mixture":
        return made | {"one": Material(**base, textures=textures),
                       "two": Material(draw.rng.uniform(0.3, 0.8, 3), kind="GLOSSY", roughness=0.4),
                       "body": Mixture(("one", "two"), np.array([0.6, 0.5]))}  # fmt: skip
    return made | {"body": Material(**base, textures=textures)}


def _mesh(arrays: solids.Arrays, material: str, at: tuple[float, float, float], rotation: F64 | None = None,
          smooth: bool = False) -> Mesh:
    vertices, faces = arrays
    vertices = (vertices if rotation is None else vertices @ rotation.T) + at
    return Mesh(vertices, faces, (material,), smoothing=faces.copy() if smooth else None)


def _surround(draw: Draw, scene: Scene, around: str) -> None:
    meshes: dict[str, Mesh] = {}
    view = scene.camera.to_world[:3, 2]
    before = tuple(np.array([0.1, 0.0, 0.5]) + 1.4 * view)
    facing = scene.camera.to_world[:3, :3] @ turn(*draw.rng.normal(scale=0.2, size=3))
    below = {"mirror below": "mirror", "narrow lobes below": "glossy"}.get(around, "floor")
    if around != "nothing":
        height = 0.35 if around == "floor across" else -0.35
        meshes["floor"] = _mesh(solids.sheet(2, 7.0), below, (0.0, 0.0, height))
    place = draw.rng.normal(size=2)
    beside = (*(np.array([0.1, 0.0]) + 1.3 * place / np.linalg.norm(place)), 0.35)
    thin = solids.cube(1.0)[0] * [1.6, 1.6, 0.15], solids.cube(1.0)[1]
    match around:
        case "ball beside":
            meshes["other"] = _mesh(solids.ball(2, 0.5), "cold", beside)
        case "mirror ball beside":
            meshes["other"] = _mesh(solids.ball(3, 0.6), "mirror", beside, smooth=draw.chance(0.5))
        case "pane before" | "rough glass before":
            meshes["other"] = _mesh(thin, "glass" if around == "pane before" else "rough glass", before, facing)
        case "clear sheet before":
            meshes["other"] = _mesh(solids.sheet(2, 0.7), "clear", before, facing)
        case "glass ball before":
            meshes["other"] = _mesh(solids.ball(2, 0.7), "glass", before, smooth=draw.chance(0.5))
        case "field beside":
            scene.fields = {**scene.fields, "other": _field(draw, "cold", 0.4, beside)}
        case "mesh across":
            meshes["other"] = _mesh(solids.ball(1, 0.5), "cold", (0.35, 0.2, 0.6), turn(*draw.rng.normal(size=3)))
        case "field across":
            scene.fields = {**scene.fields, "other": _field(draw, "cold", 0.45, (0.35, 0.2, 0.6))}
        case "lamp above":
            meshes["other"] = _mesh(solids.sheet(2, 0.8), "glow", (0.6, 0.5, 2.0), turn(np.pi, 0.0, 0.0))
    scene.meshes = meshes


def _light(draw: Draw, parameter: str) -> Light:
    at = np.array([draw.uniform(-1.5, 1.5), draw.uniform(-1.5, 1.5), draw.uniform(2.2, 3.2)])
    color, along = draw.rng.uniform(0.4, 1.0, 3), np.array([0.1, 0.0, 0.4]) - at
    back = -along / np.linalg.norm(along)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    facing = pose(np.stack([right, np.cross(back, right), back], axis=1), *at)
    size = draw.rng.uniform(0.4, 1.0, 2)
    kinds: dict[str, Callable[[], Light]] = {
        "point": lambda: PointLight(at, 120.0, color=color),
        "sphere": lambda: PointLight(at, 120.0, draw.uniform(0.1, 0.5), True, color=color),
        "disk": lambda: PointLight(at, 120.0, draw.uniform(0.1, 0.5), color=color),
        "spot": lambda: SpotLight(at, along, 200.0, draw.uniform(0.5, 1.2), draw.uniform(0.3, 0.9), color=color),
        "wide spot": lambda: SpotLight(at, along, 200.0, draw.uniform(0.5, 1.2), draw.uniform(0.3, 0.9),
                                       draw.uniform(0.1, 0.4), color=color),
        "sun": lambda: SunLight(along, 3.0, draw.one((0.0, 0.1, 0.4)), color=color),
        "rectangle": lambda: AreaLight(facing, size, "RECTANGLE", 60.0, draw.one((np.pi, 1.5)), color=color),
        "ellipse": lambda: AreaLight(facing, size, "ELLIPSE", 60.0, color=color),
    }
    fitting = {"light size": ("sphere", "disk", "wide spot", "rectangle", "ellipse"),
               "light direction": ("spot", "wide spot", "sun"),
               "light place": ("point", "sphere", "disk", "spot", "wide spot", "rectangle", "ellipse")}  # fmt: skip
    return kinds[draw.one(fitting.get(parameter, tuple(kinds)))]()


def _camera(draw: Draw, parameter: str) -> Camera:
    aim = turn(0.0, 0.0, draw.uniform(-np.pi, np.pi)) @ turn(draw.uniform(0.7, 1.3), 0.0, 0.0)
    extras: dict[str, Any] = {}
    if parameter == "camera lens" or draw.chance(0.1):
        extras = {"aperture_radius": 0.15, "focus_distance": draw.uniform(3.5, 6.0)}
    elif draw.chance(0.15):
        extras = {"kind": "ORTHOGRAPHIC", "ortho_width": 2.4}
    return Camera(pose(aim, *(aim @ [0.0, 0.0, 5.0] + [0.1, 0.0, 0.3])), 0.45, 18, 18, clip_start=1e-3, **extras)


def _world(draw: Draw, parameter: str) -> World:
    image = "sky" if parameter == "sky rotation" or draw.chance(0.3) else None
    return World(draw.rng.uniform(0.2, 0.5, 3), 1.0, image, turn(*draw.rng.normal(size=3)))


def _images(draw: Draw) -> dict[str, Image]:
    return {"sky": Image(draw.rng.uniform(0.2, 2.0, (4, 8, 3)).astype(np.float32))}


# ---- What moves ----
def _path(draw: Draw, scene: Scene, parameter: str) -> str:
    name = "one" if "one" in scene.materials else "body"
    body = scene.materials[name]
    assert isinstance(body, Material)
    # Those that may move to both sides
    own = [field for field in ("base_color", "roughness", "alpha", "coat_weight", "sheen_weight", "diffuse_roughness")
           if np.all((np.asarray(getattr(body, field)) > 0.05) & (np.asarray(getattr(body, field)) < 0.9))
           and field not in body.textures]
    others = [path for path in ("fields.other.transform", "fields.other.values", "meshes.other.vertices",
                                "meshes.floor.vertices") if path in parameters.paths(scene)]
    choices: dict[str, tuple[str, ...]] = {
        "values": ("fields.solid.values",), "transform": ("fields.solid.transform",),
        "box": ("fields.solid.lower", "fields.solid.upper"), "grid": ("fields.solid.attributes.paint",),
        **lamp_paths(scene.lights["lamp"]), "camera pose": ("camera.to_world",),
        "camera lens": ("camera.aperture_radius", "camera.focus_distance", "camera.fov_x"),
        "other": tuple(others) or ("fields.solid.transform",), "sky rotation": ("world.rotation",),
        "material": tuple(f"materials.{name}.{field}" for field in own) or ("fields.solid.attributes.paint",),
    }  # fmt: skip
    return draw.one(choices[parameter])
