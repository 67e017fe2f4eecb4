"""Shadow boundaries against central differences: every kind of light, of motion, of occluder and of camera."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.rich_scene import pose, turn
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Floats, Make, along, box, camera, glowing, matte, rectangle

ABOVE = camera((0, 3.2, 2.4), (0, 0, 0.1), 24)
DOWN = turn(-0.5 * np.pi, 0, 0)  # what shines along -Z shines along -Y
TILTED = turn(0.0, 0.0, -0.35) @ DOWN


def at(rotation: Floats, place: Floats) -> Floats:
    """A pose."""
    return pose(rotation, *(float(x) for x in place))


HIGH = np.array([0.5, 2.2, -0.3])
DIM = edgegrad.World(np.array([0.05, 0.06, 0.08]), 1.0)
LIGHTS: dict[str, edgegrad.PointLight | edgegrad.SpotLight | edgegrad.SunLight | edgegrad.AreaLight] = {
    "point": edgegrad.PointLight(HIGH, 90.0),
    "sphere": edgegrad.PointLight(HIGH, 90.0, 0.3, True),
    "disk": edgegrad.PointLight(HIGH, 90.0, 0.3, False),
    "spot": edgegrad.SpotLight(HIGH, np.array([-0.25, -1.0, 0.1]), 90.0, 1.3, 0.5),
    "sized spot": edgegrad.SpotLight(HIGH, np.array([-0.25, -1.0, 0.1]), 90.0, 1.3, 0.5, 0.2),
    "rectangle": edgegrad.AreaLight(at(TILTED, HIGH), np.array([0.9, 0.5]), "RECTANGLE", 40.0),
    "spread": edgegrad.AreaLight(at(TILTED, HIGH), np.array([0.9, 0.5]), "RECTANGLE", 40.0, 1.6),
    "ellipse": edgegrad.AreaLight(at(TILTED, HIGH), np.array([0.9, 0.5]), "ELLIPSE", 40.0),
    "hard sun": edgegrad.SunLight(np.array([-0.3, -1.0, 0.2]), 3.0),
    "sun": edgegrad.SunLight(np.array([-0.3, -1.0, 0.2]), 3.0, 0.3),
}


def scene_under(light: str) -> edgegrad.Scene:
    """A box over a floor, lit by a light, an emissive mesh ("mesh"), or the sky ("sky", "sky image")."""
    scene = edgegrad.Scene(
        ABOVE,
        {
            "floor": rectangle((0, 0, 0), (0, 0, 3), (3, 0, 0), "floor"),
            "box": box((0.1, 0.7, 0.0), (0.35, 0.2, 0.3), "clay", 0.5),
        },
        {"floor": matte(), "clay": matte(0.7, 0.3, 0.2)},
    )
    if light == "mesh":
        vertices, faces = shapes.ball(1, 0.35)
        scene.meshes["lamp"] = edgegrad.Mesh(vertices + HIGH, faces, ("lamp",))
        scene.materials["lamp"] = glowing(15.0)
    elif light.startswith("sky"):
        scene.world = edgegrad.World(np.array([0.5, 0.6, 0.8]), 1.0)
        if light == "sky image":
            pixels = np.full((8, 16, 3), 0.2, np.float32)
            pixels[1, 3:5] = [9.0, 8.0, 6.0]
            pixels[2, 10] = [1.0, 3.0, 9.0]
            scene.images["sky"] = edgegrad.Image(pixels)
            scene.world = edgegrad.World(np.ones(3), 1.0, "sky", turn(0.1, 0.4, -0.3) @ turn(0.5 * np.pi, 0, 0))
    else:
        scene.lights["lamp"] = LIGHTS[light]
    return scene


def mesh_moves(make: Callable[[], edgegrad.Scene], name: str, rate: Floats) -> Make:
    """A mesh moves and stretches."""

    def moved(theta: float) -> edgegrad.Scene:
        scene = make()
        mesh = scene.meshes[name]
        center = mesh.vertices.mean(axis=0)
        mesh.vertices = mesh.vertices + theta * (np.asarray(rate) + 0.2 * (mesh.vertices - center)[:, [1, 2, 0]])
        return scene

    return moved


def box_moves(light: str) -> Make:
    return mesh_moves(lambda: scene_under(light), "box", np.array([1.0, 0.3, 0.2]))


def floor_moves(light: str) -> Make:
    return mesh_moves(lambda: scene_under(light), "floor", np.array([0.3, 0.8, -0.2]))


def light_changes(light: str, **rates: float | Floats) -> tuple[Make, list[str]]:
    """Numbers of the light grow; `turns` is the rotation vector of its pose, `moves` its translation."""

    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under(light)
        lamp = scene.lights["lamp"]
        change = {}
        for field, rate in rates.items():
            if field in ("turns", "moves"):
                continue
            change[field] = getattr(lamp, field) + theta * np.asarray(rate)
        if "turns" in rates or "moves" in rates:
            to_world = np.array(lamp.to_world)
            to_world[:3, :3] = turn(*(theta * np.asarray(rates.get("turns", np.zeros(3))))) @ to_world[:3, :3]
            to_world[:3, 3] += theta * np.asarray(rates.get("moves", np.zeros(3)))
            change["to_world"] = to_world
        scene.lights["lamp"] = replace(lamp, **{k: (float(v) if np.ndim(v) == 0 else v) for k, v in change.items()})
        return scene

    fields = [f for f in rates if f not in ("turns", "moves")]
    if set(rates) & {"turns", "moves"}:
        fields.append("to_world")
    return make, [f"lights.lamp.{field}" for field in fields]


def lamp_moves() -> Make:
    return mesh_moves(lambda: scene_under("mesh"), "lamp", np.array([1.0, -0.4, 0.3]))


def sky_turns() -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under("sky image")
        scene.world = replace(scene.world, rotation=scene.world.rotation @ turn(0.3 * theta, 0.5 * theta, -0.4 * theta))
        return scene

    return make


def camera_moves(light: str, view: edgegrad.Camera = ABOVE) -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under(light)
        to_world = np.array(view.to_world)
        to_world[:3, :3] = turn(0.2 * theta, 0.3 * theta, 0.1 * theta) @ to_world[:3, :3]
        to_world[:3, 3] += theta * np.array([0.5, -0.3, 0.4])
        scene.camera = replace(view, to_world=to_world)
        return scene

    return make


def seen_by(view: edgegrad.Camera, light: str) -> Make:
    def make(theta: float) -> edgegrad.Scene:
        scene = box_moves(light)(theta)
        scene.camera = view
        return scene

    return make


BOX, FLOOR, POSE = ["meshes.box.vertices"], ["meshes.floor.vertices"], ["camera.to_world"]
CASES: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}: box moves": (box_moves(light), BOX) for light in (*LIGHTS, "mesh", "sky", "sky image")},
    **{f"{light}: floor moves": (floor_moves(light), FLOOR) for light in (*LIGHTS, "mesh", "sky", "sky image")},
    **{f"{light}: camera moves": (camera_moves(light), POSE)
       for light in ("spot", "sphere", "disk", "rectangle", "sun", "sky")},
    **{f"{light}: light moves": light_changes(light, position=np.array([1.0, -0.4, 0.3]))
       for light in ("point", "sphere", "disk", "spot", "sized spot")},
    "sphere: light grows": light_changes("sphere", radius=0.6),
    "disk: light grows": light_changes("disk", radius=0.6),
    "sized spot: light turns": light_changes("sized spot", direction=np.array([0.5, 0.0, 0.6])),
    "rectangle: light moves and turns": light_changes("rectangle", moves=np.array([0.6, -0.4, 0.3]),
                                                      turns=np.array([0.4, 0.3, -0.2])),
    "ellipse: light moves and turns": light_changes("ellipse", moves=np.array([0.6, -0.4, 0.3]),
                                                    turns=np.array([0.4, 0.3, -0.2])),
    "rectangle: light grows": light_changes("rectangle", size=np.array([0.7, -0.3])),
    "spread: light moves and turns": light_changes("spread", moves=np.array([0.6, -0.4, 0.3]),
                                                   turns=np.array([0.4, 0.3, -0.2])),
    "hard sun: light turns": light_changes("hard sun", direction=np.array([0.7, 0.1, 0.5])),
    "sun: light turns": light_changes("sun", direction=np.array([0.7, 0.1, 0.5])),
    "sun: light grows": light_changes("sun", angle=1.0),
    "mesh: light moves": (lamp_moves(), ["meshes.lamp.vertices"]),
    "sky image: light turns": (sky_turns(), ["world.rotation"]),
    "lens: box moves": (seen_by(replace(ABOVE, aperture_radius=0.1, focus_distance=2.5), "sphere"), BOX),
    "orthographic: box moves": (seen_by(replace(ABOVE, kind="ORTHOGRAPHIC", ortho_width=2.4), "sphere"), BOX),
    "orthographic: camera moves": (camera_moves("sphere", replace(ABOVE, kind="ORTHOGRAPHIC", ortho_width=2.4)), POSE),
    "panorama: box moves": (
        seen_by(replace(camera((0.4, 1.2, 1.3), (0, 0.3, 0)), kind="EQUIRECTANGULAR", width=48), "sphere"), BOX),
    "wide filter and crop: box moves": (
        seen_by(replace(ABOVE, width=32, height=32, crop=(4, 3, 28, 27), filter="BLACKMAN_HARRIS", filter_width=3.0,
                        pixel_aspect=1.3), "sphere"), BOX),
}


# Each kind of light, of motion and of camera once in every run, the others in the slow ones.
QUICK = (
    "point: box moves", "disk: box moves", "sized spot: floor moves", "rectangle: box moves", "sun: box moves",
    "mesh: box moves", "sky image: box moves", "ellipse: floor moves", "hard sun: floor moves", "disk: camera moves",
    "spot: light moves", "disk: light moves", "disk: light grows", "rectangle: light moves and turns",
    "spread: light moves and turns", "sun: light turns", "sky image: light turns", "mesh: light moves",
    "lens: box moves", "orthographic: camera moves", "panorama: box moves", "wide filter and crop: box moves",
)
RUNS = slow_but(CASES, QUICK)


@pytest.mark.parametrize("name", RUNS)
def test_shadows_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]))


def test_turning_sky_is_met_by_rays_that_go_on() -> None:
    """Where a path may be scattered once more, its rays meet the sky as vertices of their own, and turn with it."""
    need_every_table()
    check_agreement(along(sky_turns(), ["world.rotation"]), max_depth=3)


# ---------------------------------------------------------------- what hides light, and from what
def instanced(theta: float) -> edgegrad.Scene:
    """Two copies of a box, one mirrored, over a floor that is an instance too."""
    scene = scene_under("rectangle")
    scene.meshes["box"].vertices = scene.meshes["box"].vertices - [0.1, 0.7, 0.0]
    scene.meshes["box"].instances = np.stack([
        at(turn(0.2, 0.5 + 0.5 * theta, 0.1), (0.4 + 0.8 * theta, 0.7, 0.2)),
        at(turn(0.1, 0.3, 0.5) @ np.diag([-0.8, 0.7, 1.1]), (-0.5, 0.6 - 0.7 * theta, 0.0)),
    ])
    scene.meshes["floor"].instances = at(turn(0.2 * theta, 0.0, 0.1 * theta), (0.0, 0.4 * theta, 0.0))[None]
    return scene


def stretched(theta: float) -> edgegrad.Scene:
    """The mesh that is placed changes, and with it all its copies."""
    scene = instanced(0.0)
    box_ = scene.meshes["box"]
    box_.vertices = box_.vertices * (1.0 + theta * np.array([0.5, -0.8, 0.3])) + theta * np.array([0.2, 0.4, -0.3])
    return scene


def linked(theta: float) -> edgegrad.Scene:
    """Two lights over two boxes: one lights the floor alone and is hidden by one box, one casts no shadow."""
    scene = scene_under("sphere")
    scene.meshes["other"] = box((-0.5, 0.5, 0.2), (0.2, 0.25, 0.2), "clay", 0.2)
    scene.lights["lamp"] = replace(LIGHTS["sphere"], receivers=("floor",), blockers=("box",))
    scene.lights["bare"] = edgegrad.PointLight(np.array([-0.8, 2.0, 0.3]), 40.0, casts_shadow=False)
    for name in ("box", "other"):
        scene.meshes[name].vertices = scene.meshes[name].vertices + theta * np.array([1.0, 0.3, 0.2])
    return scene


def veiled(theta: float) -> edgegrad.Scene:
    """A half-transparent box and a coloured pane under a light, over a floor seen through a veil."""
    scene = scene_under("sphere")
    scene.materials["clay"] = edgegrad.Material(np.array([0.7, 0.3, 0.2]), alpha=0.6)
    scene.materials["pane"] = edgegrad.Material(np.array([0.9, 0.5, 0.2]), kind="TRANSPARENT")
    scene.materials["veil"] = edgegrad.Material(np.array([0.3, 0.3, 0.4]), alpha=0.4)
    scene.meshes["pane"] = rectangle((-0.4, 0.9, 0.2), (0.3, 0.05, 0.0), (0.0, 0.1, 0.25), "pane")
    scene.meshes["veil"] = rectangle((0.2, 2.0, 1.8), (0.3, 0.0, 0.0), (0.0, 0.1, -0.3), "veil")
    for name, rate in (("box", [1.0, 0.3, 0.2]), ("pane", [-0.5, 0.4, 0.7])):
        scene.meshes[name].vertices = scene.meshes[name].vertices + theta * np.array(rate)
    return scene


def windowed(light: str) -> Make:
    """Of a box every second triangle lets light through, so that it changes on either side of edges that are none."""

    def moved(theta: float) -> edgegrad.Scene:
        scene = box_moves(light)(theta)
        scene.materials["pane"] = edgegrad.Material(np.array([0.7, 0.3, 0.2]), alpha=0.2)
        mesh = scene.meshes["box"]
        mesh.materials = ("clay", "pane")
        mesh.face_material = np.arange(len(mesh.faces), dtype=np.int32) % 2
        return scene

    return moved


def unseen(theta: float) -> edgegrad.Scene:
    """A box that only shadow rays meet, a card that they don't, and one that the camera doesn't see."""
    scene = box_moves("point")(theta)
    scene.meshes["box"].visible_to = frozenset(("shadow",))
    card = mesh_moves(lambda: edgegrad.Scene(
        ABOVE, {"card": rectangle((-0.4, 0.4, 0.0), (0.3, 0.0, 0.0), (0.0, 0.1, -0.3), "clay")}, scene.materials,
    ), "card", np.array([0.4, 0.5, -0.3]))(theta).meshes["card"]
    scene.meshes["card"] = replace(card, visible_to=frozenset(("camera", "diffuse")))
    return scene


def glossy(theta: float) -> edgegrad.Scene:
    """A rough mirror with a smooth-shaded bump as the floor, under a light that it lights through one lobe alone."""
    scene = box_moves("rectangle")(theta)
    scene.materials["floor"] = edgegrad.Material(np.array([0.3, 0.4, 0.5]), roughness=0.45, metallic=0.3,
                                                 specular_ior_level=0.5)
    scene.lights["lamp"] = replace(LIGHTS["rectangle"], visible_to=frozenset(("glossy",)))
    return scene


CARD = ["meshes.card.vertices", *BOX]
HIDING: dict[str, tuple[Make, list[str]]] = {
    "instances are placed": (instanced, ["meshes.box.instances", "meshes.floor.instances"]),
    "instances are stretched": (stretched, BOX),
    "linked lights": (linked, [*BOX, "meshes.other.vertices"]),
    "transparent occluders": (veiled, [*BOX, "meshes.pane.vertices"]),
    "windows under the sky": (windowed("sky"), BOX),
    "windows under the sky's image": (windowed("sky image"), BOX),
    "windows under a sphere": (windowed("sphere"), BOX),
    "meshes that some rays don't meet": (unseen, CARD),
    "glossy floor": (glossy, BOX),
}


@pytest.mark.parametrize("name", HIDING)
def test_what_hides_light_agrees_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*HIDING[name]))


def test_windows_draw_no_lines_on_the_floor() -> None:
    """Edges in a window's plane have no directions in it of their own: where it meets the floor nothing is special."""
    need_every_table()
    scene, tangent = along(*HIDING["windows under the sky"])(0.0)
    scene.camera = replace(scene.camera, width=72, height=72)
    renderer = Renderer(scene, engine="native")
    pictures = [renderer.render_forward(tangent, spp=256, seed=k, terms=("shadow",)) for k in range(4)]
    floor = np.mean(pictures, axis=0)[40:]
    assert 0.0 < np.abs(floor).max() < 12.0 * np.sqrt((floor**2).mean())  # 7; with such lines 23


# ---------------------------------------------------------------- reverse mode
DOT: dict[str, tuple[Make, list[str]]] = {
    **{name: CASES[name] for name in (
        "point: light moves", "disk: light moves", "rectangle: light moves and turns", "sun: light turns",
        "sky image: light turns", "mesh: box moves", "sky: floor moves", "lens: box moves",
        "orthographic: camera moves")},
    "instances are placed": HIDING["instances are placed"],
    "transparent occluders": HIDING["transparent occluders"],
}


@pytest.mark.parametrize("name", DOT)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*DOT[name], spp=32, terms=("shadow",))


def test_a_strength_alone_moves_no_shadow() -> None:
    need_every_table()
    renderer = Renderer(scene_under("rectangle"))
    image = renderer.render_forward({"lights.lamp.power": 1.0}, spp=4, terms=("primary", "shadow"))
    assert not image.any()
