"""Losses: adjoints against finite differences, masks, and the use of the pyramid."""

from __future__ import annotations

import numpy as np
import pytest

from edgegrad.losses import Charbonnier, Gradients, Huber, Loss, Pyramid, l1, l2, named

LOSSES: dict[str, Loss] = {
    "l1": l1,
    "l2": l2,
    "pyramid": Pyramid(),
    "pyramid l1": Pyramid(power=1, levels=3),
    "pyramid coarse": Pyramid(levels=4, focus=0.0),
    "pyramid between": Pyramid(levels=4, focus=0.4),
    "huber": Huber(0.7),
    "charbonnier": Charbonnier(0.3),
    "gradients": Gradients(),
    "gradients, one level": Gradients(levels=1, epsilon=0.4),
    "gradients, all levels": Gradients(levels=6, epsilon=0.4),
}


@pytest.mark.parametrize("name", LOSSES)
@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize("shape", [(16, 24), (19, 13)])
def test_adjoint_is_the_derivative(name: str, masked: bool, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    image, target, direction = (rng.normal(size=(*shape, 3)) for _ in range(3))
    mask = rng.random(shape) * (rng.random(shape) > 0.3) if masked else None
    loss = LOSSES[name]
    value, adjoint = loss(image, target, mask)
    assert value > 0.0 and adjoint.shape == image.shape and adjoint.dtype == np.float32
    # Small enough that no |x| changes its sign, large enough for double precision.
    step = 1e-6
    high, low = loss(image + step * direction, target, mask)[0], loss(image - step * direction, target, mask)[0]
    assert np.vdot(adjoint, direction) == pytest.approx((high - low) / (2 * step), rel=2e-4, abs=1e-7)


@pytest.mark.parametrize("name", LOSSES)
def test_equal_pictures_have_no_loss_and_no_adjoint(name: str) -> None:
    image = np.random.default_rng(0).random((16, 16, 3))
    value, adjoint = LOSSES[name](image, image)
    assert value == 0.0 and not adjoint.any()


@pytest.mark.parametrize("name", LOSSES)
def test_masked_pixels_do_not_matter(name: str) -> None:
    rng = np.random.default_rng(2)
    image, target = rng.random((16, 16, 3)), rng.random((16, 16, 3))
    mask = np.ones((16, 16))
    mask[4:9, 2:12] = 0.0
    other = image.copy()
    other[4:9, 2:12] = 1e6
    first, second = LOSSES[name](image, target, mask), LOSSES[name](other, target, mask)
    assert first[0] == pytest.approx(second[0], rel=1e-12)
    np.testing.assert_array_equal(first[1], second[1])
    assert not first[1][4:9, 2:12].any()


@pytest.mark.parametrize("name", ["l1", "l2"])
def test_values_are_means(name: str) -> None:
    """The same difference everywhere gives its power, whatever the picture's size."""
    for shape in ((8, 8, 3), (32, 16, 3)):
        assert LOSSES[name](np.full(shape, 0.5), np.zeros(shape))[0] == pytest.approx(0.5 ** (1 if name == "l1" else 2))


def test_robust_losses_are_quadratic_below_their_width_and_linear_above() -> None:
    zero = np.zeros((4, 4, 3))
    for robust, width in ((Huber(0.1), 0.1), (Charbonnier(0.1), 0.1)):
        near, nearer = (robust(np.full_like(zero, d), zero)[0] for d in (1e-3 * width, 5e-4 * width))
        assert near == pytest.approx(4.0 * nearer, rel=1e-5)
        far, twice = (robust(np.full_like(zero, d), zero)[0] for d in (1e4 * width, 2e4 * width))
        assert twice == pytest.approx(2.0 * far, rel=1e-3)
    # A single bright outlier pulls a robust mean far less than the mean.
    values = np.full((8, 8, 3), 0.2)
    values[0, 0] = 20.0

    def minimum(loss: Loss) -> float:
        return min(np.linspace(0.0, 1.0, 1001), key=lambda x: loss(np.full_like(values, x), values)[0])

    assert minimum(l2) == pytest.approx(values.mean(), abs=1e-3)
    assert minimum(Huber(0.05)) == pytest.approx(0.2, abs=2e-3) == minimum(Charbonnier(0.01))


def test_gradients_ignore_smooth_lighting_but_not_texture() -> None:
    rng = np.random.default_rng(0)
    target = rng.random((48, 48, 3))
    ramp = np.broadcast_to(np.linspace(-0.5, 0.5, 48)[:, None, None], target.shape)
    noise = rng.normal(size=target.shape)
    noise *= ramp.std() / noise.std()  # of equal power
    # A factor of the difference of neighbours, 1 / 48, squared, at the finest level, and more at coarser ones.
    loss = Gradients(levels=1)
    assert l2(target + ramp, target)[0] == pytest.approx(l2(target + noise, target)[0], rel=1e-2)
    assert loss(target + ramp, target)[0] < 2e-3 * loss(target + noise, target)[0]
    assert Gradients()(target + 0.3, target)[0] < 1e-20
    # An error of lighting that the mask hides has no edge where the mask begins.
    mask = np.zeros((48, 48))
    mask[:, 20:] = 1.0
    assert Gradients()(target + np.where(mask > 0.0, 0.3, 0.0)[..., None], target, mask)[0] < 1e-20


def test_losses_have_names() -> None:
    assert named("pyramid") == Pyramid() and named("huber") == Huber() and named("l1") is l1
    with pytest.raises(ValueError, match=r"no loss 'L7' \(known: pyramid, l2"):
        named("L7")


def test_coarse_levels_see_a_far_edge() -> None:
    """A bar 14 pixels from its target: the full picture's L2 does not fall while it approaches, the pyramid's does."""

    def bar(left: int) -> np.ndarray:
        out = np.zeros((64, 64, 3))
        out[:, left : left + 4] = 1.0
        return out

    target = bar(40)
    far, nearer = bar(26), bar(34)
    assert l2(nearer, target)[0] == pytest.approx(l2(far, target)[0])
    coarse = Pyramid(focus=0.0)
    # The levels whose pixels are wider than the gap fall with the distance; the others stay.
    assert coarse(nearer, target)[0] < 0.8 * coarse(far, target)[0]


def test_focus_moves_from_coarse_to_fine() -> None:
    pyramid = Pyramid(levels=4)
    assert np.argmax(pyramid.at(0.0).weights(4)) == 3
    assert np.argmax(pyramid.at(1.0).weights(4)) == 0
    np.testing.assert_allclose(pyramid.weights(4), 0.25)
    for progress in (0.0, 0.3, 1.0):
        assert pyramid.at(progress).weights(4).sum() == pytest.approx(1.0)


def test_wrong_input_is_named() -> None:
    image = np.zeros((8, 8, 3))
    with pytest.raises(ValueError, match=r"target must have the shape of the image, \(8, 8, 3\), not \(8, 4, 3\)"):
        l2(image, np.zeros((8, 4, 3)))
    with pytest.raises(ValueError, match=r"mask must have the shape \(8, 8\)"):
        l1(image, image, np.ones((8, 8, 3)))
    for mask, message in ((np.zeros((8, 8)), "mask must be above 0 somewhere"),
                          (np.full((8, 8), np.nan), "mask has 64 non-finite values"),
                          (np.full((8, 8), -1.0), "mask must not be below 0")):
        with pytest.raises(ValueError, match=message):
            Pyramid()(image, image, mask)
    for wrong in ({"levels": 0}, {"power": 3}, {"focus": 2.0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            Pyramid(**wrong)
    with pytest.raises(ValueError, match="Huber: delta must be above 0"):
        Huber(0.0)
    with pytest.raises(ValueError, match="Gradients: levels must be between 1 and 16"):
        Gradients(levels=0)
