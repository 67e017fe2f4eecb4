"""What must not change a derivative: how a mesh is stored, cut or wound, and where and how large the world is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from tests.support.small_scenes import camera, need

Floats = NDArray[np.float64]
SEEDS, SPP = 12, 32
MOTION = np.array([1.0, 0.4, 0.3])


def geometry() -> tuple[Floats, NDArray[np.int32], Floats, NDArray[np.int32]]:
    """A turned box over a floor: vertices and faces of both."""
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])], np.int32)
    c, s = np.cos(0.6), np.sin(0.6)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    floor = np.array([[-2, -0.9, -2], [-2, -0.9, 2], [2, -0.9, 2], [2, -0.9, -2]], float)
    return cube @ turn.T * [0.5, 0.4, 0.45], faces, floor, np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def build(
    box: tuple[Floats, NDArray[np.int32]],
    floor: tuple[Floats, NDArray[np.int32]],
    *,
    rotation: Floats | None = None,
    scale: float = 1.0,
    shift: float = 0.0,
) -> edgegrad.Scene:
    """The scene in a world that is turned, scaled and shifted as a whole, its lights' powers with it."""
    turn = np.eye(3) if rotation is None else rotation
    place = lambda x: np.asarray(x, float) @ turn.T * scale + shift  # noqa: E731
    view = camera((0.4, 1.6, 3.2), (0, -0.2, 0), 32)
    view.to_world[:3, :3] = turn @ view.to_world[:3, :3]
    view.to_world[:3, 3] = place(view.to_world[:3, 3])
    view.clip_start *= scale
    lamp = np.eye(4)
    lamp[:3, :3] = turn @ np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)  # its -Z looks down
    lamp[:3, 3] = place([0.8, 2.2, 0.5])
    return edgegrad.Scene(
        view,
        {
            "box": edgegrad.Mesh(place(box[0]), box[1], ("clay",)),
            "floor": edgegrad.Mesh(place(floor[0]), floor[1], ("grey",)),
        },
        {"clay": edgegrad.Material(np.array([0.8, 0.4, 0.2])), "grey": edgegrad.Material(np.full(3, 0.6))},
        {
            "key": edgegrad.AreaLight(lamp, np.array([0.5, 0.5]) * scale, power=40.0 * scale**2),
            "point": edgegrad.PointLight(place([-1.2, 1.5, 1.0]), 30.0 * scale**2),
            "sun": edgegrad.SunLight(turn @ [0.2, -1.0, -0.3], 0.5),
        },
        edgegrad.World(np.full(3, 0.3)),
    )


def plain() -> edgegrad.Scene:
    box, faces, floor, floor_faces = geometry()
    return build((box, faces), (floor, floor_faces))


def split() -> edgegrad.Scene:
    """Every corner has its own vertex."""
    box, faces, floor, floor_faces = geometry()
    return build((box[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)), (floor, floor_faces))


def shuffled() -> edgegrad.Scene:
    """Faces and vertices in another order, and some faces wound the other way."""
    box, faces, floor, floor_faces = geometry()
    rng = np.random.default_rng(3)
    order = rng.permutation(len(box))
    faces = np.argsort(order)[faces][rng.permutation(len(faces))]
    faces[::3] = faces[::3, ::-1]
    return build((box[order], faces), (floor, floor_faces[::-1]))


def cut() -> edgegrad.Scene:
    """Every face in four."""
    def quarter(vertices: Floats, faces: NDArray[np.int32]) -> tuple[Floats, NDArray[np.int32]]:
        p = vertices[faces]
        m = 0.5 * (p + np.roll(p, -1, axis=1))
        small = np.stack([
            np.stack([p[:, 0], m[:, 0], m[:, 2]], 1), np.stack([m[:, 0], p[:, 1], m[:, 1]], 1),
            np.stack([m[:, 2], m[:, 1], p[:, 2]], 1), np.stack([m[:, 0], m[:, 1], m[:, 2]], 1),
        ], axis=1).reshape(-1, 3)
        return small, np.arange(len(small)).reshape(-1, 3)

    box, faces, floor, floor_faces = geometry()
    return build(quarter(box, faces), quarter(floor, floor_faces))


def turned() -> edgegrad.Scene:
    box, faces, floor, floor_faces = geometry()
    return build((box, faces), (floor, floor_faces), rotation=ROTATION)


def sized(scale: float, shift: float = 0.0) -> Callable[[], edgegrad.Scene]:
    def make() -> edgegrad.Scene:
        box, faces, floor, floor_faces = geometry()
        return build((box, faces), (floor, floor_faces), scale=scale, shift=shift)

    return make


ROTATION = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
ROTATION *= np.sign(np.linalg.det(ROTATION))

# Scene, and the motion that corresponds to MOTION in it
CASES: dict[str, tuple[Callable[[], edgegrad.Scene], Floats]] = {
    "split vertices": (split, MOTION),
    "other order and winding": (shuffled, MOTION),
    "faces cut in four": (cut, MOTION),
    "turned world": (turned, ROTATION @ MOTION),
    "millimetres": (sized(1e-3), 1e-3 * MOTION),
    "kilometres": (sized(1e4), 1e4 * MOTION),
    "far from the origin": (sized(1.0, 1e5), MOTION),
    "small and far": (sized(1e-3, 1e3), 1e-3 * MOTION),
}


def derivatives(scene: edgegrad.Scene, motion: Floats) -> Floats:
    """(SEEDS, H, W, 3) derivative images for the box moving along `motion`."""
    r = edgegrad.Renderer(scene, engine="native")
    tangent = {"meshes.box.vertices": np.broadcast_to(motion, scene.meshes["box"].vertices.shape)}
    return np.array([r.render_forward(tangent, spp=SPP, seed=k) for k in range(SEEDS)], np.float64)


@pytest.mark.parametrize("name", CASES)
def test_derivative_stays(name: str) -> None:
    need("native")
    make, motion = CASES[name]
    one, other = derivatives(plain(), MOTION), derivatives(make(), motion)
    difference = np.linalg.norm(one.mean(axis=0) - other.mean(axis=0))
    # The norm of the difference of two independent noisy images concentrates about this. Where both
    # have the same samples it is smaller still.
    noise = np.sqrt((one.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)).sum() / SEEDS)
    size = np.linalg.norm(one.mean(axis=0))
    assert noise < 0.1 * size
    assert difference < 1.3 * noise, (difference / size, noise / size)


@pytest.mark.parametrize("name", CASES)
def test_sum_of_vertex_gradients_is_the_gradient_of_a_shift(name: str) -> None:
    need("native")
    make, motion = CASES[name]
    scene = make()
    r = edgegrad.Renderer(scene, engine="native")
    weights = np.random.default_rng(0).random((32, 32, 3)).astype(np.float32)
    gradient = r.render_backward(weights, ["meshes.box.vertices"], spp=8, seed=4)["meshes.box.vertices"]
    tangent = {"meshes.box.vertices": np.broadcast_to(motion, gradient.shape)}
    image = r.render_forward(tangent, spp=8, seed=4).astype(np.float64)
    assert gradient.sum(axis=0) @ motion == pytest.approx((image * weights).sum(), rel=1e-4)
