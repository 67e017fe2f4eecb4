"""The native and the reference engine are two estimators of the same integrals: equal within their noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.options import TERMS
from edgegrad.rendering.renderer import Renderer
from edgegrad.scene import parameters
from tests.support.block_statistics import ALARM, NOTICED, Agreement, check, compare, half_width, means_p_value
from tests.support.small_scenes import (
    MOTIONS,
    Floats,
    box,
    camera,
    crease_sheet,
    floating_box,
    glowing,
    matte,
    need,
    rectangle,
    split,
    three_sheets,
    white_world,
)

SEEDS = 8
# Of a pixel's derivative, where values are of order one.
ROUNDING = 1e-5


def emitter_before_a_wall() -> edgegrad.Scene:
    """A glowing box in front of a wall: seen directly and as the only light."""
    return edgegrad.Scene(
        camera(),
        {
            "wall": rectangle((0, 0, -0.6), (2, 0, 0), (0, 2, 0), "clay"),
            "box": box((0.2, 0, 0.2), (0.3, 0.3, 0.3), "hot", 0.4),
        },
        {"clay": matte(0.8, 0.5, 0.3), "hot": glowing(3.0)},
    )


def pillars() -> edgegrad.Scene:
    """Two bodies, one of them stored with split vertices and seen partly through the near plane, under a bright sky."""
    return edgegrad.Scene(
        camera((0, 0.6, 2.2), (0, 0, 0), fov=1.0),
        {
            "floor": rectangle((0, -0.6, 0), (0, 0, 2), (2, 0, 0), "floor"),
            "box": split(box((-0.5, 0.0, 0.0), (0.2, 0.5, 0.2), "clay", 0.3)),
            "beam": box((0.7, 0.3, 1.4), (0.1, 0.1, 1.2), "clay", 0.2),
        },
        {"floor": matte(0.3, 0.5, 0.4), "clay": matte(0.7, 0.6, 0.5)},
        world=white_world(),
    )


SCENES: dict[str, Callable[[], edgegrad.Scene]] = {
    "all lights": floating_box,
    "folded sheet": crease_sheet,
    "three sheets on one edge": three_sheets,
    "emitter before a wall": emitter_before_a_wall,
    "pillars under the sky": pillars,
}


def tangent_of(scene: edgegrad.Scene) -> dict[str, Floats]:
    """Everything that has a derivative moves at once, smoothly: meshes stretch, colours change."""
    tangent: dict[str, Floats] = {}
    for path in parameters.paths(scene):
        value = np.asarray(parameters.get(scene, path))
        if path.endswith(".vertices"):
            tangent[path] = np.array([0.5, 0.3, -0.4]) * (1.0 + 0.5 * value)
        elif path.endswith(".emission") and not value.any():
            continue  # the reference picks points of emitters by area: in a dark corner its variance is infinite
        elif path.endswith((".base_color", ".emission", ".power", ".strength")) or path == "world.color":
            tangent[path] = np.full(value.shape, 0.2) * (1.0 + value)
    return tangent


def both(estimate: Callable[[str, int], Floats]) -> Agreement:
    """Compare estimate(engine, seed) of the native engine with that of the reference."""
    reference = [estimate("reference", 100 + k) for k in range(SEEDS)]
    # A term that vanishes (no shadow of a convex light on itself) does so up to rounding.
    stderr = np.std(reference, axis=0, ddof=1) / np.sqrt(SEEDS) + ROUNDING
    outcome = compare([estimate("native", k) for k in range(SEEDS)], np.mean(reference, axis=0), stderr)
    print(outcome)
    return outcome


@pytest.fixture(params=list(SCENES))
def pair(request: pytest.FixtureRequest) -> tuple[edgegrad.Scene, dict[str, Renderer]]:
    need("native")
    scene = SCENES[request.param]()
    return scene, {engine: Renderer(scene, engine=engine) for engine in ("native", "reference")}


Pair = tuple[edgegrad.Scene, Mapping[str, Renderer]]


def test_pictures_agree(pair: Pair) -> None:
    _, renderers = pair
    outcome = both(lambda engine, seed: renderers[engine].render(spp=64, seed=seed).astype(np.float64))
    check(outcome)
    assert outcome.noticed(ALARM) < NOTICED


@pytest.mark.parametrize("term", TERMS)
def test_derivative_images_agree(pair: Pair, term: str) -> None:
    """Each term by itself, with all parameters moving."""
    scene, renderers = pair
    tangent = tangent_of(scene)
    outcome = both(
        lambda engine, seed: renderers[engine]
        .render_forward(tangent, spp=16, seed=seed, terms=(term,))
        .astype(np.float64)
    )
    check(outcome)


def test_gradients_agree(pair: Pair) -> None:
    """Gradients of all parameters for one adjoint image, contracted with several tangents of each."""
    scene, renderers = pair
    wrt = list(tangent_of(scene))
    adjoint = ramp(renderers["native"])
    directions = {p: probes(np.asarray(parameters.get(scene, p))) for p in wrt}

    def estimate(engine: str, seed: int) -> Floats:
        gradient = renderers[engine].render_backward(adjoint, wrt, spp=16, seed=seed)
        return np.array([np.sum(gradient[p] * d) for p in wrt for d in directions[p]])

    native = np.array([estimate("native", k) for k in range(SEEDS)])
    reference = np.array([estimate("reference", 100 + k) for k in range(SEEDS)])
    size = float(np.abs(reference.mean(axis=0)).max())
    check(means_p_value(native, reference, rounding=1e-5 * size))
    told = np.abs(reference.mean(axis=0)) > half_width(reference)
    assert told.sum() > 3  # not everything is noise



@pytest.mark.slow
@pytest.mark.parametrize("name", MOTIONS)
def test_native_motion_agrees_with_the_reference(name: str) -> None:
    need("native")
    scene, tangent = MOTIONS[name](0.0)
    renderers = {engine: Renderer(scene, engine=engine) for engine in ("native", "reference")}
    outcome = both(lambda engine, seed: renderers[engine].render_forward(tangent, spp=32, seed=seed).astype(np.float64))
    check(outcome)


def ramp(renderer: Renderer) -> NDArray[np.float32]:
    """An adjoint image that grows to the right and downwards, differently per channel."""
    height, width = renderer.render(spp=1).shape[:2]
    y, x = np.mgrid[:height, :width] / height
    return np.stack([1.0 + x, 0.5 + y - x, 0.3 + x * y], axis=2).astype(np.float32)


def probes(value: Floats) -> list[Floats]:
    """Tangents along which a gradient is looked at."""
    if value.ndim == 2:  # vertices: shift along each axis, and scaling
        return [*(np.broadcast_to(np.eye(3)[k], value.shape) for k in range(3)), value]
    return [np.ones(value.shape)] if value.ndim == 0 else list(np.eye(len(value)))
