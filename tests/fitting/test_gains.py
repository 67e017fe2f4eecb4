"""Unknown exposure and white balance of targets: what is found, and that noise does not bias it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from edgegrad import FitStep, Renderer
from edgegrad.fitting.gains import Gains, best_gain
from edgegrad.fitting.scene_fit import fit
from edgegrad.fitting.targets import EXPOSURE, WHITE_BALANCE, Target, View
from edgegrad.losses import Charbonnier, Gradients, Huber, Loss, Pyramid, l1, l2
from tests.support import shapes
from tests.support.fits import COLOR, ball, picture

TRUE = np.array([2.5, 1.5, 0.7])
LOSSES: dict[str, Loss] = {"l2": l2, "pyramid": Pyramid(), "gradients": Gradients(), "l1": l1, "huber": Huber(0.05),
                           "charbonnier": Charbonnier(0.02)}  # fmt: skip


def view(target: Any, kind: str, mask: Any = None, shared: str = "") -> View:
    return View(np.asarray(target, np.float32), shapes.camera(), mask, 1.0, kind, shared)


def adjoint_of(loss: Loss) -> Callable[[View, Any], Any]:
    return lambda view, image: loss(image, view.image, view.mask)[1]


@pytest.mark.parametrize("name", LOSSES)
@pytest.mark.parametrize("kind", [EXPOSURE, WHITE_BALANCE])
def test_gain_is_the_best_one(name: str, kind: str) -> None:
    """No other gain has a smaller loss, whatever the loss is; far from the start, too."""
    rng = np.random.default_rng(0)
    image, loss = rng.random((16, 16, 3)), LOSSES[name]
    mask = rng.random((16, 16)) * (rng.random((16, 16)) > 0.3)
    target = 30.0 * TRUE * image * rng.uniform(0.8, 1.2, image.shape)
    found = best_gain([(view(target, kind, mask), (image, image))], adjoint_of(loss), kind, np.ones(3))
    assert kind == WHITE_BALANCE or np.ptp(found) == 0.0
    least = loss(found * image, target, mask)[0]
    channels = [np.ones(3)] if kind == EXPOSURE else list(np.eye(3))
    for direction in channels:
        for change in (-0.3, -1e-2, 1e-2, 0.3):
            assert loss(found * (1.0 + change * direction) * image, target, mask)[0] >= least


@pytest.mark.parametrize("name", ["l2", "pyramid", "huber", "gradients"])
def test_gradient_is_that_of_the_loss_at_its_best_gain(name: str) -> None:
    """The envelope theorem: of min over g of L(g I, P), by the pixels, against differences."""
    rng = np.random.default_rng(1)
    image, target, loss = rng.random((12, 12, 3)), rng.random((12, 12, 3)), LOSSES[name]
    seen = view(target, EXPOSURE)

    def best(image: Any) -> Any:
        # A float64 picture keeps the differences exact.
        at = best_gain([(seen, (image, image))], adjoint_of(loss), EXPOSURE, np.ones(3))
        return loss(at * image, target)[0], at * loss(at * image, target)[1]

    direction, step = rng.normal(size=image.shape), 1e-3
    difference = (best(image + step * direction)[0] - best(image - step * direction)[0]) / (2 * step)
    assert np.vdot(best(image)[1], direction) == pytest.approx(difference, rel=2e-3)


def test_noise_does_not_bias_the_gain() -> None:
    """Of noisy pictures, the least squares of one picture give a gain that is far too small."""
    rng = np.random.default_rng(2)
    clean = rng.uniform(0.2, 1.0, (24, 24, 3))
    seen = view(2.0 * clean, EXPOSURE)
    found, naive = [], []
    for _ in range(200):
        first, second = (clean + 0.5 * rng.normal(size=clean.shape) for _ in range(2))
        found.append(best_gain([(seen, (first, second))], adjoint_of(l2), EXPOSURE, np.ones(3))[0])
        mean = 0.5 * (first + second)
        naive.append(best_gain([(seen, (mean, mean))], adjoint_of(l2), EXPOSURE, np.ones(3))[0])
    error = np.std(found, ddof=1) / np.sqrt(len(found))
    assert abs(np.mean(found) - 2.0) < 4.0 * error + 2e-3  # the quotient's own bias falls with the pixels
    assert np.mean(naive) < 2.0 - 0.2


@pytest.mark.parametrize("kind", [EXPOSURE, WHITE_BALANCE])
def test_colors_are_found_with_an_unknown_exposure(kind: str) -> None:
    """The world behind the ball tells the gain; of pictures of few samples."""
    truth, scene = (shapes.scene(*shapes.ball(2), world=1.0) for _ in range(2))
    truth.materials["clay"].base_color = np.array([0.2, 0.7, 0.4])
    gain = TRUE if kind == WHITE_BALANCE else np.full(3, 2.5)
    result = fit(scene, Target(gain * picture(truth), gain=kind), [COLOR], iterations=100, spp=4, seed=1)
    np.testing.assert_allclose(scene.materials["clay"].base_color, [0.2, 0.7, 0.4], atol=0.02)
    np.testing.assert_allclose(result.gains[0], gain, rtol=0.02)


def test_a_known_gain_is_undone() -> None:
    truth, scene, other = ball(1.2), ball(), ball()
    image = picture(truth)
    steps: list[FitStep] = []
    one = fit(scene, Target(4.0 * image, gain=4.0), [COLOR], iterations=2, spp=2, callback=steps.append)
    two = fit(other, Target(image), [COLOR], iterations=2, spp=2)
    assert one.losses == two.losses
    np.testing.assert_array_equal(one.gains, np.full((1, 3), 4.0))
    np.testing.assert_allclose(steps[0].target, image, rtol=1e-6)


def test_targets_share_a_gain_if_they_say_so() -> None:
    rng = np.random.default_rng(3)
    images = [rng.random((8, 8, 3)) for _ in range(4)]
    factors, names = (1.0, 3.0, 2.0, 5.0), ("a", "a", "", "")
    seen = [view(g * image, EXPOSURE, shared=name) for g, image, name in zip(factors, images, names, strict=True)]
    gains = Gains(seen)
    found = gains.find(adjoint_of(l2), {j: (image, image) for j, image in enumerate(images)})
    assert found[0][0] == found[1][0] and 1.0 < found[0][0] < 3.0
    assert found[2][0] == pytest.approx(2.0, rel=1e-5) and found[3][0] == pytest.approx(5.0, rel=1e-5)
    # If only some are rendered, the others of the group follow.
    found = gains.find(adjoint_of(l2), {1: (images[1], images[1])})
    assert found[0][0] == found[1][0] == pytest.approx(3.0, rel=1e-5) and found[3][0] == 1.0


def test_a_known_gain_may_have_the_name_of_a_shared_one() -> None:
    image = np.random.default_rng(4).random((8, 8, 3))
    known = View(np.asarray(image, np.float32), shapes.camera(), None, 1.0, np.full(3, 4.0), "a")
    gains = Gains([known, view(2.0 * image, EXPOSURE, shared="a")])
    found = gains.find(adjoint_of(l2), dict.fromkeys(range(2), (image, image)))
    assert found[0][0] == 4.0 and found[1][0] == pytest.approx(2.0, rel=1e-5)


def test_gradient_at_the_truth_has_no_bias() -> None:
    """With few samples and an unknown exposure, the mean gradient of many seeds is zero within its noise."""
    scene = shapes.scene(*shapes.ball(2), world=1.0)
    renderer = Renderer(scene)
    target = 2.0 * renderer.render(spp=16384, seed=7)
    seen = view(target, EXPOSURE)
    two, one = [], []
    for seed in range(60):
        halves = tuple(renderer.render(spp=1, seed=1000 + 2 * seed + half) for half in range(2))
        mean = 0.5 * (halves[0] + halves[1])
        for pair, out in ((halves, two), ((mean, mean), one)):
            gain = best_gain([(seen, pair)], adjoint_of(l2), EXPOSURE, np.ones(3))
            adjoint = gain * l2(gain * mean, target)[1]
            out.append(renderer.render_backward(adjoint, [COLOR], spp=4, seed=5000 + seed)[COLOR])

    def z(values: Any) -> Any:
        return np.mean(values, axis=0) / (np.std(values, axis=0, ddof=1) / np.sqrt(len(values)))

    assert np.abs(z(two)).max() < 4.5 and np.abs(z(one)).max() > 6.0, (z(two), z(one))
