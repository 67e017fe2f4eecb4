"""A renderer that learns: its gradients stay unbiased, repeat to the bit and get less noisy; it forgets stale data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.budget import COST, LEAST, MOST, TERMS, Budget
from edgegrad.rendering.renderer import Renderer
from tests.support import peer_scenes
from tests.support.block_statistics import check, compare, means_p_value, over_theta
from tests.support.reference_files import find
from tests.support.small_scenes import box, camera, glowing, matte, need, rectangle

Floats = NDArray[np.float64]
OCCLUDER = "meshes.occluder.vertices"
SPP = 4


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def shadowed() -> edgegrad.Scene:
    """A box over a floor, between a light and a dim sky."""
    return edgegrad.Scene(
        camera((0.0, 3.0, 4.0), size=32),
        {
            "floor": rectangle((0, -0.5, 0), (0, 0, 2), (2, 0, 0), "grey"),
            "occluder": box((0.0, 0.3, 0.0), (0.3, 0.2, 0.25), "grey", 0.4),
            "lamp": rectangle((0.5, 3.0, -0.5), (0.4, 0, 0), (0, 0, 0.4), "glow"),
        },
        {"grey": matte(), "glow": glowing(4.0, True)},
        world=edgegrad.World(color=np.full(3, 0.1)),
    )


def adjoint(size: int = 32) -> NDArray[np.float32]:
    """Of a part of the picture, of both signs."""
    out = np.zeros((size, size, 3), np.float32)
    low, high = size // 3, 2 * size // 3
    out[low:high, low:] = np.random.default_rng(3).normal(size=(high - low, 1, 3))
    return out


def gradient(renderer: Renderer, seed: int, depth: int = 2, **more: Any) -> Floats:
    """The occluder's, as one row."""
    found = renderer.render_backward(adjoint(), [OCCLUDER], spp=SPP, seed=seed, max_depth=depth, **more)
    return found[OCCLUDER].ravel()


def taught(scene: edgegrad.Scene, gradients: int, threads: int = 1, depth: int = 2) -> tuple[Renderer, list[Floats]]:
    """A renderer that has learned from some gradients, and these."""
    renderer = Renderer(scene, threads=threads, engine="native", learn=True)
    return renderer, [gradient(renderer, seed, depth) for seed in range(gradients)]


