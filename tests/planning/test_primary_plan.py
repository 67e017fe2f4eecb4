"""Skipped parts of the primary boundary term are exactly zero, and computed parts are not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from edgegrad import AreaLight, Camera, Material, Mesh, Renderer, Scene, SunLight, World, plan
from edgegrad.expression import Attribute, Channel, ColorModel, Combine, ImageTexture, Math, Noise
from edgegrad.planning.term import Term
from edgegrad.scene import parameters
from edgegrad.scene.image import Image
from tests.support import shapes
from tests.support.rich_scene import turn
from tests.support.small_scenes import box, camera, glowing, need, rectangle

VERTICES = "meshes.object.vertices"
POSE = "camera.to_world"


def rules(scene: Scene, wrt: Sequence[str]) -> Term:
    """The primary term of the plan."""
    return plan(scene, wrt).terms[1]


def largest(scene: Scene, wrt: Sequence[str]) -> float:
    """The largest pixel of the primary term along a random tangent."""
    rng = np.random.default_rng(0)
    tangent = {path: rng.normal(size=np.shape(parameters.get(scene, path))) for path in wrt}
    return float(np.abs(Renderer(scene).render_forward(tangent, spp=32, terms=["primary"])).max())


def scene_of(mesh: Mesh, view: Camera | None = None) -> Scene:
    """One glowing mesh before a dim sky."""
    materials = {"glow": glowing(1.0, True), "other": glowing(1.0, True), "ink": Material(np.zeros(3))}
    return Scene(view or camera(), {"object": mesh}, materials, world=World(np.full(3, 0.2)))


def box_scene(view: Camera | None = None) -> Scene:
    return scene_of(box((0, 0, 0), (0.5, 0.4, 0.3), "glow", 0.4), view)


def large_sheet() -> Mesh:
    """A flat sheet whose borders are outside of the picture."""
    return Mesh(*shapes.sheet(5, 20.0), ("glow",))


def checked() -> Scene:
    """A sheet whose UV map has a seam inside of its plane, in a texture of two colours."""
    mesh = large_sheet()
    side = (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0.0).astype(np.float32)
    mesh.attributes = {"UVMap": np.repeat((0.25 + 0.5 * side)[:, None, None], 3, axis=1) * np.ones(2, np.float32)}
    scene = scene_of(mesh)
    pixels = np.ones((2, 2, 3), np.float32)
    pixels[:, 1] = 0.1
    scene.images = {"two": Image(pixels)}
    scene.materials["glow"].textures = {"emission": ImageTexture("two", Attribute("UVMap"))}
    return scene


def bent_normals() -> Scene:
    """A sheet with custom normals that jump inside of its plane, under the sun."""
    mesh = large_sheet()
    side = mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0.0
    mesh.smoothing = np.repeat(side.astype(np.int32)[:, None], 3, axis=1)
    mesh.normals = np.array([[0.5, 0.0, 1.0], [-0.5, 0.0, 1.0]])
    scene = scene_of(mesh)
    scene.lights = {"sun": SunLight(np.array([-0.8, 0.0, -1.0]), 2.0)}
    scene.materials["glow"] = Material(np.full(3, 0.7))
    return scene


def hidden() -> Scene:
    scene = box_scene()
    scene.meshes["object"].visible_to = frozenset({"diffuse", "shadow"})
    return scene


ZERO: dict[str, tuple[Scene, list[str], str]] = {
    "flat inside": (scene_of(large_sheet()), [VERTICES], "between two faces of one plane"),
    "not seen by the camera": (hidden(), [VERTICES], "that camera rays cannot hit (object)"),
    "a round aperture does not turn": (
        box_scene(replace(camera(), aperture_radius=0.1, focus_distance=3.0)), ["camera.aperture_rotation"],
        "the camera stands still",
    ),
    "a pinhole has no focus": (box_scene(), ["camera.focus_distance"], "the camera stands still"),
    "no width": (box_scene(), ["camera.ortho_width"], "the camera stands still"),
}
NOT_ZERO: dict[str, tuple[Scene, list[str]]] = {
    "edges": (box_scene(), [VERTICES]),
    "the camera": (box_scene(), [POSE]),
    "a lens": (box_scene(replace(camera(), aperture_radius=0.3, focus_distance=3.0)), ["camera.focus_distance"]),
    "normals that jump": (bent_normals(), [VERTICES]),
    "a seam of a texture": (checked(), [VERTICES]),
}


@pytest.mark.parametrize("rule", ZERO)
def test_what_is_skipped_is_zero(rule: str) -> None:
    need("native")
    scene, wrt, reason = ZERO[rule]
    made = rules(scene, wrt)
    assert any(reason in why for why in made.why), made.why
    assert largest(scene, wrt) == 0.0


@pytest.mark.parametrize("rule", NOT_ZERO)
def test_what_is_kept_is_not_zero(rule: str) -> None:
    need("native")
    scene, wrt = NOT_ZERO[rule]
    assert rules(scene, wrt).computed
    assert largest(scene, wrt) > 1e-3


def test_zero_adjoint_gives_zero_gradient() -> None:
    need("native")
    scene = box_scene()
    gradient = Renderer(scene).render_backward(np.zeros((32, 32, 3)), [VERTICES, POSE], spp=8, terms=["primary"])
    assert all(not g.any() for g in gradient.values())


def test_moving_everything_with_the_camera_changes_nothing() -> None:
    need("native")
    scene = box_scene()
    rate = np.zeros((4, 4))
    rate[:3, 3] = [0.7, -0.4, 0.9]
    tangent = {VERTICES: np.broadcast_to(rate[:3, 3], scene.meshes["object"].vertices.shape), POSE: rate}
    alone = Renderer(scene).render_forward({POSE: rate}, spp=32, terms=["primary"])
    both = Renderer(scene).render_forward(tangent, spp=32, terms=["primary"])
    assert np.abs(both).max() < 1e-5 * np.abs(alone).max()


def test_split_and_shared_vertices_give_one_gradient() -> None:
    """Of the whole mesh's translation: copies of a vertex share what one has alone."""
    need("native")
    gradients = []
    for mesh in (box((0, 0, 0), (0.5, 0.4, 0.3), "glow", 0.4), large_sheet()):
        corners = Mesh(mesh.vertices[mesh.faces.reshape(-1)], np.arange(mesh.faces.size).reshape(-1, 3), mesh.materials)
        for m in (mesh, corners):
            adjoint = np.random.default_rng(1).normal(size=(32, 32, 3))
            found = Renderer(scene_of(m)).render_backward(adjoint, [VERTICES], spp=32, terms=["primary"])
            gradients.append(found[VERTICES].sum(axis=0))
    for one, other in zip(gradients[::2], gradients[1::2], strict=True):
        assert one == pytest.approx(other, rel=1e-4, abs=1e-9)


