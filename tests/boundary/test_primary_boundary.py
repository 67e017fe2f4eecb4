"""The primary boundary term against central differences, for every camera and every kind of edge.

Surfaces that only emit keep their radiance as they or the camera move: all that changes is where they are seen, so that
the primary term is the whole derivative.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Floats, Make, along, box, camera, glowing, need, rectangle

# The term alone beside the whole difference: see above.
PRIMARY = {"eps": 0.01, "reference_spp": 256, "max_depth": 1, "terms": ("primary",)}


def turn(angle: float, axis: int) -> Floats:
    """Rotation about a coordinate axis."""
    c, s = np.cos(angle), np.sin(angle)
    out = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[i, i] = out[j, j] = c
    out[i, j], out[j, i] = -s, s
    return out


def glowing_scene(view: edgegrad.Camera, *, world: float = 0.3) -> edgegrad.Scene:
    """Emissive shapes, one partly before another."""
    front, faces = shapes.ball(2, 0.45)
    return edgegrad.Scene(
        view,
        {
            "box": box((0.4, 0.1, -0.6), (0.35, 0.45, 0.3), "warm", 0.5),
            "ball": edgegrad.Mesh(front + [-0.25, -0.1, 0.5], faces, ("cold",)),
            "card": rectangle((-0.7, 0.5, -0.4), (0.3, 0.1, 0), (-0.1, 0.35, 0.2), "both"),
        },
        {
            "warm": edgegrad.Material(np.zeros(3), np.array([2.0, 1.2, 0.5])),
            "cold": edgegrad.Material(np.zeros(3), np.array([0.2, 0.6, 1.6])),
            "both": glowing(1.5, True),
        },
        world=edgegrad.World(np.ones(3), world),
    )


VIEW = camera((0.3, 0.4, 3.0), (0, 0, 0), 32, 0.8)
ORTHOGRAPHIC = replace(VIEW, kind="ORTHOGRAPHIC", ortho_width=2.4)
PANORAMA = replace(camera((0.1, 0.0, 1.3), (0, 0, 0)), kind="EQUIRECTANGULAR", width=64)
# Its left and right end, and its upper end, go through the shapes.
BACKWARDS = replace(camera((-0.3, 0.2, -0.05), (-0.2, 1.0, -2.0)), kind="EQUIRECTANGULAR", width=64)
LENS = replace(VIEW, aperture_radius=0.12, focus_distance=2.7)
BLADES = replace(LENS, aperture_blades=5, aperture_rotation=0.3, aperture_ratio=1.6, aperture_radius=0.2)
TRIANGLE = replace(LENS, aperture_blades=3, aperture_radius=0.4)
WIDE = replace(VIEW, crop=(5, 3, 27, 25), filter="BLACKMAN_HARRIS", filter_width=3.0, pixel_aspect=1.3)


def moved(
    view: edgegrad.Camera, axis: int = 3, angle: float = 0.0, shift: tuple[float, float, float] = (0, 0, 0)
) -> Make:
    """The camera turns about a world axis and moves."""

    def make(theta: float) -> edgegrad.Scene:
        to_world = view.to_world.copy()
        if angle:
            to_world[:3, :3] = turn(theta * angle, axis) @ to_world[:3, :3]
        to_world[:3, 3] += theta * np.asarray(shift)
        return glowing_scene(replace(view, to_world=to_world))

    return make


def changed(view: edgegrad.Camera, field: str, rate: float | Floats) -> Make:
    """One number of the camera grows."""
    return lambda theta: glowing_scene(replace(view, **{field: getattr(view, field) + theta * np.asarray(rate)}))


def shapes_move(view: edgegrad.Camera) -> Make:
    """All shapes move apart and stretch."""

    def make(theta: float) -> edgegrad.Scene:
        scene = glowing_scene(view)
        for k, mesh in enumerate(scene.meshes.values()):
            apart = np.array([0.6, -0.3, 0.8]) * (k - 1)
            mesh.vertices = mesh.vertices + theta * (apart + 0.4 * mesh.vertices[:, ::-1])
        return scene

    return make


MESHES = [f"meshes.{name}.vertices" for name in ("box", "ball", "card")]
POSE = ["camera.to_world"]
CASES: dict[str, tuple[Make, list[str]]] = {
    "perspective: shapes move": (shapes_move(VIEW), MESHES),
    "perspective: camera moves": (moved(VIEW, shift=(1.0, 0.4, -0.7)), POSE),
    "perspective: camera turns": (moved(VIEW, 1, 0.7), POSE),
    "perspective: camera rolls": (moved(VIEW, 2, 0.9), POSE),
    "perspective: focal length": (changed(VIEW, "fov_x", 0.6), ["camera.fov_x"]),
    "perspective: shift": (changed(VIEW, "shift", np.array([0.3, -0.2])), ["camera.shift"]),
    "perspective: pixel aspect": (changed(WIDE, "pixel_aspect", 0.8), ["camera.pixel_aspect"]),
    "crop and wide filter: shapes move": (shapes_move(WIDE), MESHES),
    "crop and wide filter: camera moves": (moved(WIDE, shift=(1.0, 0.4, -0.7)), POSE),
    "orthographic: shapes move": (shapes_move(ORTHOGRAPHIC), MESHES),
    "orthographic: camera moves": (moved(ORTHOGRAPHIC, shift=(1.0, 0.4, -0.7)), POSE),
    "orthographic: camera turns": (moved(ORTHOGRAPHIC, 0, 0.7), POSE),
    "orthographic: width": (changed(ORTHOGRAPHIC, "ortho_width", 2.0), ["camera.ortho_width"]),
    "panorama: shapes move": (shapes_move(PANORAMA), MESHES),
    "panorama: camera moves": (moved(PANORAMA, shift=(0.5, 0.4, -0.7)), POSE),
    "panorama: camera turns": (moved(PANORAMA, 0, 0.5), POSE),
    "panorama: longitudes": (changed(PANORAMA, "longitude", np.array([0.9, -0.6])), ["camera.longitude"]),
    "panorama: latitudes": (changed(PANORAMA, "latitude", np.array([0.2, -0.3])), ["camera.latitude"]),
    "panorama all around: shapes move": (shapes_move(BACKWARDS), MESHES),
    "panorama all around: camera turns": (moved(BACKWARDS, 0, 0.4, (0.1, 0.2, 0.1)), POSE),
    "lens: shapes move": (shapes_move(LENS), MESHES),
    "lens: camera moves": (moved(LENS, 1, 0.3, (0.4, 0.3, -0.7)), POSE),
    "lens: aperture opens": (changed(LENS, "aperture_radius", 1.0), ["camera.aperture_radius"]),
    "lens: focus": (changed(LENS, "focus_distance", 3.0), ["camera.focus_distance"]),
    "blades: aperture turns": (changed(TRIANGLE, "aperture_rotation", 3.0), ["camera.aperture_rotation"]),
    "blades: aperture's ratio": (changed(BLADES, "aperture_ratio", 6.0), ["camera.aperture_ratio"]),
    "lens, orthographic: focus and pose": (
        moved(replace(LENS, kind="ORTHOGRAPHIC", ortho_width=2.4), 1, 0.3, (0.4, 0.3, -0.7)), POSE
    ),
}


def primary(renderer: Renderer, tangent: Mapping[str, Floats], **options: int) -> Floats:
    """The primary term along a tangent."""
    return renderer.render_forward(tangent, terms=("primary",), **options).astype(np.float64)


# One of each kind of camera in every run, the others in the slow ones.
QUICK = (
    "perspective: camera turns", "crop and wide filter: shapes move", "orthographic: camera moves",
    "panorama all around: camera turns",
)


RUNS = slow_but(CASES, QUICK)


@pytest.mark.parametrize("name", RUNS)
def test_cameras_and_shapes_agree_with_central_differences(name: str) -> None:
    need("native")
    # Blurred edges change few samples each: a difference needs wide steps and many of them to be told from its noise.
    lens = name.startswith(("lens", "blades"))
    wide = {"eps": 0.1, "reference_spp": 4096} if lens else {}
    check_agreement(along(*CASES[name]), noise=0.35 if lens else 0.1, **{**PRIMARY, **wide})


# ---------------------------------------------------------------- surfaces that pierce or touch each other
def crossing_boxes(theta: float) -> edgegrad.Scene:
    """Two emissive boxes through each other, which move and turn."""
    scene = glowing_scene(VIEW)
    one = box((0.1, 0.0, 0.0), (0.5, 0.3, 0.3), "warm", 0.4)
    other = box((-0.1, 0.1, 0.1), (0.25, 0.5, 0.35), "cold", 1.0)
    tilt = turn(0.5 + 0.6 * theta, 2)
    one.vertices = one.vertices @ tilt.T + theta * np.array([0.3, 0.2, 0.4])
    other.vertices = other.vertices @ turn(-0.3, 0).T - theta * np.array([0.2, 0.5, 0.3])
    scene.meshes = {"one": one, "other": other}
    return scene


def sunk_ball(theta: float) -> edgegrad.Scene:
    """A ball that sinks into a floor."""
    scene = glowing_scene(camera((0.2, 1.2, 2.6), (0, 0, 0), 32, 0.8))
    vertices, faces = shapes.ball(3, 0.6)
    scene.meshes = {
        "floor": rectangle((0, 0, 0), (0, 0, 1.2), (1.2, 0, 0), "warm"),
        "ball": edgegrad.Mesh(vertices + [0.1, 0.1, 0.0] + theta * np.array([0.3, -0.8, 0.2]), faces, ("cold",)),
    }
    return scene


def folded(theta: float) -> edgegrad.Scene:
    """One mesh that passes through itself: two bands that cross, of two materials."""
    scene = glowing_scene(VIEW)
    one = rectangle((0, 0, 0), (0.8, 0, 0.3), (0, 0.3, 0.1), "both")
    other = rectangle((0.1, 0, 0), (0.2, 0.5, -0.6), (0.4, -0.3, 0.2), "both")
    vertices = np.concatenate([one.vertices + theta * np.array([0.2, 0.5, 0.3]), other.vertices])
    scene.meshes = {
        "bands": edgegrad.Mesh(
            vertices,
            np.concatenate([one.faces, other.faces + 4]),
            ("both", "glow"),
            face_material=np.array([0, 0, 1, 1], np.int32),
        )
    }
    scene.materials = {"both": glowing(1.5, True), "glow": glowing(0.4, True)}
    return scene


def sunk_balls(theta: float) -> edgegrad.Scene:
    """A ball of many faces that sinks into another."""
    scene = glowing_scene(VIEW)
    vertices, faces = shapes.ball(5, 0.5)
    other = 0.7 * vertices @ turn(0.3, 0).T + [0.05, 0.0, 0.25] + theta * np.array([0.4, 0.5, -0.7])
    scene.meshes = {"ball": edgegrad.Mesh(vertices, faces, ("warm",)), "other": edgegrad.Mesh(other, faces, ("cold",))}
    return scene


def grown_together(theta: float) -> edgegrad.Scene:
    """Both as one mesh, in which the second is inside out: normals that differ little are one smooth surface's."""
    scene = sunk_balls(theta)
    one, other = scene.meshes.values()
    faces = np.concatenate([one.faces, other.faces[:, ::-1] + len(one.vertices)])
    material = np.repeat(np.array([0, 1], np.int32), len(one.faces))
    vertices = np.concatenate([one.vertices, other.vertices])
    scene.meshes = {"balls": edgegrad.Mesh(vertices, faces, ("both", "in"), face_material=material)}
    scene.materials = {"both": glowing(1.5, True), "in": glowing(0.4, True)}
    return scene