@pytest.mark.parametrize("case", ["two_triangles", "shadow_light", pytest.param("camera_move", marks=pytest.mark.slow)])
def test_what_is_learned_biases_nothing(case: str) -> None:
    # The adjoint that is learned from is large in a quarter of the picture only: what it says contributes little is
    # still a part of the derivative.
    path = find(case)

    def estimate(scene: edgegrad.Scene, tangent: Mapping[str, Floats], seed: int) -> Any:
        renderer = Renderer(scene, engine="native", learn=True)
        height, width = scene.camera.size
        part = np.full((height, width, 3), 0.1, np.float32)
        part[height // 2 :, : width // 2] = 1.0
        for k in range(3):
            renderer.render_backward(part, list(tangent), spp=8, seed=100 * seed + k)
        return renderer.render_forward(tangent, spp=8, seed=seed)

    _, _, arrays = peer_scenes.load(path)
    outcome = compare(over_theta(path, float(arrays["eps"]), estimate), arrays["grad_fd"], arrays["grad_fd_stderr"])
    print(outcome)
    check(outcome)


@pytest.mark.parametrize("depth", [2, 4])
def test_gradients_have_the_mean_of_those_that_do_not_learn(depth: int) -> None:
    # The second and the fourth gradient measure the terms.
    scene = shadowed()
    renderer = Renderer(scene, engine="native")
    plain = np.stack([gradient(renderer, seed, depth) for seed in range(64)])
    chains = []
    for chain in range(16):
        fit = Renderer(scene, engine="native", learn=True)
        chains.append(np.mean([gradient(fit, 1000 + 50 * chain + k, depth) for k in range(5)], axis=0))
    learned = np.stack(chains)
    check(means_p_value(plain, learned))


def test_equal_calls_give_equal_bits_for_any_number_of_threads() -> None:
    _, one = taught(shadowed(), 4, threads=1)
    _, three = taught(shadowed(), 4, threads=3)
    for a, b in zip(one, three, strict=True):
        np.testing.assert_array_equal(a, b)


def test_without_learning_calls_are_independent() -> None:
    renderer = Renderer(shadowed(), engine="native")
    first = gradient(renderer, 3)
    gradient(renderer, 6)
    np.testing.assert_array_equal(gradient(renderer, 3), first)
    # And learning does change them.
    assert not np.array_equal(taught(shadowed(), 4)[1][3], first)


@pytest.mark.parametrize("depth", [2, 4])
def test_both_modes_take_the_same_learned_samples(depth: int) -> None:
    renderer, _ = taught(shadowed(), 2, depth=depth)
    tangent = np.random.default_rng(1).normal(size=(8, 3))
    # The third gradient measures nothing, and the derivative picture learns nothing.
    picture = renderer.render_forward({OCCLUDER: tangent}, spp=SPP, seed=9, max_depth=depth)
    left = float(np.sum(picture * adjoint(), dtype=np.float64))
    right = float(gradient(renderer, 9, depth) @ tangent.ravel())
    assert left == pytest.approx(right, rel=2e-5, abs=1e-6 * float(np.abs(picture).max()))


def test_another_form_of_the_scene_is_begun_anew() -> None:
    scene = shadowed()
    renderer, _ = taught(scene, 3)
    scene.lights["sun"] = edgegrad.SunLight(direction=np.array([0.2, -1.0, 0.1]), strength=0.5)
    renderer.update()
    fresh = Renderer(scene, engine="native", learn=True)
    np.testing.assert_array_equal(gradient(renderer, 0), gradient(fresh, 0))
    scene.camera = camera((0.0, 3.0, 4.0), size=24)
    for each in (renderer, fresh):
        each.update()
    found = renderer.render_backward(adjoint(24), [OCCLUDER], spp=SPP, seed=0)[OCCLUDER]
    fresh = Renderer(scene, engine="native", learn=True)
    np.testing.assert_array_equal(found, fresh.render_backward(adjoint(24), [OCCLUDER], spp=SPP, seed=0)[OCCLUDER])
    scene.meshes["occluder"] = rectangle((0, 0.3, 0), (0.3, 0, 0), (0, 0, 0.3), "grey")
    with pytest.raises(ValueError, match="topology"):
        renderer.update()


def test_views_learn_by_themselves() -> None:
    scene = shadowed()
    other = camera((3.0, 3.0, 0.0), size=32)
    _, alone = taught(scene, 3)
    both = Renderer(scene, engine="native", learn=True)
    for seed in range(3):
        np.testing.assert_array_equal(gradient(both, seed), alone[seed])
        gradient(both, seed, camera=other)


def test_many_instances_of_which_few_are_near_take_little_memory() -> None:
    scene = shadowed()
    places = np.tile(np.eye(4), (5000, 1, 1))
    places[:, 0, 3] = 100.0 + np.arange(len(places))
    places[0, :3, 3] = 0.8, 0.3, 0.5
    scene.meshes["crowd"] = replace(box((0.0, 0.0, 0.0), (0.05, 0.05, 0.05), "grey", 0.4), instances=places)
    renderer = Renderer(scene, engine="native", learn=True)
    for seed in range(2):
        renderer.render_backward(adjoint(), ["meshes.crowd.vertices"], spp=64, seed=seed, terms=["primary"])
    (view,) = renderer.learned().values()
    stored = sum(weights["moment"].size for weights in view["sampling"]["weights"])
    assert 0 < stored < 2e6


def test_gradients_get_better() -> None:
    # The adjoint is nonzero in a ninth of the picture: samples elsewhere contribute nothing.
    weights = np.zeros((32, 32, 3), np.float32)
    weights[10:20, 10:20] = 1.0
    at: dict[int, list[Floats]] = {0: [], 5: []}
    for fit in range(12):
        renderer = Renderer(shadowed(), engine="native", learn=True)
        for k in range(6):
            found = renderer.render_backward(weights, [OCCLUDER], spp=SPP, seed=100 * fit + k, terms=("shadow",))
            if k in at:
                at[k].append(found[OCCLUDER])
    first, later = (float(np.stack(values).var(axis=0, ddof=1).sum()) for values in at.values())
    # Samples where the adjoint is not zero alone would have a ninth of the variance; of 12 fits it is known to a half.
    assert later < 0.5 * first


# ---------------------------------------------------------------- the budget
def measured(variances: Mapping[str, float], samples: Mapping[str, float], times: int = 1) -> Budget:
    """A budget that has measured terms of so much variance per sample."""
    budget = Budget()
    budget.begin([samples.get(term, 0.0) for term in TERMS])
    for _ in range(times):
        for term, variance in variances.items():
            count = 0.5 * samples[term] * budget.shares()[TERMS.index(term)]
            apart = np.sqrt(variance * 2.0 / count)
            budget.note(term, [{"x": np.array([apart])}, {"x": np.zeros(1)}], [count, count])
        budget.divide()
    return budget


def test_even_samples_of_the_interior_leave_time_for_the_others() -> None:
    # What blob_flat measures: the best share of the interior is 1.5, to which 2 is the nearer power of two.
    samples = {"interior": 278504.0, "primary": 117964.0, "shadow": 150000.0}
    variances = {"interior": 224000.0, "primary": 23000.0, "shadow": 1490.0}
    shares = dict(zip(TERMS, measured(variances, samples).shares(), strict=True))
    assert shares["interior"] == 1.0
    assert sum(variances[t] / (samples[t] * shares[t]) for t in samples) < 1.1
    # If nearly all variance is in the interior term, that term gets more samples.
    noisy = measured({**variances, "interior": 2e6}, samples).shares()
    assert noisy[TERMS.index("interior")] == 2.0


def test_the_budget_is_that_of_least_variance() -> None:
    samples = {"indirect": 1000.0, "primary": 600.0, "shadow": 2000.0}
    variances = {"indirect": 3.0, "primary": 2.0, "shadow": 0.5}
    shares = dict(zip(TERMS, measured(variances, samples).shares(), strict=True))
    time = sum(COST[t] * samples[t] for t in samples)
    assert sum(COST[t] * samples[t] * shares[t] for t in samples) == pytest.approx(time)

    def noise(share: Mapping[str, float]) -> float:
        return sum(variances[t] / (samples[t] * share[t]) for t in samples)

    # Any other division of the same time is noisier.
    for a, b in (("indirect", "primary"), ("primary", "shadow"), ("shadow", "indirect")):
        moved = 0.05 * time
        other = {**shares, a: shares[a] + moved / (COST[a] * samples[a]), b: shares[b] - moved / (COST[b] * samples[b])}
        assert noise(shares) < noise(other)
    # Measured again, it stays.
    np.testing.assert_allclose(measured(variances, samples, 3).shares(), measured(variances, samples).shares())


def test_worthless_terms_keep_a_few_samples() -> None:
    samples = {"interior": 1000.0, "primary": 100.0, "shadow": 2000.0}
    shares = dict(zip(TERMS, measured({"interior": 0.0, "primary": 1.0, "shadow": 0.0}, samples).shares(), strict=True))
    assert shares["interior"] == LEAST and shares["shadow"] == LEAST
    assert shares["primary"] == MOST


def test_pixels_have_powers_of_two_of_samples() -> None:
    samples = {"interior": 1000.0, "primary": 600.0, "shadow": 2000.0}
    shares = dict(zip(TERMS, measured({"interior": 3.0, "primary": 2.0, "shadow": 0.5}, samples).shares(), strict=True))
    assert shares["interior"] in (0.5, 1.0, 2.0)
    time = sum(COST[t] * samples[t] for t in samples)
    assert sum(COST[t] * samples[t] * shares[t] for t in samples) == pytest.approx(time)