def test_camera_reaches_meshes_that_stand_still() -> None:
    made = rules(box_scene(), [POSE])
    assert made.edges == 12 and made.of == 18  # the diagonals are flat
    assert any("the camera moves" in why for why in made.why)


def missing(scene: Scene, wrt: Sequence[str]) -> str:
    return " ".join(plan(scene, wrt, max_depth=1).missing)


def test_jumps_that_are_no_edges_are_named() -> None:
    assert missing(box_scene(), [VERTICES]) == ""
    near, far = (box_scene(replace(camera(), **{clip: 4.0})) for clip in ("clip_start", "clip_end"))
    for cut in (near, far):
        assert "clip distances cut into object" in missing(cut, [VERTICES])
        assert "clip distances cut into object" in missing(cut, [POSE])
    beside = box_scene(replace(camera(), clip_start=4.0))
    beside.meshes["object"].vertices[:, 0] += 9.0
    assert missing(beside, [VERTICES]) == "", "the cut is outside of the picture"
    scene = checked()
    assert missing(scene, [VERTICES]) == ""
    scene.materials["glow"].textures = {"emission": ImageTexture("two", Attribute("UVMap"), interpolation="CLOSEST")}
    slides = "borders at which textures may jump, where they move over"
    assert slides in " ".join(plan(scene, ["meshes.object.attributes.UVMap"]).missing)
    assert slides not in " ".join(plan(scene, ["images.two.pixels"]).missing)
    # A hue's color jumps where the hue leaves [0, 1]
    hue, layer = Channel(Attribute("UVMap"), 0), "meshes.object.attributes.UVMap"
    for drawn, jumps in ((hue, True), (0.3, False)):
        color = ColorModel(Combine(drawn, 0.8, Channel(Attribute("UVMap"), 1)), "HSV", "RGB")
        scene.materials["glow"].textures = {"emission": color}
        assert (slides in missing(scene, [layer])) == jumps
        assert slides not in missing(scene, [VERTICES])
    # The borders of hues that leave it are sampled where they are straight, and named where they are curved
    curved, borders = "where their textures may jump", "at which textures jump"
    noise = Channel(Noise(Attribute("UVMap")), 0)
    spread = scene.meshes["object"]
    spread.attributes["UVMap"] = (0.5 + 0.05 * spread.vertices[:, :2]).astype(np.float32)[spread.faces]
    for drawn, sampled, named in ((hue, False, False), (noise, False, False), (Math("MULTIPLY", hue, 2.0), True, False),
                                  (Math("SINE", Math("MULTIPLY", hue, 9.0)), False, True)):  # fmt: skip
        scene.materials["glow"].textures = {"emission": ColorModel(Combine(drawn, 0.8, 1.0), "HSV", "RGB")}
        assert (borders in str(plan(scene, [VERTICES]))) == sampled
        assert (curved in missing(scene, [VERTICES])) == named
    copies = box_scene()
    copies.materials["glow"] = Material(np.zeros(3))
    copies.meshes["object"].instances = np.eye(4)[None]
    assert missing(copies, [VERTICES]) == ""


