"""Scenes: every bad input gives one clear error, topology goes by position."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import edgegrad
from edgegrad import Camera, Material, Mesh, Scene, SunLight, World
from edgegrad.geometry import topology
from edgegrad.scene import parameters
from tests.support import shapes


def box() -> Scene:
    return shapes.scene(*shapes.cube())


def break_vertices(scene: Scene) -> None:
    scene.meshes["object"].vertices[3, 1] = np.nan


def break_faces(scene: Scene) -> None:
    scene.meshes["object"].faces[2, 0] = 8


def break_faces_low(scene: Scene) -> None:
    scene.meshes["object"].faces[2, 0] = -1


def empty(scene: Scene) -> None:
    scene.meshes["object"].faces = np.zeros((0, 3), np.int32)


def no_camera(scene: Scene) -> None:
    scene.camera = None  # type: ignore[assignment]


def no_light(scene: Scene) -> None:
    scene.lights, scene.world = {}, World()


def unknown_material(scene: Scene) -> None:
    scene.meshes["object"].materials = ("brick",)


def no_slot(scene: Scene) -> None:
    scene.meshes["object"].face_material = np.full(12, 1, np.int32)


def bright(scene: Scene) -> None:
    scene.materials["clay"].base_color[0] = 1.5


def dark(scene: Scene) -> None:
    scene.lights["lamp"].color = np.array([1.0, -1.0, 1.0])


def skewed(scene: Scene) -> None:
    scene.camera.to_world[0, 0] = 3.0


BAD: list[tuple[Callable[[Scene], None], str]] = [
    (break_vertices, r"^mesh 'object': vertices has 1 non-finite values, the first at \(3, 1\)$"),
    (break_faces, r"^mesh 'object': faces name vertex 8, but there are 8 vertices$"),
    (break_faces_low, r"^mesh 'object': faces name vertex -1, but there are 8 vertices$"),
    (empty, r"^mesh 'object': is empty \(8 vertices, 0 faces\)$"),
    (no_camera, r"^scene: has no camera; set camera to an edgegrad.Camera$"),
    (no_light, r"^scene: nothing emits light; add a light, an emissive material or a world colour$"),
    (unknown_material, r"^mesh 'object': material 'brick' is not in the scene$"),
    (no_slot, r"^mesh 'object': face_material names slot 1, but there are 1 materials$"),
    (bright, r"^material 'clay': base_color must not be above 1, but contains 1.5$"),
    (dark, r"^light 'lamp': color must not be below 0, but contains -1$"),
    (skewed, r"^camera: to_world must be a rigid transform; its axes are not orthonormal$"),
]


@pytest.mark.parametrize(("breaks", "message"), BAD, ids=[b.__name__ for b, _ in BAD])
def test_bad_scenes_have_one_clear_error(breaks: Callable[[Scene], None], message: str) -> None:
    scene = box()
    breaks(scene)
    with pytest.raises(ValueError, match=message):
        edgegrad.render(scene, 1)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("meshes.cube.vertices", "there is no 'cube' in meshes \\(known: 'object'\\)"),
        ("meshes.object.faces", "'faces' is not one of the fields vertices"),
        ("vertices", "unknown parameter path 'vertices'"),
        ("camera.clip_end", "'camera.clip_end' has no derivative: clip distances"),
    ],
)
def test_bad_paths_have_one_clear_error(path: str, message: str) -> None:
    scene = box()
    with pytest.raises(ValueError, match=message):
        edgegrad.render_backward(scene, np.zeros((24, 32, 3)), [path], 1)


def test_names_may_contain_dots() -> None:
    scene = box()
    scene.meshes = {"Cube.001": scene.meshes["object"]}
    assert parameters.get(scene, "meshes.Cube.001.vertices").shape == (8, 3)
    assert "meshes.Cube.001.vertices" in parameters.paths(scene)
    with pytest.raises(ValueError, match="must have the shape"):
        parameters.put(scene, "meshes.Cube.001.vertices", np.zeros((7, 3)))


@pytest.mark.parametrize("shape", ["cube", "sheet", "ball"])
def test_split_vertices_have_the_edges_of_shared_ones(shape: str) -> None:
    vertices, faces = {"cube": shapes.cube(), "sheet": shapes.sheet(5), "ball": shapes.ball(2)}[shape]
    shared = topology.edges(faces, topology.weld(vertices))
    loose, corners = shapes.split(vertices, faces)
    apart = topology.edges(corners, topology.weld(loose))
    np.testing.assert_array_equal(apart.face_first, shared.face_first)
    np.testing.assert_array_equal(apart.faces, shared.faces)
    np.testing.assert_allclose(loose[apart.vertices], vertices[shared.vertices])
    np.testing.assert_allclose(loose[apart.opposite], vertices[shared.opposite])


def test_edges_of_a_closed_and_an_open_mesh() -> None:
    vertices, faces = shapes.cube()
    found = topology.edges(faces, topology.weld(vertices))
    assert len(found) == 18 and (np.diff(found.face_first.astype(int)) == 2).all()  # Euler: 8 + 12 - 2
    vertices, faces = shapes.sheet(4)
    found = topology.edges(faces, topology.weld(vertices))
    assert len(found) == 33 and (np.diff(found.face_first.astype(int)) == 1).sum() == 12


def test_edges_agree_with_a_plain_dictionary() -> None:
    rng = np.random.default_rng(3)
    for _ in range(30):
        vertices = rng.integers(0, 3, (12, 3)).astype(np.float64)  # many coincide
        faces = rng.integers(0, 12, (15, 3)).astype(np.int32)
        label = topology.weld(vertices)
        expected: dict[frozenset[int], list[int]] = {}
        for f, face in enumerate(faces):
            if len(set(label[face])) < 3:  # without area
                continue
            for k in range(3):
                ends = frozenset((int(label[face[k]]), int(label[face[(k + 1) % 3]])))
                if len(ends) == 2:
                    expected.setdefault(ends, []).append(f)
        found = topology.edges(faces, label)
        got = {
            frozenset(int(label[v]) for v in found.vertices[k]): found.faces[a:b].tolist()
            for k, (a, b) in enumerate(zip(found.face_first[:-1], found.face_first[1:], strict=True))
        }
        assert got == expected


def test_welding_goes_by_distance_and_misses_no_pair() -> None:
    rng = np.random.default_rng(4)
    vertices = rng.random((3000, 3))
    near = vertices + rng.uniform(-2e-8, 2e-8, vertices.shape)
    label = topology.weld(np.concatenate([vertices, near]))
    np.testing.assert_array_equal(label[:3000], np.arange(3000))
    np.testing.assert_array_equal(label[3000:], np.arange(3000))
    assert topology.weld(np.array([[0.0, 0, 0], [-0.0, 0, 0], [1, 0, 0]])).tolist() == [0, 0, 1]
    assert topology.weld(np.array([[0.0, 0, 0], [1e-5, 0, 0], [1, 0, 0]])).tolist() == [0, 1, 2]
    assert len(topology.weld(np.zeros((0, 3)))) == 0


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_welding_goes_by_the_size_of_the_mesh(size: float) -> None:
    vertices = size * np.array([[0.0, 0, 0], [2e-8, 0, 0], [1, 1, 1]]) + 10.0 * size
    assert topology.weld(vertices).tolist() == [0, 0, 1]


def test_three_faces_at_one_edge_are_one_edge() -> None:
    vertices = np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]])
    found = topology.edges(np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]], np.int32), topology.weld(vertices))
    count = np.diff(found.face_first.astype(int))
    assert sorted(count.tolist()) == [1, 1, 1, 1, 1, 1, 3]


def test_faces_without_area_change_nothing() -> None:
    """Slivers and points added to a mesh: same picture, and no gradient out of nothing."""
    scene = box()
    # Off the planes of the box: of a face seen exactly edge-on two edges lie upon each other, and which of them the
    # picture's derivative is that of depends on the direction.
    scene.camera.to_world[:3, 3] += [0.1, 0.2, 0.07]
    image = edgegrad.render(scene, 4)
    adjoint = np.random.default_rng(0).normal(size=image.shape)
    plain = edgegrad.render_backward(scene, adjoint, ["meshes.object.vertices"], 4)["meshes.object.vertices"]
    mesh = scene.meshes["object"]
    mesh.faces = np.concatenate([mesh.faces, [[0, 0, 0], [1, 1, 2], [0, 3, 0]]]).astype(np.int32)
    np.testing.assert_allclose(edgegrad.render(scene, 4), image, atol=1e-6)
    gradient = edgegrad.render_backward(scene, adjoint, ["meshes.object.vertices"], 4)["meshes.object.vertices"]
    assert np.isfinite(gradient).all()
    # The edges' samples fall elsewhere; the gradient is the same but for their noise.
    assert np.linalg.norm(gradient - plain) < 0.5 * np.linalg.norm(plain)


def test_integers_and_lists_are_converted() -> None:
    vertices, faces = shapes.cube()
    scene = Scene(
        Camera(shapes.camera().to_world.tolist(), 1, 8, 8),
        {"object": Mesh(vertices.astype(np.float32), faces.tolist(), ["clay"])},  # type: ignore[arg-type]
        {"clay": Material([1, 0, 0])},  # type: ignore[arg-type]
        {"sun": SunLight([0, 0, -1], 3)},  # type: ignore[arg-type]
    )
    scene.validate()
    assert scene.meshes["object"].vertices.dtype == np.float64
    assert "lights.sun.strength" in parameters.paths(scene)
