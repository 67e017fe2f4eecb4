"""Derivatives do not depend on how a mesh is stored, cut or wound, nor on where and how large the world is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from tests.support.block_statistics import ALARM, NOTICED, check, compare
from tests.support.scenes.turned_box import Floats, build, geometry
from tests.support.small_scenes import need

SEEDS, SPP = 12, 32
MOTION = np.array([1.0, 0.4, 0.3])


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
    # With equal samples the difference is smaller than with independent samples.
    outcome = compare(other, one.mean(axis=0), one.std(axis=0, ddof=1) / np.sqrt(SEEDS))
    check(outcome)
    assert outcome.noticed(ALARM) < NOTICED


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
