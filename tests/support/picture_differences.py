"""Derivatives of pictures beside differences of pictures of the same random numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Renderer, Scene
from edgegrad.rendering.engine import engine_class
from edgegrad.rendering.options import FIELD_EDGES, TERMS
from edgegrad.rendering.renderer import DERIVATIVE_STREAM
from edgegrad.scene import parameters
from tests.support import block_statistics
from tests.support.block_statistics import ALARM, NOTICED, STAGE_ALARM, Agreement
from tests.support.small_scenes import Floats, Moving, central_difference, need


def need_every_table() -> None:
    """Skip the test where the native engine can't be loaded or differentiates few tables."""
    need("native")
    if engine_class("native").narrow:
        pytest.skip("this engine differentiates few tables")


def seed_of_picture(seed: int) -> int:
    """The seed that gives a derivative the random numbers that a picture of the given seed has.

    Otherwise both are independent. With common numbers they can be compared sample by sample.
    """
    return seed ^ DERIVATIVE_STREAM


def agreement(
    moving: Moving, *, eps: float = 0.02, seeds: int = 16, spp: int = 64, reference_spp: int = 512,
    reference_seeds: int | None = None, thetas: int = 8, first_seed: int = 0, terms: Sequence[str] = TERMS,
    field_edges: str = FIELD_EDGES[0], **depths: Any,
) -> Agreement:  # fmt: skip
    """Block sums of derivative pictures beside those of the central difference over an interval of length `eps`.

    The difference is the derivative's mean over that interval, so that derivatives are taken at `thetas` places of it
    in turn. `reference_seeds` pictures (as many as `seeds` if None) make the difference.
    """
    difference, stderr = central_difference(
        moving, eps, reference_spp, reference_seeds or seeds, "native", first_seed, **depths
    )
    samples = []
    for k in range(seeds):
        scene, tangent = moving(eps * ((k % thetas + 0.5) / thetas - 0.5))
        renderer = Renderer(scene, engine="native")
        samples.append(renderer.render_forward(tangent, spp=spp, seed=first_seed + k, terms=terms,
                                               field_edges=field_edges, **depths))
    return block_statistics.compare(np.stack(samples), difference, stderr)


def check_agreement(moving: Moving, **options: Any) -> None:
    """The derivative agrees with central differences, whose noise is small enough (`NOTICED`).

    Samples with heavy tails, of which a few seeds underestimate the variance, raise false alarms. So an alarm has to be
    confirmed by other seeds, twice as many, for both the derivative and the difference: each of the two stages has the
    level `STAGE_ALARM`, so that a right derivative is found to be wrong with the probability `ALARM`.
    """
    level, outcome = STAGE_ALARM, agreement(moving, **options)
    if outcome.p_value <= level or outcome.noticed(level) >= NOTICED:
        print("to be confirmed:", outcome)
        if outcome.p_value > level:  # it is noisy alone: there is no first alarm to be confirmed
            level = ALARM
        options["seeds"] = 2 * options.get("seeds", 16)
        outcome = agreement(moving, first_seed=100_000, **options)
    print(f"{outcome}; notices errors of {outcome.noticed(level):.3f}")
    block_statistics.check(outcome, level)
    assert outcome.noticed(level) < NOTICED


def check_transpose(make: Callable[[float], Scene], paths: Sequence[str], **options: Any) -> None:
    """<w, J v> = <J^T w, v> at theta = 0: both modes take the same samples, and some of them count."""
    scene = make(0.0)
    renderer = Renderer(scene)
    rng = np.random.default_rng(3)
    tangent = {p: rng.normal(size=np.shape(parameters.get(scene, p))) for p in paths}
    height, width = scene.camera.size
    adjoint = rng.normal(size=(height, width, 3)).astype(np.float32)
    image = renderer.render_forward(tangent, **options).astype(np.float64)
    gradient = renderer.render_backward(adjoint, paths, **options)
    one, other = float(np.sum(image * adjoint)), sum(float(np.sum(gradient[p] * tangent[p])) for p in paths)
    scale = float(np.linalg.norm(image) * np.linalg.norm(adjoint)) / np.sqrt(adjoint.size)
    assert one == pytest.approx(other, abs=1e-4 * scale)
    assert scale > 0.0


def check_equal_bits(make: Callable[[float], Scene], paths: Sequence[str], **options: Any) -> None:
    """Both modes give the same bits again, and for any number of threads."""
    scene = make(0.0)
    rng = np.random.default_rng(1)
    adjoint = rng.standard_normal((*scene.camera.size, 3)).astype(np.float32)
    tangents = {path: rng.standard_normal(np.shape(parameters.get(scene, path))) for path in paths}
    first: list[NDArray[Any]] = []
    for threads in (1, 2, 3):
        renderer = Renderer(scene, threads=threads)
        for _ in range(2):
            gradient = renderer.render_backward(adjoint, paths, **options)
            results: list[NDArray[Any]] = [gradient[path] for path in paths]
            results.append(renderer.render_forward(tangents, **options))
            first = first or results
            for result, wanted in zip(results, first, strict=True):
                np.testing.assert_array_equal(result, wanted)


def sums_of_differences(
    scene: Scene, path: str, direction: Any, step: float, *, curve: Callable[[float], Any] | None = None,
    one_sided: bool = False, seeds: int = 16, spp: int = 32, max_depth: int = 2,
) -> tuple[Floats, Floats]:
    """(seeds,) difference quotients and derivatives, with common random numbers, of a weighted sum over the picture.

    Parameters
    ----------
    direction
        Tangent of the parameter.
    step
        Of the difference: to both sides, or `one_sided` along the direction.
    curve
        The parameter's value at a step, with the tangent `direction` at 0; None: a straight line.
    """
    renderer = Renderer(scene, threads=2)
    value = np.array(parameters.get(scene, path), np.float64)
    rng = np.random.default_rng(1)
    weight = rng.uniform(0.5, 1.0, (*scene.camera.size, 3))

    def shifted(by: float, options: dict[str, Any]) -> Floats:
        parameters.put(scene, path, curve(by) if curve else value + by * direction)
        renderer.update([path])
        return renderer.render(**options).astype(np.float64)

    found, exact = [], []
    for seed in range(seeds):
        options: dict[str, Any] = {"spp": spp, "max_depth": max_depth, "seed": seed}
        low = 0.0 if one_sided else -step
        difference = (shifted(step, options) - shifted(low, options)) / (step - low)
        shifted(0.0, options)
        found.append(float(np.sum(difference * weight)))
        options["seed"] = seed_of_picture(seed)
        exact.append(float(np.sum(renderer.render_forward({path: direction}, **options) * weight)))
    return np.array(found), np.array(exact)
