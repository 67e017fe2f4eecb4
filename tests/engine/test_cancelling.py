"""Derivatives of any number of samples can be cancelled: what comes before the first samples takes no more memory.

Each call is cancelled when it first tells its progress, in a process with little memory.
"""

from __future__ import annotations

import contextlib
import itertools
import sys
from collections.abc import Callable

import numpy as np
import pytest

import edgegrad
from edgegrad import Material, Renderer, Scene
from tests.support.apart import apart
from tests.support.small_scenes import FLOOR, box, camera, floating_box, glowing, matte, need, rectangle, white_world

SPP = 1 << 24
ROOM = 1 << 30


def before_sky() -> Scene:
    """A box over a floor under a plain sky."""
    scene = floating_box()
    return Scene(scene.camera, {name: scene.meshes[name] for name in ("floor", "box")}, scene.materials,
                 world=white_world())


def sunk() -> Scene:
    """A box that stands in a floor that gives light, under a light that cuts through it."""
    return Scene(
        camera((0.3, 1.5, 3.0)),
        {"floor": rectangle(**FLOOR, material="lamp"), "box": box((0, 0, 0), (0.4, 0.4, 0.4), "clay")},
        {"clay": matte(), "lamp": glowing(2.0)},
        {"ball": edgegrad.PointLight(np.array([0.4, 0.3, 0.0]), radius=0.3, sphere=True)}, white_world(),
    )


def glossy() -> Scene:
    """A ball of light over a mirror and a sharp gloss."""
    lamp = box((0.0, 0.9, 0.0), (0.2, 0.2, 0.2), "lamp")
    return Scene(
        camera((0.3, 1.5, 3.0)),
        {"floor": rectangle(**FLOOR, material="gloss"), "box": lamp,
         "mirror": rectangle((0, 0.8, -1.0), (1.5, 0, 0), (0, 0.8, 0), "mirror")},
        {"gloss": Material(np.full(3, 0.8), kind="GLOSSY", roughness=0.2), "lamp": glowing(5.0),
         "mirror": Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0)},
        world=white_world(0.1),
    )


SCENES: dict[str, Callable[[], Scene]] = {"sky": before_sky, "sunk": sunk, "glossy": glossy}


def cancel(name: str, term: str, depth: int, learn: bool = False) -> None:
    scene = SCENES[name]()
    scene.camera.width = scene.camera.height = 256
    renderer = Renderer(scene, threads=2, learn=learn)

    def stop(fraction: float) -> None:
        raise edgegrad.Cancelled

    adjoint = np.ones((256, 256, 3), np.float32)
    path, options = "meshes.box.vertices", {"spp": SPP, "max_depth": depth, "progress": stop}
    for call in (
        lambda: renderer.render(**options),
        lambda: renderer.render_backward(adjoint, [path], terms=(term,), **options),
        lambda: renderer.render_forward({path: np.ones((8, 3))}, terms=(term,), **options),
    ):
        try:
            call()
        except edgegrad.Cancelled:
            continue
        raise AssertionError("not cancelled")


def cancel_all(name: str) -> None:
    for depth in (2, 4):
        for term in edgegrad.TERMS:
            cancel(name, term, depth)
    cancel(name, "shadow", 3, True)


@pytest.mark.skipif(sys.platform != "linux", reason="limits its own address space")
@pytest.mark.parametrize("name", SCENES)
def test_no_term_takes_memory_by_sample(name: str) -> None:
    need("native")
    apart(cancel_all, name, room=ROOM)


def stop_at(last: int) -> Callable[[float], None]:
    """A progress function that cancels when it is called for the `last` time."""
    calls = itertools.count(1)

    def progress(fraction: float) -> None:
        if next(calls) == last:
            raise edgegrad.Cancelled

    return progress


@pytest.mark.parametrize("name", SCENES)
def test_what_follows_a_cancelled_call_is_the_same(name: str) -> None:
    need("native")
    path, adjoint = "meshes.box.vertices", np.ones((32, 32, 3), np.float32)
    expected = Renderer(SCENES[name]()).render_backward(adjoint, [path], spp=4, max_depth=4)[path]
    renderer = Renderer(SCENES[name]())
    for last in range(1, 5):  # how often progress is reported depends on the machine
        with contextlib.suppress(edgegrad.Cancelled):
            renderer.render_backward(adjoint, [path], spp=4, max_depth=4, progress=stop_at(last))
    np.testing.assert_array_equal(renderer.render_backward(adjoint, [path], spp=4, max_depth=4)[path], expected)