def grown_about_one_middle(theta: float, way: int = 1) -> edgegrad.Scene:
    """A mesh of two bodies that cross, each of which is seen whole from the middle of both; `way` -1: the second is
    inside out.
    """
    scene = glowing_scene(VIEW)
    ball, faces = shapes.ball(4, 1.0)
    tilt = turn(0.5, 1).T @ turn(0.3, 0).T
    one, other = ball * [0.75, 0.3, 0.22] @ tilt, ball * [0.2, 0.42, 0.7] @ tilt
    vertices = np.concatenate([one, other + theta * np.array([0.4, 0.3, -0.5])])
    material = np.repeat(np.array([0, 1], np.int32), len(faces))
    faces = np.concatenate([faces, faces[:, ::way] + len(ball)])
    scene.meshes = {"bodies": edgegrad.Mesh(vertices, faces, ("both", "in"), face_material=material)}
    scene.materials = {"both": glowing(1.5, True), "in": glowing(0.4, True)}
    return scene


def speared(theta: float) -> edgegrad.Scene:
    """A ball whose hindmost vertex is drawn through it and out in front: most faces are seen from behind, not those."""
    scene = glowing_scene(VIEW)
    vertices, faces = shapes.ball(2, 0.7)
    hindmost = int(np.argmin(vertices[:, 2] + 1e-3 * vertices[:, 0]))
    vertices[hindmost] = np.array([0.5, -0.1, 1.1]) + theta * np.array([0.8, 0.5, 0.0])
    spear = (faces == hindmost).any(axis=1)
    assert not spear[0]
    scene.meshes = {"body": edgegrad.Mesh(vertices, faces, ("both", "in"), face_material=spear.astype(np.int32))}
    scene.materials = {"both": glowing(1.5, True), "in": glowing(0.4, True)}
    return scene


