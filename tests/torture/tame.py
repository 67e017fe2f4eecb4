"""Scenes whose derivatives can be compared with differences: ordinary sizes, nothing degenerate, one parameter each.

Every surface shader meets every kind of parameter; the pair is drawn first, and a scene is made that has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import (
    AreaLight,
    Bounces,
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
from edgegrad.scene.bounces import UNLIMITED
from edgegrad.scene.light import Light
from tests.support import shapes as solids
from tests.support.fields.splines import exact_sphere, points, sampled, torus
from tests.support.rich_scene import pose, turn
from tests.torture.drawing.additions import negative
from tests.torture.drawing.draw import Draw

F64 = NDArray[np.float64]
# The parameter's value and its rate at theta.
Curve = Callable[[float], tuple[Any, Any]]

# Shaders by name: fields that are set, and those that it reads besides its colour.
SHADERS: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "DIFFUSE": ({"kind": "DIFFUSE"}, ("diffuse_roughness",)),
    "GLOSSY": ({"kind": "GLOSSY"}, ("roughness", "anisotropy")),
    "mirror": ({"kind": "GLOSSY", "roughness": 0.0}, ()),
    "GLASS": ({"kind": "GLASS"}, ("roughness", "ior")),
    "clear glass": ({"kind": "GLASS", "roughness": 0.0}, ("ior",)),
    "REFRACTION": ({"kind": "REFRACTION"}, ("roughness", "ior")),
    "TRANSPARENT": ({"kind": "TRANSPARENT"}, ()),
    "TRANSLUCENT": ({"kind": "TRANSLUCENT"}, ()),
    "SHEEN": ({"kind": "SHEEN"}, ("roughness",)),
    "DISNEY": ({"kind": "DISNEY", "specular_ior_level": 0.5, "metallic": 0.4}, ("roughness", "metallic")),
    "PRINCIPLED dielectric": ({"specular_ior_level": 0.5}, ("roughness", "ior", "specular_ior_level")),
    "PRINCIPLED metal": ({"metallic": 0.9}, ("roughness", "metallic", "specular_tint", "anisotropy")),
    "PRINCIPLED transmission": ({"transmission": 0.8, "specular_ior_level": 0.5}, ("roughness", "ior", "transmission")),
    "PRINCIPLED coat": ({"coat_weight": 0.7, "coat_roughness": 0.3},
                        ("coat_weight", "coat_roughness", "coat_ior", "coat_tint")),
    "PRINCIPLED film": ({"specular_ior_level": 0.5, "metallic": 0.3, "thin_film_thickness": 350.0},
                        ("thin_film_thickness", "thin_film_ior")),
    "film on glass": ({"kind": "GLASS", "thin_film_thickness": 350.0}, ("thin_film_thickness", "thin_film_ior")),
    "PRINCIPLED sheen": ({"sheen_weight": 0.6}, ("sheen_weight", "sheen_roughness", "sheen_tint")),
    "PRINCIPLED alpha": ({"alpha": 0.6}, ("alpha",)),
    "PRINCIPLED subsurface": ({"subsurface_weight": 0.5}, ("subsurface_weight",)),
    "emissive": ({"emission": np.array([1.0, 2.0, 3.0])}, ("emission",)),
    "mixture": ({}, ("weights",)),
}  # fmt: skip
PARAMETERS = ("color", "own", "texel", "uv", "vertices", "transform", "floor", "light strength", "light place",
              "light size", "light direction", "camera pose", "camera lens", "sky color", "sky rotation",
              "sky texel", "field values", "field transform", "field box", "field grid")  # fmt: skip
# Shaders have several parameters of their own, so that these come more often.
CYCLE = (*PARAMETERS, "own", "own", "own")
# Fields of materials by how far they may move to each side.
STEPS = {"ior": 0.03, "coat_ior": 0.05, "thin_film_ior": 0.05, "thin_film_thickness": 20.0}


# Parts of a derivative that plans name as left out of scenes with fields, and that the fields here do not have: they
# are clear of their boxes and of all meshes.
ABSENT = ("lines where meshes pass through the distance fields",)


@dataclass
class Comparison:
    """A scene and a curve of one parameter through it.

    Attributes
    ----------
    shader, parameter
        The pair that is looked at, in words.
    path
        The parameter.
    curve
        Its value and rate at theta in [-step, step].
    step
        Half the interval over which derivatives are averaged and differences taken.
    bounces
        Limits and filter of bounces.
    """

    scene: Scene
    path: str
    curve: Curve
    step: float
    max_depth: int
    shader: str
    parameter: str
    bounces: Bounces = UNLIMITED


def comparison(seed: int) -> Comparison:
    """The comparison of a seed; consecutive seeds go through all pairs of shader and parameter."""
    draw = Draw(seed)
    shader = tuple(SHADERS)[seed % len(SHADERS)]
    parameter = CYCLE[seed // len(SHADERS) % len(CYCLE)]
    light = drawn_light(draw, parameter)
    if Draw((seed, 2)).chance(0.1):  # it takes away what the world gives
        light = negative(light)
    scene = Scene(
        drawn_camera(draw, parameter), _meshes(draw, shader), _materials(draw, shader, parameter), {"lamp": light},
        drawn_world(draw, parameter), drawn_images(draw),
    )  # fmt: skip
    if parameter.startswith("field"):
        _put_field(draw, scene, shader)
    path = _path(draw, scene, shader, parameter)
    curve, step = curve_of(draw, scene, path)
    return Comparison(scene, path, curve, step, draw.one((2, 2, 3, 4)), shader, _words(path, parameter),
                      drawn_bounces(seed))


def drawn_bounces(seed: int) -> Bounces:
    return Bounces(filter_glossy=Draw((seed, 3)).one((0.0, 0.0, 1.0)))


def _words(path: str, parameter: str) -> str:
    """The kind of parameter; a shader's own field by its name."""
    return path.rpartition(".")[2] if parameter == "own" else parameter


