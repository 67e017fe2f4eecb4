"""The one-shot functions reuse the scene that was prepared last, and the caller does not notice it."""

from __future__ import annotations

import gc
import threading

import numpy as np
import pytest

import edgegrad
from edgegrad import render as one_shot  # the function; its module is looked up below
from tests.support import shapes

MODULE = __import__("sys").modules["edgegrad.rendering.one_shot"]


def ball(**options: float) -> edgegrad.Scene:
    return shapes.scene(*shapes.ball(2), **options)


def fresh(scene: edgegrad.Scene, **options: int) -> np.ndarray:
    return edgegrad.Renderer(scene).render(spp=4, **options)


def test_repeated_calls_give_the_bits_of_fresh_ones() -> None:
    scene = ball()
    for change in range(6):
        if change == 1:
            scene.materials["clay"].base_color = np.array([0.1, 0.9, 0.4])
        if change == 2:
            scene.camera.fov_x *= 0.8
        if change == 3:
            scene.meshes["object"].vertices = scene.meshes["object"].vertices * 1.1
        if change == 4:
            scene.world.color = np.full(3, 0.7)
        if change == 5:
            scene = ball()
        assert np.array_equal(one_shot(scene, spp=4), fresh(scene))


def test_the_prepared_scene_is_used_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = ball()
    one_shot(scene, spp=1)

    def never(*_: object, **__: object) -> None:
        raise AssertionError("prepared anew")

    monkeypatch.setattr(MODULE, "Renderer", never)
    one_shot(scene, spp=1)
    edgegrad.render_backward(scene, fresh(scene), ["materials.clay.base_color"], spp=1)
    scene.meshes["object"].vertices = scene.meshes["object"].vertices + 1e-3
    with pytest.raises(AssertionError, match="prepared anew"):
        one_shot(scene, spp=1)


def test_a_wrong_scene_is_an_error_the_second_time_too() -> None:
    scene = ball()
    before = one_shot(scene, spp=1)
    right = scene.meshes["object"].vertices
    wrong = right.copy()
    wrong[0, 0] = np.nan
    scene.meshes["object"].vertices = wrong
    for _ in range(2):
        with pytest.raises(ValueError, match="mesh 'object': vertices has 1 non-finite"):
            one_shot(scene, spp=1)
    scene.meshes["object"].vertices = right
    assert np.array_equal(one_shot(scene, spp=1), before)


def test_calls_within_a_callback_and_from_threads() -> None:
    outer, inner = shapes.scene(*shapes.ball(2)), ball(world=2.0)
    expected = fresh(inner)
    found: list[np.ndarray] = []

    def nested(_: float) -> None:
        if not found:
            found.append(one_shot(inner, spp=4))

    one_shot(outer, spp=4, progress=nested)
    workers = [threading.Thread(target=lambda: found.append(one_shot(inner, spp=4))) for _ in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(found) == 5 and all(np.array_equal(image, expected) for image in found)


def test_only_one_scene_is_kept() -> None:
    for k in range(3):
        one_shot(ball(world=1.0 + k), spp=1)
        gc.collect()
        assert len(MODULE._last) == 1