def crossing_view(theta: float) -> edgegrad.Scene:
    """The camera moves before two boxes that stand still in each other."""
    scene = crossing_boxes(0.0)
    scene.camera = moved(VIEW, 1, 0.6, (0.7, 0.3, -0.5))(theta).camera
    return scene


PIERCING: dict[str, tuple[Make, list[str]]] = {
    "boxes": (crossing_boxes, ["meshes.one.vertices", "meshes.other.vertices"]),
    "ball in the floor": (sunk_ball, ["meshes.ball.vertices"]),
    "a mesh and itself": (folded, ["meshes.bands.vertices"]),
    "meshes of many faces": (sunk_balls, ["meshes.ball.vertices", "meshes.other.vertices"]),
    "a mesh of many faces and itself": (grown_together, ["meshes.balls.vertices"]),
    "bodies about one middle": (grown_about_one_middle, ["meshes.bodies.vertices"]),
    "one of them inside out": (partial(grown_about_one_middle, way=-1), ["meshes.bodies.vertices"]),
    "a ball and its spear": (speared, ["meshes.body.vertices"]),
    "seen by a moving camera": (crossing_view, POSE),
}


@pytest.mark.parametrize("name", PIERCING)
def test_piercing_surfaces_agree_with_central_differences(name: str) -> None:
    need("native")
    check_agreement(along(*PIERCING[name]), noise=0.1, **PRIMARY)