# ---- What is in the scene ----
def _meshes(draw: Draw, shader: str) -> dict[str, Mesh]:
    # Light through two surfaces has heavy tails: of half of what lets light through a sheet is seen.
    clear = shader in ("GLASS", "REFRACTION", "TRANSLUCENT", "PRINCIPLED transmission")
    kind = draw.one(("sheet", "sheet", "ball", "cube") if clear else ("cube", "ball", "ball", "sheet"))
    vertices, faces = {"cube": lambda: solids.cube(1.1), "ball": lambda: solids.ball(1, 0.75),
                       "sheet": lambda: solids.sheet(3, 1.6)}[kind]()  # fmt: skip
    smooth = kind == "ball" and draw.chance(0.5)
    # It stands clear of the floor: nothing touches, so that estimates keep a variance.
    vertices = vertices @ turn(*draw.rng.normal(scale=0.5, size=3)).T + [0.1, 0.0, 0.5]
    corners = vertices[faces][..., :2]
    layers = {"UVMap": (0.4 * corners + 0.5).astype(np.float32)}
    floor, floor_faces = solids.sheet(2, 7.0)
    return {
        "body": Mesh(vertices, faces, ("body",), smoothing=faces.copy() if smooth else None, attributes=layers),
        "floor": Mesh(floor - [0.0, 0.0, 0.7], floor_faces, ("floor",)),
    }


def _put_field(draw: Draw, scene: Scene, shader: str) -> None:
    """Put a field in the place of the body; beside the body if its shader is not for fields."""
    # Its box is clear of all meshes.
    place = pose(0.55 * turn(*draw.rng.normal(scale=0.5, size=3)), 0.1, 0.0, 0.5)
    field: Field = draw.one((lambda: sampled(torus, 16), lambda: exact_sphere(0.75, 12)))()
    field.transform = place
    size = (*draw.rng.integers(1, 6, 3).tolist(), 3)
    field.attributes = {"paint": draw.rng.uniform(0.2, 0.8, size).astype(np.float32)}
    if shader == "emissive":
        field.material, field.transform[:3, 3] = "floor", [-1.8, 1.8, 0.6]
    else:
        field.material = "body"
        scene.meshes = {"floor": scene.meshes["floor"]}
        for one in scene.materials.values():
            if isinstance(one, Material):
                one.anisotropy = 0.0
    scene.fields = {"solid": field}


