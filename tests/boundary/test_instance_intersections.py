"""Instances that intersect other surfaces, each other and themselves, compared with central differences."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.rich_scene import pose, turn
from tests.support.scenes.intersecting_surfaces import folded
from tests.support.scenes.seen_lights import sheet_through as through_seen
from tests.support.scenes.sheets_through_lights import light_moves, sheet_through, sheet_through_board
from tests.support.scenes.sheets_through_round_lights import sheet_through as through_round
from tests.support.scenes.sheets_through_round_lights import veiled
from tests.support.small_scenes import Floats, Make, along, box, camera, matte, rectangle

VIEW = camera((0.3, 0.4, 3.0), (0, 0, 0), 32, 0.8)
MATERIALS = {"warm": matte(0.9, 0.5, 0.2), "cold": matte(0.2, 0.5, 0.9)}
# They light what faces them, and cast no shadow: all that jumps is seen by the camera.
LIGHTS = {
    "key": edgegrad.PointLight(np.array([1.5, 2.0, 2.5]), 900.0, casts_shadow=False),
    "fill": edgegrad.PointLight(np.array([-2.5, -0.5, 2.0]), 300.0, color=np.array([0.3, 0.6, 1.0]),
                                casts_shadow=False),
}


# ---------------------------------------------------------------- as the camera sees it
def placed(theta: float) -> Floats:
    """Three copies through each other, one of them mirrored, that move, turn and grow."""
    return np.stack([
        pose(turn(0.0, 0.3 + 0.5 * theta, 0.1) * (1.0 + 0.4 * theta), -0.25 + 0.3 * theta, 0.1, 0.0),
        pose(turn(-0.5, 0.2, 0.4) @ np.diag([-1.0, 1.2, 0.8]), 0.15, -0.05 + 0.6 * theta, 0.1),
        pose(turn(0.2, 0.0, 0.9 - 0.7 * theta) * 0.8, 0.3, -0.3, 0.3 - 0.5 * theta),
    ])


def boxes() -> edgegrad.Scene:
    """Copies of a box through each other and through a card."""
    copies = box((0.05, 0.0, 0.0), (0.4, 0.25, 0.3), "warm", 0.4)
    copies.instances = placed(0.0)
    card = rectangle((0.0, 0.05, 0.1), (0.9, 0.1, -0.2), (0.0, 0.7, -0.3), "cold")
    return edgegrad.Scene(deepcopy(VIEW), {"boxes": copies, "card": card}, deepcopy(MATERIALS), deepcopy(LIGHTS))


def copies_move(theta: float) -> edgegrad.Scene:
    scene = boxes()
    scene.meshes["boxes"].instances = placed(theta)
    return scene


def copies_stretch(theta: float) -> edgegrad.Scene:
    scene = boxes()
    mesh = scene.meshes["boxes"]
    mesh.vertices = mesh.vertices * (1.0 + theta * np.array([0.5, -0.8, 0.3])) + theta * np.array([0.2, 0.4, -0.3])
    return scene


def card_moves(theta: float) -> edgegrad.Scene:
    scene = boxes()
    mesh = scene.meshes["card"]
    mesh.vertices = mesh.vertices @ turn(0.3 * theta, 0.0, -0.2 * theta).T + theta * np.array([0.1, 0.2, 0.6])
    return scene


def camera_moves(theta: float) -> edgegrad.Scene:
    scene = boxes()
    to_world = VIEW.to_world.copy()
    to_world[:3, :3] = turn(0.0, 0.6 * theta, 0.0) @ to_world[:3, :3]
    to_world[:3, 3] += theta * np.array([0.7, 0.3, -0.5])
    scene.camera = replace(VIEW, to_world=to_world)
    return scene


def transform_moves(theta: float) -> edgegrad.Scene:
    scene = boxes()
    scene.meshes["boxes"].transform = pose(turn(0.2 * theta, 0.0, 0.4 * theta), 0.3 * theta, -0.2 * theta, 0.5 * theta)
    return scene


def folded_copies(theta: float) -> edgegrad.Scene:
    """Two copies, apart, of a mesh that passes through itself."""
    bands = folded(2.0 * theta).meshes["bands"]
    bands.materials = ("warm", "cold")
    bands.instances = np.stack([
        pose(turn(0.3, 0.2 + 0.5 * theta, 0.0) * 0.5, -0.45, 0.2 + 0.4 * theta, 0.0),
        pose(turn(0.0, -0.4, 0.3) @ np.diag([0.5, -0.6, 0.5]), 0.45, -0.2, 0.3 * theta),
    ])
    return edgegrad.Scene(deepcopy(VIEW), {"bands": bands}, deepcopy(MATERIALS), deepcopy(LIGHTS))


COPIES, MESH = ["meshes.boxes.instances"], ["meshes.boxes.vertices"]
SEEN: dict[str, tuple[Make, list[str]]] = {
    "copies move": (copies_move, COPIES),
    "their mesh stretches": (copies_stretch, MESH),
    "a card moves in them": (card_moves, ["meshes.card.vertices"]),
    "camera moves": (camera_moves, ["camera.to_world"]),
    "all are moved": (transform_moves, ["meshes.boxes.transform"]),
    "a mesh and itself": (folded_copies, ["meshes.bands.vertices", "meshes.bands.instances"]),
}


@pytest.mark.parametrize("name", SEEN)
def test_intersections_that_the_camera_sees_agree_with_central_differences(name: str) -> None:
    need_every_table()
    terms = ("interior", "primary")
    check_agreement(along(*SEEN[name]), reference_spp=1024, max_depth=2, terms=terms)


# ---------------------------------------------------------------- what copies hide of light
def as_copies(make: Callable[[], edgegrad.Scene], name: str) -> edgegrad.Scene:
    """The scene with a mesh in a space of its own, and placed by an instance where it was."""
    scene = make()
    place = pose(turn(0.3, -0.4, 0.2) @ np.diag([1.2, 0.9, -0.8]), 0.2, -0.1, 0.15)
    mesh = scene.meshes[name]
    mesh.vertices = (mesh.vertices - place[:3, 3]) @ np.linalg.inv(place[:3, :3]).T
    mesh.instances = place[None]
    return scene


def sheet_moves(make: Callable[[], edgegrad.Scene]) -> Make:
    """The sheet's instance moves and turns about the place where it passes through the lamp."""

    def moving(theta: float) -> edgegrad.Scene:
        scene = as_copies(make, "sheet")
        instances = scene.meshes["sheet"].instances
        assert instances is not None
        middle = instances[0, :3, :3] @ scene.meshes["sheet"].vertices.mean(axis=0) + instances[0, :3, 3]
        rotation = turn(0.1 * theta, 0.2 * theta, 0.25 * theta)
        by = pose(rotation, *(middle - rotation @ middle + theta * np.array([1.0, 0.2, 0.3])))
        scene.meshes["sheet"].instances = by @ instances
        return scene

    return moving