@pytest.mark.parametrize("name", [name for name in PIERCING if "many faces" in name])
def test_threads_share_the_search_of_many_faces(name: str) -> None:
    need("native")
    make, paths = PIERCING[name]

    def lit(theta: float) -> edgegrad.Scene:
        """All edges between facets count."""
        scene = make(theta)
        scene.materials = {name: edgegrad.Material(np.full(3, 0.5)) for name in scene.materials}
        return scene

    check_equal_bits(lit, paths, spp=4, terms=("primary",))


# ---------------------------------------------------------------- behind what lets light pass
def veiled(theta: float) -> edgegrad.Scene:
    """Shapes behind a half-transparent veil and a coloured pane."""
    scene = shapes_move(VIEW)(theta)
    scene.meshes = {
        **scene.meshes,
        "veil": rectangle((-0.3, 0, 1.2), (0.5, 0, 0.1), (0, 0.6, 0), "veil"),
        "pane": rectangle((0.2, 0, 1.4), (0.5, 0, -0.1), (0, 0.5, 0), "pane"),
    }
    scene.materials = {
        **scene.materials,
        "veil": edgegrad.Material(np.zeros(3), np.full(3, 0.3), alpha=0.4),
        "pane": edgegrad.Material(np.array([0.9, 0.5, 0.2]), kind="TRANSPARENT"),
    }
    return scene


