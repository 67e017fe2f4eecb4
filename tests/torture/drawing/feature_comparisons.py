"""Plain scenes with some of what real scenes have besides, whose derivatives can be compared with differences.

Bent normals, values by textures, lights that only some rays or meshes see, mirrored copies, terminators, filters: each
changes what one estimator does, and all of them must still agree with the picture.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from edgegrad import AreaLight, Image, Material, Mesh, PointLight, SunLight
from edgegrad import expression as e
from edgegrad._check import RAYS
from tests.support import shapes as solids
from tests.support.rich_scene import pose, turn
from tests.torture.drawing import camera_features, light_features, surface_features
from tests.torture.drawing.draw import Draw
from tests.torture.drawing.surface_features import Feature, change, put, surface
from tests.torture.tame import ABSENT as TAME
from tests.torture.tame import Comparison, curve_of
from tests.torture.tame import comparison as plain

# Beginnings of the plan's sentences on parts that do not keep derivatives from being compared.
ABSENT = (*TAME, "seen in mirrors", "seen in lobes")
UV = e.Attribute("UVMap", required=False)  # fields have none


def comparison(seed: int) -> Comparison:
    """The comparison of a seed: that of a plain scene with one to three features."""
    made, draw = plain(seed), Draw((seed, 20))
    names = draw.rng.choice(sorted(FEATURES), draw.whole(1, 3), replace=False).tolist()
    paths: list[str] = []
    for name in names:
        paths += FEATURES[name](draw, made) or ()
    _request(draw, made, paths)
    made.shader = ", ".join([made.shader, *names])
    return made


def _image(made: Comparison, name: str, pixels: np.ndarray) -> e.Expression:
    put(made, "images", name, Image(np.clip(pixels, 0.0, 1.0).astype(np.float32)))
    return e.ImageTexture(name, UV)


def _with_uv(made: Comparison) -> None:
    """Give the floor a UV map, too."""
    floor = made.scene.meshes["floor"]
    uv = (0.3 * floor.vertices[floor.faces][..., :2] + 0.5).astype(np.float32)
    floor.attributes = {**floor.attributes, "UVMap": uv}


# ---- Materials ----
def _normal_map(draw: Draw, made: Comparison) -> None:
    pixels = np.ones((6, 6, 3))
    pixels[..., :2] = draw.rng.normal(0.5, draw.one((0.03, 0.1, 0.3)), (6, 6, 2))
    _with_uv(made)
    change(
        made,
        surface(draw, made),
        {"normal": _image(made, "bumps", pixels)},
        normal_strength=draw.one((0.5, 1.0)),
        normal_uv="UVMap",
    )


def _bump(draw: Draw, made: Comparison) -> None:
    height = _image(made, "heights", draw.rng.uniform(0.0, 1.0, (5, 5, 3)))
    _with_uv(made)
    bump = e.Bump(e.Channel(height, 0), draw.uniform(0.1, 0.5))
    key = draw.one(("normal", "smooth_normal"))
    change(
        made, surface(draw, made), {key: bump}, **({"normal_space": "WORLD"} if key == "normal" else {})
    )


def _textured_value(draw: Draw, made: Comparison) -> None:
    field, low, high = draw.one(
        (
            ("roughness", 0.2, 0.8),
            ("metallic", 0.0, 1.0),
            ("specular_ior_level", 0.0, 0.8),
            ("coat_weight", 0.1, 0.9),
            ("ior", 1.2, 1.7),
            ("alpha", 0.2, 0.9),
            ("transmission", 0.1, 0.9),
        )
    )
    _with_uv(made)
    texture = _image(made, "values", draw.rng.uniform(0.0, 1.0, (4, 4, 3)))
    change(made, surface(draw, made), {field: e.MapRange(e.Channel(texture, 1), 0.0, 1.0, low, high)})


def _emission(draw: Draw, made: Comparison) -> None:
    change(made, surface(draw, made), {"emission": _image(made, "glow", draw.rng.uniform(0.0, 1.0, (4, 4, 3)))})


def _facing(draw: Draw, made: Comparison) -> None:
    node = draw.one((e.LayerWeight("FACING", 0.4), e.Fresnel(1.4)))
    change(made, surface(draw, made), {"base_color": e.Combine(node, 0.4, 0.3)})


def _rainbow(draw: Draw, made: Comparison) -> None:
    """Colors of hues that leave [0, 1], where they jump."""
    _with_uv(made)
    hue = e.Math("MULTIPLY_ADD", e.Channel(UV, 0), draw.uniform(1.0, 3.0), draw.uniform(-1.0, 0.3))
    change(made, surface(draw, made), {"base_color": e.ColorModel(e.Combine(hue, 0.7, 0.8), "HSV", "RGB")})


def _absorption(draw: Draw, made: Comparison) -> None:
    for name in ("one", "other") if "one" in made.scene.materials else ("body",):
        change(made, name, absorption=np.array([0.3, 0.8, 0.1]))


# ---- Lights ----
def _some_rays(draw: Draw, made: Comparison) -> None:
    made.scene.lights["lamp"].visible_to = frozenset(
        draw.one((("diffuse",), ("glossy", "transmission"), ("camera", "diffuse")))
    )


def _linked(draw: Draw, made: Comparison) -> None:
    field = draw.one(("receivers", "blockers"))
    setattr(made.scene.lights["lamp"], field, (draw.one(tuple(made.scene.meshes)),))


def _no_shadow(draw: Draw, made: Comparison) -> None:
    made.scene.lights["lamp"].casts_shadow = False


def _decay(draw: Draw, made: Comparison) -> None:
    lamp = made.scene.lights["lamp"]
    if not isinstance(lamp, SunLight):
        lamp.decay, lamp.smooth = draw.one(("LINEAR", "CONSTANT", "QUADRATIC")), draw.one((0.0, 1.0))


def _light_bounces(draw: Draw, made: Comparison) -> None:
    made.scene.lights["lamp"].max_bounces = draw.one((0, 1))


def _second_lamp(draw: Draw, made: Comparison) -> None:
    lamp = draw.one(
        (
            PointLight(np.array([-2.0, 1.0, 1.5]), 60.0, 0.3),
            SunLight(np.array([0.5, -0.3, -1.0]), 1.0, 0.2),
            AreaLight(pose(turn(0.8, 0.3, 0.0), -0.5, -2.5, 2.0), np.array([0.8, 0.5]), "RECTANGLE", 40.0),
        )
    )
    put(made, "lights", "second", lamp)


# ---- Meshes ----
def _some_rays_hit(draw: Draw, made: Comparison) -> None:
    mesh = made.scene.meshes[draw.one(tuple(made.scene.meshes))]
    mesh.visible_to = frozenset(RAYS) - {draw.one(RAYS)}


def _copies(draw: Draw, made: Comparison) -> None:
    body = made.scene.meshes.get("body")
    if body is not None:
        mirror = pose(np.diag([-0.6, 0.6, 0.6]), 1.4, 0.9, 0.2)
        body.instances = np.stack([np.eye(4), mirror])


def _terminator(draw: Draw, made: Comparison) -> None:
    for mesh in made.scene.meshes.values():
        mesh.terminator_offset, mesh.terminator_shading = draw.one((0.0, 0.1)), draw.one((0.0, 0.3))


def _smooth(draw: Draw, made: Comparison) -> None:
    body = made.scene.meshes.get("body")
    if body is not None:
        body.smoothing = body.faces.copy()


def _custom_normals(draw: Draw, made: Comparison) -> None:
    body = made.scene.meshes.get("body")
    if body is not None:
        corner = body.vertices[body.faces]
        across, normals = (
            np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]),
            np.zeros_like(body.vertices),
        )
        for k in range(3):
            np.add.at(normals, body.faces[:, k], across / np.linalg.norm(across, axis=1)[:, None])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        body.smoothing, body.normals = body.faces.copy(), normals + draw.rng.normal(scale=0.1, size=normals.shape)


def _pane(draw: Draw, made: Comparison) -> None:
    """A veil of alpha, or rough glass, before the body."""
    vertices, faces = solids.sheet(2, 1.5)
    put(made, "meshes", "pane", Mesh(vertices @ turn(1.2, 0.4, 0.0).T + [0.4, -1.2, 0.9], faces, ("pane",)))
    material = draw.one(
        (Material(np.array([0.6, 0.7, 0.8]), alpha=0.4), Material(np.array([0.9, 0.8, 0.7]), kind="TRANSLUCENT"))
    )
    put(made, "materials", "pane", material)


# ---- The picture ----
def _filter(draw: Draw, made: Comparison) -> None:
    made.scene.camera.filter, made.scene.camera.filter_width = draw.one((("BLACKMAN_HARRIS", 1.5), ("GAUSSIAN", 2.0)))


def _limits(draw: Draw, made: Comparison) -> None:
    made.bounces = replace(
        made.bounces, diffuse=draw.one((0, 1, 4)), glossy=draw.one((0, 1, 4)), transmission=draw.one((1, 4))
    )


FEATURES: dict[str, Feature] = {
    **camera_features.FEATURES,
    **surface_features.FEATURES,
    **light_features.FEATURES,
    "normal map": _normal_map,
    "bump": _bump,
    "textured value": _textured_value,
    "textured emission": _emission,
    "facing": _facing,
    "rainbow": _rainbow,
    "absorption": _absorption,
    "light for some rays": _some_rays,
    "linked light": _linked,
    "light without shadow": _no_shadow,
    "decay": _decay,
    "limit of a light": _light_bounces,
    "second lamp": _second_lamp,
    "mesh for some rays": _some_rays_hit,
    "copies": _copies,
    "terminator": _terminator,
    "smooth": _smooth,
    "custom normals": _custom_normals,
    "pane": _pane,
    "filter": _filter,
    "limits of bounces": _limits,
}


def _request(draw: Draw, made: Comparison, paths: list[str]) -> None:
    """Sometimes request a parameter of a feature."""
    scene, own = made.scene, list(paths)
    own += [f"images.{name}.pixels" for name in ("bumps", "heights", "values", "glow") if name in scene.images]
    if "bumps" in scene.images:
        own += [
            f"materials.{name}.normal_strength"
            for name, one in scene.materials.items()
            if isinstance(one, Material) and "normal" in one.textures and one.normal_space == "TANGENT"
        ]
    body = scene.meshes.get("body")
    if body is not None and body.normals is not None:
        own.append("meshes.body.normals")
    if own and draw.chance(0.5):
        made.path = draw.one(tuple(own))
        made.parameter = made.path.rpartition(".")[2]
    made.curve, made.step = curve_of(draw, scene, made.path)