def _materials(draw: Draw, shader: str, parameter: str) -> dict[str, Material | Mixture]:
    fixed, _ = SHADERS[shader]
    ior = draw.one((1.08, 1.2, 1.4, 1.8, 0.75))
    made: dict[str, Any] = {
        "base_color": draw.rng.uniform(0.3, 0.8, 3), "roughness": draw.one((0.15, 0.3, 0.5, 0.8)), "ior": ior,
        "diffuse_roughness": draw.uniform(0.2, 0.8), "anisotropy": draw.one((0.0, 0.0, 0.5)),
        "specular_tint": draw.rng.uniform(0.3, 0.9, 3), "coat_tint": draw.rng.uniform(0.3, 0.9, 3),
    } | fixed  # fmt: skip
    if parameter == "field grid" or (parameter.startswith("field") and draw.chance(0.5)):
        made["textures"] = {"base_color": e.Attribute("paint", required=False)}  # 0 on a body beside the field
    if parameter in ("texel", "uv"):
        made["textures"] = {"base_color": e.ImageTexture("colors", e.Attribute("UVMap"))}
    if shader == "PRINCIPLED dielectric":
        made["ior"] = max(ior, 1.1)
    floor = Material(np.array([0.6, 0.5, 0.4]))
    if shader != "mixture":
        return {"body": Material(**made), "floor": floor}
    return {"one": Material(**made), "other": Material(draw.rng.uniform(0.3, 0.8, 3), kind="GLOSSY", roughness=0.4),
            "body": Mixture(("one", "other"), np.array([0.6, 0.5])), "floor": floor}  # fmt: skip


def drawn_light(draw: Draw, parameter: str) -> Light:
    at = np.array([draw.uniform(-1.5, 1.5), draw.uniform(-1.5, 1.5), draw.uniform(2.2, 3.2)])
    color, along = draw.rng.uniform(0.4, 1.0, 3), np.array([0.1, 0.0, 0.2]) - at
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
        "sun": lambda: SunLight(along, 3.0, draw.one((0.0, 0.1, 0.4)), color=color),
        "rectangle": lambda: AreaLight(facing, size, "RECTANGLE", 60.0, draw.one((np.pi, 1.5)), color=color),
        "ellipse": lambda: AreaLight(facing, size, "ELLIPSE", 60.0, color=color),
    }
    fitting = {"light size": ("sphere", "disk", "rectangle", "ellipse"), "light direction": ("spot", "sun"),
               "light place": ("point", "sphere", "disk", "spot", "rectangle", "ellipse")}  # fmt: skip
    return kinds[draw.one(fitting.get(parameter, tuple(kinds)))]()


def drawn_camera(draw: Draw, parameter: str) -> Camera:
    aim = turn(0.0, 0.0, draw.uniform(-np.pi, np.pi)) @ turn(draw.uniform(0.7, 1.3), 0.0, 0.0)
    extras: dict[str, Any] = {}
    if parameter == "camera lens" or draw.chance(0.1):
        extras = {"aperture_radius": 0.15, "focus_distance": draw.uniform(3.5, 6.0)}
    if draw.chance(0.1):
        extras |= {"kind": "ORTHOGRAPHIC", "ortho_width": 3.0}
    return Camera(pose(aim, *(aim @ [0.0, 0.0, 5.0])), 0.6, 12, 12, clip_start=1e-3, **extras)


def drawn_world(draw: Draw, parameter: str) -> World:
    image = "sky" if parameter in ("sky rotation", "sky texel") or draw.chance(0.3) else None
    return World(draw.rng.uniform(0.2, 0.5, 3), 1.0, image, turn(*draw.rng.normal(size=3)))