def test_borders_of_panoramas_are_named() -> None:
    disc, poles = "the border of the disc that the fisheye sees", "beyond a pole"
    small, large = 1.0, 6.0
    for kind, path, fov, named in (
        ("FISHEYE_EQUISOLID", "camera.fisheye_lens", small, True),
        ("FISHEYE_EQUISOLID", "camera.fisheye_lens", large, False),  # it is outside of the picture
        ("FISHEYE_EQUISOLID", "camera.fisheye_fov", small, True),
        ("FISHEYE_POLYNOMIAL", "camera.fisheye_fov", small, True),
        ("FISHEYE_EQUIDISTANT", "camera.fisheye_fov", small, False),  # it stays where it is
        ("FISHEYE_EQUIDISTANT", "camera.shift", small, True),
        ("FISHEYE_EQUIDISTANT", POSE, small, False),
    ):
        view = replace(camera(), kind=kind, fisheye_fov=fov, fisheye_lens=0.5)
        assert (disc in missing(box_scene(view), [path])) == named, (kind, path, fov)
    for north in (1.5, 1.7):
        view = replace(camera(), kind="EQUIRECTANGULAR", latitude=np.array([-1.0, north]))
        assert (poles in missing(box_scene(view), [VERTICES])) == (north > 1.6)


def label(height: float, flipped: bool = False, aside: float = 0.0) -> Scene:
    """A small sheet before a larger one, of which the camera sees the front."""
    small = rectangle((aside, 0.0, height), (0.0, 0.4, 0.0) if flipped else (0.4, 0.0, 0.0),
                      (0.4, 0.0, 0.0) if flipped else (0.0, 0.4, 0.0), "ink")  # fmt: skip
    large = rectangle((0.0, 0.0, 0.0), (0.8, 0.0, 0.0), (0.0, 0.8, 0.0), "glow")
    scene = scene_of(small)
    return replace(scene, meshes={"object": small, "wall": large})


def test_coincident_faces_are_named() -> None:
    """A label in the plane of its wall: its colour appears at once as it moves out of the plane."""
    ahead, behind = (Renderer(label(height)).render(spp=16).astype(np.float64) for height in (1e-4, -1e-4))
    assert np.abs(ahead - behind).max() > 0.5
    named = [said for said in plan(label(0.0), [VERTICES]).missing if "coincide" in said]
    assert len(named) == 1 and "'object' and 'wall'" in named[0]
    for clear in (label(0.01), label(0.0, aside=1.2), label(0.0, flipped=True)):
        assert not any("coincide" in said for said in plan(clear, [VERTICES, POSE]).missing)
    assert any("coincide" in said for said in plan(label(0.0), [POSE]).missing)
    assert not any("coincide" in said for said in plan(label(0.0), ["materials.glow.emission"]).missing)


@pytest.mark.parametrize("shape", ["RECTANGLE", "ELLIPSE"])
def test_lights_in_the_plane_of_a_face_are_named(shape: str) -> None:
    """A lamp that was snapped to the ceiling: a ceiling that sinks below it darkens the room at once."""

    def room(height: float, turned: float = 0.0, aside: float = 0.0) -> Scene:
        pose = np.eye(4)
        pose[:3, :3] = turn(turned, 0.0, 0.4)
        pose[:3, 3] = [aside, 0.0, 1.0]
        ceiling = rectangle((0.0, 0.0, 1.0 + height), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "white")
        floor = rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "white")
        return Scene(camera((0.0, -2.0, 0.5)), {"object": ceiling, "floor": floor},
                     {"white": Material(np.full(3, 0.8))},
                     {"lamp": AreaLight(pose, np.array([0.4, 0.3]), shape=shape, power=10.0)})  # fmt: skip

    below, above = (Renderer(room(height)).render(spp=16).mean() for height in (-1e-3, 1e-3))
    assert below < 0.1 * above
    for wrt in ([VERTICES], ["lights.lamp.to_world"]):
        named = [said for said in plan(room(0.0), wrt).missing if "lies in their plane" in said]
        assert len(named) == 1 and "'lamp'" in named[0] and "object" in named[0]
        for clear in (room(0.01), room(0.0, turned=0.1), room(0.0, aside=2.0)):
            assert not any("lies in their plane" in said for said in plan(clear, wrt).missing)
    assert not any("lies in their plane" in said for said in plan(room(0.0), ["lights.lamp.power", POSE]).missing)


def test_lens_far_wider_than_its_focus_is_named() -> None:
    """The primary term's samples then miss the picture."""
    view = replace(camera(), aperture_radius=0.01, focus_distance=1e-5)
    assert largest(box_scene(view), [VERTICES]) == 0.0
    assert any("seen through the lens" in said for said in plan(box_scene(view), [VERTICES]).missing)
    usual = replace(view, focus_distance=4.0)
    assert not any("seen through the lens" in said for said in plan(box_scene(usual), [VERTICES]).missing)
