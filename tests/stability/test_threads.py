"""Calls with several threads: the same bits as with one, and (``make sanitize-threads``) no races."""

from __future__ import annotations

import threading

import numpy as np

from edgegrad import Renderer
from tests.stability.soups import paths_of
from tests.support.picture_differences import need_every_table
from tests.support.rich_scene import everything
from tests.support.small_scenes import floating_box

OPTIONS = {"spp": 2, "max_depth": 3, "seed": 1}


def test_threads_share_the_work_of_a_call() -> None:
    need_every_table()
    scene = everything()
    paths = paths_of(scene)
    tangent = {path: np.ones(scene.meshes["moved"].vertices.shape) for path in ["meshes.moved.vertices"]}
    adjoint = np.random.default_rng(0).normal(size=(*scene.camera.size, 3))
    one, four = (Renderer(scene, threads=n) for n in (1, 4))
    assert np.array_equal(one.render(**OPTIONS), four.render(**OPTIONS))
    assert np.array_equal(one.render_forward(tangent, **OPTIONS), four.render_forward(tangent, **OPTIONS))
    gradients = [renderer.render_backward(adjoint, paths, **OPTIONS) for renderer in (one, four)]
    for path in paths:
        assert np.array_equal(gradients[0][path], gradients[1][path]), path


def test_calls_go_on_at_the_same_time() -> None:
    """Python threads that render and differentiate the same renderer get what one after the other gets."""
    need_every_table()
    renderer = Renderer(floating_box(), threads=2)
    path = "meshes.box.vertices"
    adjoint = np.random.default_rng(0).normal(size=(*renderer.scene.camera.size, 3))
    calls = [
        lambda: renderer.render(**OPTIONS),
        lambda: renderer.render_backward(adjoint, [path], **OPTIONS)[path],
        lambda: renderer.render_forward({path: np.ones((8, 3))}, **OPTIONS),
    ]
    alone = [call() for call in calls]
    found: list[np.ndarray | None] = [None] * 6

    def run(k: int) -> None:
        found[k] = calls[k % 3]()

    threads = [threading.Thread(target=run, args=(k,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k, result in enumerate(found):
        assert result is not None and np.array_equal(result, alone[k % 3])