def test_edges_behind_transparent_surfaces_agree_with_central_differences() -> None:
    need("native")
    check_agreement(along(veiled, MESHES), noise=0.1, **PRIMARY)


# ---------------------------------------------------------------- instances
def instanced(theta: float) -> edgegrad.Scene:
    """Three copies of a box, one mirrored, before and through a card; all are placed by their transforms."""
    scene = glowing_scene(VIEW)
    scene.materials = {**scene.materials, "ink": edgegrad.Material(np.zeros(3))}
    one = box((0.0, 0.0, 0.0), (0.3, 0.2, 0.25), "ink", 0.4)
    places = np.stack([np.eye(4)] * 3)
    places[0, :3, :3] = turn(0.3 + 0.5 * theta, 1) * (1.0 + 0.4 * theta)
    places[1, :3, :3] = turn(-0.6, 0) @ np.diag([-1.0, 1.2, 0.8])
    places[2, :3, :3] = turn(0.9 * theta, 2) * 0.7
    places[:, :3, 3] = [[-0.5, 0.3, 0.2], [0.5, -0.1 + 0.6 * theta, 0.0], [0.0 - 0.5 * theta, -0.6, 0.5]]
    one.instances = places
    scene.meshes = {"boxes": one, "card": rectangle((0, 0, -0.8), (0.9, 0, 0), (0, 0.7, 0), "cold")}
    return scene


def stretched(theta: float) -> edgegrad.Scene:
    """The mesh that is placed changes, and with it all its copies."""
    scene = instanced(0.0)
    mesh = scene.meshes["boxes"]
    mesh.vertices = mesh.vertices * (1.0 + theta * np.array([0.5, -0.8, 0.3])) + theta * np.array([0.2, 0.4, -0.3])
    return scene


@pytest.mark.parametrize(
    ("make", "path"),
    [(instanced, "meshes.boxes.instances"), (stretched, "meshes.boxes.vertices")],
    ids=["place", "mesh"],
)
def test_instances_agree_with_central_differences(make: Make, path: str) -> None:
    need("native")
    check_agreement(along(make, [path]), noise=0.1, **PRIMARY)


# ---------------------------------------------------------------- reverse mode
DOT: dict[str, tuple[Make, list[str]]] = {
    **{name: CASES[name] for name in ("perspective: shapes move", "crop and wide filter: camera moves",
                                      "orthographic: camera turns", "panorama all around: camera turns",
                                      "panorama: longitudes", "lens: focus", "blades: aperture's ratio",
                                      "blades: aperture turns", "lens: aperture opens", "perspective: shift")},
    **{name: PIERCING[name] for name in ("boxes", "a mesh and itself")},
    "instances": (instanced, ["meshes.boxes.instances", "meshes.boxes.vertices"]),
}


@pytest.mark.parametrize("name", DOT)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need("native")
    check_transpose(*DOT[name], spp=32, terms=("primary",))


