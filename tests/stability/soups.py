"""Random scenes: triangles in any arrangement, materials, lights and cameras of every kind.

A scene is drawn by Hypothesis as a few choices and a seed, so that a scene which fails is shrunk to a simple one. What
scenes of users have and what makes numbers break is in them: needles, faces without area, faces twice and back to back,
nearly coplanar ones, fans on one edge, surfaces through and upon each other; lights that touch surfaces and shine along
them; cameras inside of the soup.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from edgegrad import (
    AreaLight,
    Camera,
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
from edgegrad.scene.material import KINDS
from tests.support.rich_scene import pose, turn
from tests.support.table_values import WITHOUT

F64 = NDArray[np.float64]
# How a triangle comes about from those before it.
FACES = ("plain", "plain", "plain", "needle", "sliver", "duplicate", "back to back", "fan", "lifted", "point", "line",
         "behind the camera")  # fmt: skip
SURFACES = ("flat", "smooth", "custom", "some corners")
LIGHTS = ("point", "sphere", "disk", "touching", "spot", "soft spot", "sun", "sun's disk", "rectangle", "ellipse",
          "grazing")  # fmt: skip
WORLDS = ("black", "constant", "image")
CAMERAS = ("pinhole", "lens", "blades", "orthographic", "panorama", "crop and filter", "inside")
MATERIALS = (*KINDS, "principled", "mirror", "clear glass", "rough glass", "cut-out", "textured", "bumpy", "mixture",
             "emissive", "black")  # fmt: skip
LAYERS = {"UVMap": 2, "color": 3}
NEEDLE, LIFT = 1e-6, 1e-6


def triangles(rng: np.random.Generator, kinds: list[str], scale: float) -> F64:
    """(n, 3, 3) corners in a cube of the size `scale`."""
    out: list[F64] = []
    for kind in kinds:
        t = rng.uniform(-1.0, 1.0, (3, 3))
        last = out[-1] if out else t
        if kind == "needle":
            t[2] = t[1] + NEEDLE * rng.normal(size=3)
        elif kind == "sliver":  # of no height
            t[2] = 0.5 * (t[0] + t[1]) + NEEDLE * rng.normal(size=3)
        elif kind == "duplicate":
            t = last.copy()
        elif kind == "back to back":
            t = last[::-1].copy()
        elif kind == "fan":
            t[:2] = last[:2]
        elif kind == "lifted":
            t = last + LIFT * rng.normal(size=3)
        elif kind == "point":
            t[1:] = t[0]
        elif kind == "line":
            t[2] = t[0] + 0.25 * (t[1] - t[0])
        elif kind == "behind the camera":
            t[0] = [0.1, -9.0, 0.2]
        out.append(t)
    return scale * np.array(out)


def mesh(rng: np.random.Generator, kinds: list[str], surface: str, copies: int, materials: tuple[str, ...],
         scale: float) -> Mesh:  # fmt: skip
    """A mesh with vertices of their own for every corner, instanced if `copies` is not 0."""
    corners = triangles(rng, kinds, scale)
    count = len(corners)
    faces = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    places = [pose(turn(*rng.normal(size=3)) * rng.choice([0.5, -0.7, 1.2]), *(scale * rng.normal(size=3)))
              for _ in range(copies)]  # fmt: skip
    smoothing = None if surface == "flat" else faces % max(3, count)
    if surface == "some corners":
        smoothing = np.where(rng.random(faces.shape) < 0.5, faces, -1).astype(np.int32)
    return Mesh(
        corners.reshape(-1, 3), faces, materials, rng.integers(0, len(materials), count).astype(np.int32),
        smoothing=smoothing, normals=rng.normal(size=(3 * count, 3)) if surface == "custom" else None,
        attributes={name: rng.uniform(-0.5, 1.5, (count, 3, n)).astype(np.float32) for name, n in LAYERS.items()},
        instances=np.array(places) if copies else None,
    )  # fmt: skip


def material(rng: np.random.Generator, kind: str) -> Material:
    """A material of the kind; shares are 0 or 1 as often as between."""
    share = lambda: float(rng.choice([0.0, 1.0, rng.random()]))  # noqa: E731
    color = lambda: rng.choice([0.0, 1.0, rng.random()]) * rng.random(3)  # noqa: E731
    uv = e.Attribute("UVMap")
    if kind == "principled":
        return Material(
            color(), metallic=share(), roughness=share(), diffuse_roughness=share(), specular_ior_level=share(),
            specular_tint=color(), ior=rng.choice([1.0, 1.33, 1.5, 2.4, 0.8]), anisotropy=rng.uniform(-1, 1),
            anisotropy_rotation=share(), transmission=share(), coat_weight=share(), coat_roughness=share(),
            coat_ior=rng.choice([1.0, 1.5]), coat_tint=color(), sheen_weight=share(), sheen_roughness=share(),
            sheen_tint=color(), alpha=share(), subsurface_weight=share(), emission=color(),
        )
    if kind == "mirror":
        return Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0)
    if kind in ("clear glass", "rough glass"):
        return Material(np.full(3, 0.9), kind="GLASS", ior=1.5, roughness=0.0 if kind == "clear glass" else 0.3)
    if kind == "cut-out":
        how = str(rng.choice(["LINEAR", "CLOSEST", "CUBIC"]))
        return Material(color(), textures={"alpha": e.ImageTexture("mask", uv, interpolation=how)})
    if kind == "textured":
        return Material(textures={
            "base_color": e.Mix(e.Attribute("color"), e.ImageTexture("colors", uv), e.Attribute("color")),
            "roughness": e.Attribute("color"), "emission": e.ImageTexture("colors", uv),
        })  # fmt: skip
    if kind == "bumpy":
        return Material(color(), specular_ior_level=share(), textures={"normal": e.ImageTexture("colors", uv)})
    if kind == "emissive":
        return Material(color(), 10.0 ** rng.uniform(-3, 3) * rng.random(3), bool(rng.random() < 0.5))
    if kind == "black":
        return Material(np.zeros(3))
    return Material(color(), kind=kind, roughness=share(), ior=rng.choice([1.0, 1.5]), anisotropy=rng.uniform(-1, 1))


def light(rng: np.random.Generator, kind: str, scale: float, corner: F64) -> Light:
    """A light; "touching" ones stand on a corner of the soup, "grazing" ones shine along z = 0."""
    at, along = scale * rng.uniform(-3.0, 3.0, 3), rng.normal(size=3)
    power = scale**2 * 10.0 ** rng.uniform(0, 2)
    area = pose(turn(*rng.normal(size=3)), *at)
    size = scale * rng.uniform(0.1, 1.0, 2)
    makers: dict[str, Callable[[], Light]] = {
        "point": lambda: PointLight(at, power),
        "touching": lambda: PointLight(corner, power, scale * float(rng.choice([0.0, 0.1]))),
        "sphere": lambda: PointLight(at, power, 0.3 * scale, True),
        "disk": lambda: PointLight(at, power, 0.3 * scale),
        "spot": lambda: SpotLight(at, along, power, 0.9, float(rng.choice([0.0, 0.5, 1.0]))),
        "soft spot": lambda: SpotLight(at, along, power, 1.5, 0.3, 0.2 * scale),
        "sun": lambda: SunLight(along, 2.0),
        "sun's disk": lambda: SunLight(along, 2.0, 0.2),
        "rectangle": lambda: AreaLight(area, size, "RECTANGLE", power, float(rng.choice([1.0, np.pi]))),
        "ellipse": lambda: AreaLight(area, size, "ELLIPSE", power),
        "grazing": lambda: SunLight(np.array([1.0, 0.3, 0.0]), 2.0),
    }
    return makers[kind]()


def camera(rng: np.random.Generator, kind: str, scale: float) -> Camera:
    """A camera in front of the soup, which looks along +Y; "inside": in its midst."""
    to_world = pose(turn(0.5 * np.pi, 0.0, 0.0) @ turn(*(0.1 * rng.normal(size=3))), 0.0, -4.0 * scale, 0.0)
    if kind == "inside":
        to_world[:3, 3] = scale * rng.uniform(-0.5, 0.5, 3)
    kinds: dict[str, dict[str, Any]] = {
        "lens": {"aperture_radius": 0.1 * scale, "focus_distance": 4.0 * scale},
        "blades": {"aperture_radius": 0.2 * scale, "focus_distance": 3.0 * scale, "aperture_blades": 5,
                   "aperture_ratio": 1.5},
        "orthographic": {"kind": "ORTHOGRAPHIC", "ortho_width": 3.0 * scale},
        "panorama": {"kind": "EQUIRECTANGULAR"},
        "crop and filter": {"crop": (2, 1, 8, 5), "filter": "BLACKMAN_HARRIS", "filter_width": 3.0},
    }  # fmt: skip
    return Camera(to_world, 0.8, 10, 8, clip_start=1e-3 * scale, clip_end=1e5 * scale, **kinds.get(kind, {}))


def shifted(scene: Scene, by: F64) -> Scene:
    """The scene with its lights and its camera elsewhere."""
    for m in scene.meshes.values():
        if m.instances is None:
            m.vertices = m.vertices + by
        else:
            m.instances[:, :3, 3] += by
    for lamp in scene.lights.values():
        if isinstance(lamp, AreaLight):
            lamp.to_world[:3, 3] += by
        elif isinstance(lamp, (PointLight, SpotLight)):
            lamp.position = lamp.position + by
    scene.camera.to_world[:3, 3] += by
    return scene


@st.composite
def soups(draw: st.DrawFn) -> Scene:
    """Any scene."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    scale = draw(st.sampled_from([1.0, 1.0, 1.0, 1e-3, 1e4]))
    some = lambda words, low, high: st.lists(st.sampled_from(words), min_size=low, max_size=high)  # noqa: E731
    kinds = draw(some(MATERIALS, 1, 3))
    materials: dict[str, Material | Mixture] = {
        f"{kind} {k}": material(rng, "DIFFUSE" if kind == "mixture" else kind) for k, kind in enumerate(kinds)
    }
    names = tuple(materials)
    if "mixture" in kinds:
        materials["mixed"] = Mixture(names, rng.random(len(names)), {"0": e.Attribute("color")})
        names = (*names, "mixed")
    meshes = {}
    for k in range(draw(st.integers(1, 3))):
        surface, copies = draw(st.sampled_from(SURFACES)), draw(st.sampled_from([0, 0, 1, 3]))
        meshes[f"soup {k}"] = mesh(rng, draw(some(FACES, 1, 8)), surface, copies, names, scale)
    corner = meshes["soup 0"].vertices[0]
    lights = {f"{kind} {k}": light(rng, kind, scale, corner) for k, kind in enumerate(draw(some(LIGHTS, 1, 3)))}
    world = draw(st.sampled_from(WORLDS))
    scene = Scene(
        camera(rng, draw(st.sampled_from(CAMERAS)), scale), meshes, materials, lights,
        World(np.full(3, 0.0 if world == "black" else 0.5), image="sky" if world == "image" else None),
        {
            "colors": Image(rng.uniform(0.0, 1.0, (3, 4, 3)).astype(np.float32)),
            "mask": Image(np.repeat(rng.integers(0, 2, (4, 4, 1)), 3, axis=2).astype(np.float32)),
            "sky": Image(rng.uniform(0.0, 5.0, (4, 8, 3)).astype(np.float32)),
        },
    )  # fmt: skip
    return shifted(scene, np.full(3, draw(st.sampled_from([0.0, 0.0, 1e5])) * min(scale, 1.0)))


def paths_of(scene: Scene) -> list[str]:
    """Every parameter that has a derivative."""
    return [path for path in parameters.paths(scene) if not path.endswith(WITHOUT)]