def sheet_stretches(make: Callable[[], edgegrad.Scene]) -> Make:
    def moving(theta: float) -> edgegrad.Scene:
        scene = as_copies(make, "sheet")
        mesh = scene.meshes["sheet"]
        around = mesh.vertices - mesh.vertices.mean(axis=0)
        mesh.vertices = mesh.vertices + theta * (np.array([0.8, 0.2, -0.4]) + 0.2 * around[:, [1, 2, 0]])
        return scene

    return moving


def lamp_moves(make: Callable[[], edgegrad.Scene]) -> Make:
    def moving(theta: float) -> edgegrad.Scene:
        scene = as_copies(make, "sheet")
        scene.meshes["lamp"].vertices = scene.meshes["lamp"].vertices + theta * np.array([0.6, 0.8, 0.3])
        return scene

    return moving


def light_of_copies_moves(theta: float) -> edgegrad.Scene:
    scene = as_copies(lambda: sheet_through("rectangle"), "sheet")
    scene.lights = light_moves("rectangle")(theta).lights
    return scene


def disk_of_copies_moves(theta: float) -> edgegrad.Scene:
    scene = as_copies(lambda: through_round("disk"), "sheet")
    light = scene.lights["lamp"]
    assert isinstance(light, edgegrad.PointLight)
    scene.lights["lamp"] = replace(light, position=light.position + theta * np.array([0.6, -0.4, 0.3]))
    return scene


def boards() -> edgegrad.Scene:
    """Sheet and board as two copies of one square."""
    scene = sheet_through_board()
    square = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "lamp")
    frames = [((0.1, 1.5, 0.0), (0.0, 0.1, -0.5), (-0.6, 0.15, 0.0)), ((0.15, 1.6, 0.0), (0.3, 1.0, 0.1), (0, 0, 2.5))]
    square.instances = np.stack([
        pose(np.stack([u, v, np.cross(u, v)], axis=1), *middle) for middle, u, v in frames  # type: ignore[misc]
    ])
    scene.meshes = {"floor": scene.meshes["floor"], "lamp": square}
    return scene