def drawn_images(draw: Draw) -> dict[str, Image]:
    return {"colors": Image(draw.rng.uniform(0.2, 0.8, (4, 4, 3)).astype(np.float32)),
            "sky": Image(draw.rng.uniform(0.2, 2.0, (4, 8, 3)).astype(np.float32))}  # fmt: skip


# ---- What moves ----
def lamp_paths(lamp: Light) -> dict[str, tuple[str, ...]]:
    """The paths of the light "lamp" by kind of parameter."""
    area = isinstance(lamp, AreaLight)
    return {"light place": ("lights.lamp.to_world" if area else "lights.lamp.position",),
            "light size": ("lights.lamp.size" if area else "lights.lamp.radius",),
            "light direction": ("lights.lamp.direction",)}  # fmt: skip


def _path(draw: Draw, scene: Scene, shader: str, parameter: str) -> str:
    body = "one" if shader == "mixture" else "body"
    lamp, own = scene.lights["lamp"], SHADERS[shader][1]
    choices: dict[str, tuple[str, ...]] = {
        "color": (f"materials.{body}.base_color",),
        "own": tuple(f"materials.body.{name}" for name in own) or (f"materials.{body}.base_color",),
        "texel": ("images.colors.pixels",), "uv": ("meshes.body.attributes.UVMap",),
        "vertices": ("meshes.body.vertices",), "transform": ("meshes.body.transform",),
        "floor": ("meshes.floor.vertices",),
        "light strength": ("lights.lamp.strength" if isinstance(lamp, SunLight) else "lights.lamp.power",
                           "lights.lamp.color"),
        **lamp_paths(lamp), "camera pose": ("camera.to_world",),
        "camera lens": ("camera.aperture_radius", "camera.focus_distance"), "sky color": ("world.color",),
        "field values": ("fields.solid.values",), "field transform": ("fields.solid.transform",),
        "field grid": ("fields.solid.attributes.paint",), "field box": ("fields.solid.lower", "fields.solid.upper"),
        "sky rotation": ("world.rotation",), "sky texel": ("images.sky.pixels",),
    }  # fmt: skip
    return draw.one(choices[parameter])


def curve_of(draw: Draw, scene: Scene, path: str) -> tuple[Curve, float]:
    """A curve of a parameter through its value, and how far to go along it."""
    value, field = parameters.get(scene, path), path.rpartition(".")[2]
    if field in ("to_world", "transform", "rotation"):
        return _rigid(draw, np.array(value, np.float64)), 0.04
    if field == "vertices":
        shift, bend = draw.rng.normal(size=3), draw.rng.normal(scale=0.3, size=(3, 3))
        rate = shift / np.linalg.norm(shift) + (value - value.mean(axis=0)) @ bend.T
        return _straight(value, rate), 0.04
    array = np.asarray(value)
    if path.startswith("fields.") and field == "values":  # distances, which change evenly or by a tilt
        nx, ny, nz = array.shape
        return _straight(value, points((nx, ny, nz)) @ draw.rng.normal(size=3) + draw.rng.normal()), 0.04
    size = STEPS.get(field, 0.1 * float(np.abs(array).max()) or 0.1)
    rate = draw.rng.uniform(-1.0, 1.0, array.shape) if array.ndim else np.ones(())
    return _straight(value, rate), size


def _straight(value: Any, rate: F64) -> Curve:
    array = np.asarray(value)

    def at(theta: float) -> tuple[Any, Any]:
        return (array + theta * rate).astype(array.dtype), rate

    return at


def _rigid(draw: Draw, value: F64) -> Curve:
    """A turn about any axis, and a shift where the matrix has one."""
    axis, shift = draw.rng.normal(size=3), draw.rng.normal(size=3)
    axis, shift = axis / np.linalg.norm(axis), shift / np.linalg.norm(shift)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])

    def at(theta: float) -> tuple[Any, Any]:
        out, rate = value.copy(), np.zeros_like(value)
        out[:3, :3] = turn(*(theta * axis)) @ value[:3, :3]
        rate[:3, :3] = cross @ out[:3, :3]
        if value.shape[1] == 4:
            out[:3, 3] += theta * shift
            rate[:3, 3] = shift
        return out, rate

    return at