# ---------------------------------------------------------------- radiance beside edges
def furnished(depth_of_card: float = 0.0) -> edgegrad.Scene:
    """A room of many materials with a glossy card in it that nothing hides from the camera."""
    to_world = np.eye(4)
    to_world[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # shines down
    to_world[:3, 3] = (0.2, 1.4, 0.3)
    return edgegrad.Scene(
        camera((0.2, 0.3, 3.4), (0, 0, 0), 32, 0.8),
        {
            "card": rectangle((0.1, 0.05, depth_of_card), (0.5, 0.05, 0.1), (-0.1, 0.45, -0.15), "metal"),
            "floor": rectangle((0, -0.9, 0), (0, 0, 1.6), (1.6, 0, 0), "coat"),
            "wall": rectangle((0, 0.4, -1.2), (1.6, 0, 0), (0, 1.5, 0), "wall"),
            "ball": edgegrad.Mesh(*[v + [-0.6, -0.4, -0.5] if k == 0 else v for k, v in enumerate(shapes.ball(2, 0.4))],
                                  ("glass",)),  # type: ignore[arg-type]
        },
        {
            "metal": edgegrad.Material(np.array([0.9, 0.6, 0.3]), metallic=1.0, roughness=0.4),
            "coat": edgegrad.Material(np.array([0.3, 0.5, 0.7]), roughness=0.6, coat_weight=0.6, coat_roughness=0.3),
            "wall": edgegrad.Material(np.array([0.7, 0.3, 0.2])),
            "glass": edgegrad.Material(np.array([0.9, 0.9, 0.9]), transmission=1.0, roughness=0.3),
        },
        {"lamp": edgegrad.AreaLight(to_world, np.array([0.8, 0.6]), "RECTANGLE", 30.0)},
        edgegrad.World(np.ones(3), 0.3),
    )


def test_radiance_beside_edges_is_that_of_pictures() -> None:
    """What a moving card changes in the whole picture, from pictures of single points beside its border."""
    need("native")
    scene, depth, velocity = furnished(), 5, np.array([0.7, 0.4, 0.3])
    view, focal = scene.camera, scene.camera.focal
    card = scene.meshes["card"].vertices
    eye, axes = scene.camera.to_world[:3, 3], scene.camera.to_world[:3, :3]

    def screen(p: Floats) -> Floats:
        x, y, z = (p - eye) @ axes
        return focal * np.array([x, -y]) / -z

    def radiance(p: Floats, seed: int) -> Floats:
        scene.camera = camera(eye, p, 1, 1e-5)
        return np.asarray(Renderer(scene).render(spp=1 << 13, seed=seed, max_depth=depth)[0, 0], np.float64)

    wanted, points = np.zeros(3), 6
    for a, b in zip(card, np.roll(card, -1, axis=0), strict=True):
        for k in range(points):
            e = a + (b - a) * (k + 0.5) / points
            inwards = card.mean(axis=0) - e
            along, rate = screen(e + 1e-4 * (b - a)) - screen(e), screen(e + 1e-4 * velocity) - screen(e)
            inside = screen(e + 1e-4 * inwards) - screen(e)
            swept = np.linalg.det([along, rate]) * np.sign(np.linalg.det([along, inside])) * 1e8
            wanted -= swept / points * (radiance(e + 1e-3 * inwards, k) - radiance(e - 1e-3 * inwards, k + 50))
    scene.camera = view
    tangent = {"meshes.card.vertices": np.broadcast_to(velocity, card.shape)}
    found = np.array([
        primary(Renderer(scene), tangent, spp=256, seed=k, max_depth=depth).sum(axis=(0, 1)) for k in range(8)
    ])
    noise = found.std(axis=0, ddof=1) / np.sqrt(len(found))
    assert found.mean(axis=0) == pytest.approx(wanted, rel=0.03, abs=4.0 * float(noise.max()))
    assert (noise < 0.02 * np.abs(wanted).max()).all()