def boards_move(theta: float) -> edgegrad.Scene:
    scene = boards()
    instances = scene.meshes["lamp"].instances
    assert instances is not None
    lifted = pose(np.eye(3), 0.0, 0.3 * theta, 0.0)
    turned = pose(turn(0.1 * theta, 0.0, 0.2 * theta), 0.9 * theta, 0.2 * theta, 0.3 * theta)
    scene.meshes["lamp"].instances = np.stack([lifted @ instances[0], turned @ instances[1]])
    return scene


def cross_moves(theta: float) -> edgegrad.Scene:
    """Two upright copies of a square through each other and through the floor, which both light in fixed directions."""
    square = rectangle((0, 0, 0), (0, 1.0, 0), (0.8, 0, 0), "board")
    upright = pose(np.diag([1.4, 1.0, 0.7]), 0.0, 0.3, 0.0)
    square.instances = np.stack([
        pose(turn(0.0, 0.5 + 0.3 * theta, 0.0), 0.4 * theta, 0.0, 0.1) @ upright,
        pose(turn(0.0, -0.9, 0.1 + 0.2 * theta), 0.1, 0.2 * theta, -0.5 * theta) @ upright,
    ])
    key = edgegrad.PointLight(np.array([0.5, 2.0, 2.5]), 300.0, casts_shadow=False, receivers=("boards",))
    return edgegrad.Scene(
        camera((0, 2.6, 3.0), (0, 0, 0.1), 24, 0.6),
        {"floor": rectangle((0, 0, 0), (0, 0, 4), (4, 0, 0), "floor"), "boards": square},
        {"floor": matte(0.6, 0.7, 0.5), "board": matte(0.9, 0.5, 0.3)}, {"key": key},
    )


PLACES, VERTICES = ["meshes.sheet.instances"], ["meshes.sheet.vertices"]
HIDDEN: dict[str, tuple[Make, list[str]]] = {
    "mesh: copy moves": (sheet_moves(lambda: sheet_through("mesh")), PLACES),
    "mesh: copy stretches": (sheet_stretches(lambda: sheet_through("mesh")), VERTICES),
    "mesh: light moves": (lamp_moves(lambda: sheet_through("mesh")), ["meshes.lamp.vertices"]),
    "rectangle: copy moves": (sheet_moves(lambda: sheet_through("rectangle")), PLACES),
    "ellipse: copy stretches": (sheet_stretches(lambda: sheet_through("ellipse")), VERTICES),
    "rectangle: light moves": (light_of_copies_moves, ["lights.lamp.to_world"]),
    "sphere: copy moves": (sheet_moves(lambda: through_round("sphere")), PLACES),
    "sphere: copy stretches": (sheet_stretches(lambda: through_round("sphere")), VERTICES),
    "disk: copy moves": (sheet_moves(lambda: through_round("disk")), PLACES),
    "disk: copy stretches": (sheet_stretches(lambda: through_round("disk")), VERTICES),
    "disk: light moves": (disk_of_copies_moves, ["lights.lamp.position"]),
    "sphere: veil of copies moves": (sheet_moves(lambda: veiled("sphere")), PLACES),
}
SEEN_LIGHTS: dict[str, tuple[Make, list[str]]] = {
    **{f"{light}: copy moves": (sheet_moves(lambda light=light: through_seen(light, "perspective")), PLACES)
       for light in ("rectangle", "ellipse", "sphere", "disk")},
    **{f"{light}: copy stretches": (sheet_stretches(lambda light=light: through_seen(light, "lens")), VERTICES)
       for light in ("rectangle", "sphere", "disk")},
    "disk: veil of copies moves": (sheet_moves(lambda: through_seen("disk", "perspective", 0.6)), PLACES),
}
DEEP: dict[str, tuple[Make, list[str]]] = {
    "copy moves in a board": (sheet_moves(sheet_through_board), PLACES),
    "copies of one mesh": (boards_move, ["meshes.lamp.instances"]),
    "copies across, on a floor": (cross_moves, ["meshes.boards.instances"]),
}


@pytest.mark.parametrize("name", HIDDEN)
def test_what_copies_hide_of_lights_agrees_with_central_differences(name: str) -> None:
    need_every_table()
    # On the sheet itself the light of a rectangle or an ellipse jumps, with samples of no finite variance
    # (derivations, F2): their noise is another one for other seeds.
    check_agreement(along(*HIDDEN[name]), spp=128)


@pytest.mark.parametrize("name", DEEP)
def test_what_copies_hide_of_surfaces_agrees_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*DEEP[name]), spp=128, max_depth=3)


# ---------------------------------------------------------------- lights that the camera sees
@pytest.mark.parametrize("name", SEEN_LIGHTS)
def test_what_copies_hide_of_lights_in_the_picture_agrees_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*SEEN_LIGHTS[name]), spp=256, reference_spp=2048)


@pytest.mark.parametrize("lamp", ["sphere", "disk"])
def test_plan_names_lights_that_copies_pass_through(lamp: str) -> None:
    need_every_table()
    words = "besides edges: what sheet hide of the light 'lamp' where they pass through it"
    scene = as_copies(lambda: through_round(lamp), "sheet")
    shadow = {term.name: term for term in edgegrad.plan(scene, PLACES).terms}["shadow"]
    assert words in shadow.why
    seen = as_copies(lambda: through_seen(lamp, "perspective"), "sheet")
    primary = {term.name: term for term in edgegrad.plan(seen, PLACES).terms}["primary"]
    assert "besides edges: the lines where sheet pass through the light 'lamp'" in primary.why
    # No copy comes near, though the mesh in its own space does.
    sheet = scene.meshes["sheet"]
    assert sheet.instances is not None
    sheet.vertices = through_round(lamp).meshes["sheet"].vertices
    sheet.instances = pose(np.eye(3), 5.0, 0.0, 0.0)[None]
    shadow = {term.name: term for term in edgegrad.plan(scene, PLACES).terms}["shadow"]
    assert words not in shadow.why


# ---------------------------------------------------------------- reverse mode
@pytest.mark.parametrize("name", SEEN_LIGHTS)
def test_reverse_mode_is_the_transpose_of_seen_lights(name: str) -> None:
    need_every_table()
    check_transpose(*SEEN_LIGHTS[name], spp=16, terms=("primary",))


@pytest.mark.parametrize("name", [*SEEN, *HIDDEN, *DEEP])
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    terms = ("primary",) if name in SEEN else ("shadow", "indirect")
    check_transpose(*{**SEEN, **HIDDEN, **DEEP}[name], spp=16, terms=terms, max_depth=4)


def test_intersections_are_found_anew_where_copies_have_moved_or_are_asked_for() -> None:
    """The caches of a renderer after several calls equal those of a new one."""
    need_every_table()
    scene = boxes()
    scene.meshes["other"] = rectangle((0.9, 0.8, -0.5), (0.2, 0.0, 0.1), (0.0, 0.2, 0.0), "veil")
    # With a transparent material there are no fixed directions, whose search for intersections would find all.
    scene.materials = {**MATERIALS, "veil": edgegrad.Material(alpha=0.5)}
    instances = scene.meshes["boxes"].instances
    assert instances is not None
    other = {"meshes.other.vertices": np.ones((4, 3))}
    both = {**other, "meshes.boxes.instances": np.random.default_rng(2).normal(size=instances.shape)}
    both["meshes.boxes.instances"][:, 3] = 0.0

    def picture(renderer: edgegrad.Renderer) -> Floats:
        return renderer.render_forward(both, spp=8, terms=("primary",)).astype(np.float64)

    renderer = edgegrad.Renderer(scene)
    renderer.render_forward(other, spp=8, terms=("primary",))
    np.testing.assert_array_equal(picture(renderer), picture(edgegrad.Renderer(scene)))
    mesh = scene.meshes["boxes"]
    mesh.instances = placed(0.3)
    renderer.update(["meshes.boxes.instances"])
    np.testing.assert_array_equal(picture(renderer), picture(edgegrad.Renderer(scene)))
    scene.camera = camera_moves(0.2).camera
    renderer.update(["camera.to_world"])
    np.testing.assert_array_equal(picture(renderer), picture(edgegrad.Renderer(scene)))
    mesh.vertices = 0.8 * mesh.vertices
    renderer.update(["meshes.boxes.vertices"])
    np.testing.assert_array_equal(picture(renderer), picture(edgegrad.Renderer(scene)))


def test_bits_are_equal_for_any_number_of_threads() -> None:
    need_every_table()
    check_equal_bits(copies_move, [*COPIES, *MESH], spp=4)
