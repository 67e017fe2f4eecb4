"""Standard errors of fitted values: what a fit states is how much the results of many fits differ."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Exchange, FitResult, Material, Scene, Target, Uncertainty
from edgegrad.fitting.outcome import coordinates, measurement, newton_steps
from edgegrad.fitting.outcome.normal_equations import Solution
from edgegrad.scene import parameters
from tests.support.fits import COLOR, POWER, VERTICES, ball
from tests.support.small_scenes import need

NOISE = 0.05
ITERATIONS = 60
DARK = {"world/color": np.zeros(3)}


def small(**values: Any) -> Scene:
    scene = ball()
    scene.camera.width, scene.camera.height = 24, 18
    for path, value in values.items():
        parameters.put(scene, path.replace("/", "."), value)
    return scene


def noisy(seed: int, **values: Any) -> np.ndarray:
    """The picture at the true values, with noise of its own in each pixel."""
    picture = edgegrad.render(small(**values), spp=256, seed=4321)
    noise = np.random.default_rng(seed).standard_normal(picture.shape)
    return np.asarray(picture + NOISE * noise, np.float32)


def fitted(seed: int, wrt: list[str], target: Any = None, world: float = 0.2, **options: Any) -> FitResult:
    scene = small(**{COLOR.replace(".", "/"): np.array([0.5, 0.5, 0.5]), "world/color": np.full(3, world)})
    target = noisy(seed) if target is None else target
    return edgegrad.fit(scene, target, wrt, iterations=ITERATIONS, spp=8, seed=seed, uncertainty=True, **options)


@cache
def many() -> tuple[np.ndarray, np.ndarray]:
    """Colours of fits to targets of different noise, and their standard errors."""
    results = [fitted(seed, [COLOR]) for seed in range(24)]
    return (np.array([one.values[COLOR] for one in results]), np.array([one.uncertainty[0].errors for one in results]))


def test_the_spread_of_fits_is_the_stated_error() -> None:
    """With n fits, the standard deviation of their results is known to a part of 1 / sqrt(2 (n - 1)) of it; all three
    channels together, to a third of its square."""
    need("native")
    values, errors = many()
    stated = np.sqrt((errors**2).mean(axis=0))
    ratio = np.log(values.std(axis=0, ddof=1) / stated)
    chance = 1.0 / np.sqrt(2.0 * (len(values) - 1))
    assert np.abs(ratio).max() < 4.0 * chance
    assert abs(ratio.mean()) < 4.0 * chance / np.sqrt(3.0)


def test_the_stated_error_holds_without_a_loss_of_squares() -> None:
    """Of a picture with normal noise, a fit of absolute differences has errors that are larger by sqrt(pi / 2)."""
    need("native")
    squares = np.array([fitted(seed, [COLOR], loss=edgegrad.losses.l2).uncertainty[0].errors for seed in range(4)])
    absolute = np.array([fitted(seed, [COLOR], loss=edgegrad.losses.l1).uncertainty[0].errors for seed in range(4)])
    assert np.mean(absolute / squares) == pytest.approx(np.sqrt(np.pi / 2.0), rel=0.15)


def test_a_lamp_and_a_colour_can_be_exchanged() -> None:
    need("native")
    result = fitted(0, [COLOR, POWER], noisy(0, **DARK), world=0.0)
    assert not any(np.isfinite(one.errors).any() for one in result.uncertainty)
    said = [str(one) for one in result.exchanges]
    assert len(said) == 1
    assert all(path in said[0] for path in (COLOR, POWER))
    assert said[0].endswith("can be exchanged for one another: changed together, they hardly change the pictures")
    assert "open" in str(result.uncertainty[1])


def test_an_unknown_exposure_can_be_exchanged_for_a_lamp() -> None:
    need("native")
    result = fitted(0, [POWER], Target(noisy(0, **DARK), gain="exposure"), world=0.0)
    assert np.isinf(result.uncertainty[0].errors).all()
    assert "the exposure of target 1" in str(result.exchanges[0])


def test_poses_and_arrays_have_errors() -> None:
    """A ball's turn about itself shows in nothing but its facets; its place is well known."""
    need("native")
    result = fitted(0, ["meshes.object.transform", VERTICES])
    pose, array = result.uncertainty
    assert pose.names[3:] == tuple(f"translation along {axis}" for axis in "xyz")
    assert (pose.errors[3::2] < 0.05).all()
    assert array.errors.shape == result.values[VERTICES].shape
    hidden = result.values[VERTICES][:, 1] > 0.6  # behind, as the camera sees it
    assert np.isinf(array.errors[hidden]).mean() > np.isinf(array.errors[~hidden]).mean()
    assert str(array).startswith(f"'{VERTICES}': standard error ")


def test_numbers_at_a_limit_have_no_error() -> None:
    scene = small()
    scene.materials["clay"] = Material(np.array([0.9, 0.5, 0.5]))
    seen = edgegrad.render(scene, spp=16)
    result = edgegrad.fit(scene, Target(seen * (9.0, 1.0, 1.0)), [COLOR], iterations=20, spp=2, uncertainty=True)
    assert result.uncertainty[0].names == ("[1]", "[2]")


def test_measuring_reports_progress_and_can_be_cancelled() -> None:
    """The last part of a fit's progress; a fit that is stopped there keeps its result."""
    seen: list[float] = []
    target = noisy(1)
    whole = fitted(1, [COLOR], target, progress=seen.append)
    assert whole.uncertainty and np.diff(seen).min() > -1e-9 and 0.85 < seen[-1] <= 1.0

    def stop(fraction: float) -> None:
        if fraction > 0.9:
            raise edgegrad.Cancelled

    cut = fitted(1, [COLOR], target, progress=stop, on_cancel="best")
    assert not cut.uncertainty
    np.testing.assert_array_equal(cut.values[COLOR], whole.values[COLOR])


def shortened(**options: Any) -> FitResult:
    """Four iterations, which bring a colour a part of the way."""
    start = small(**{COLOR.replace(".", "/"): np.array([0.3, 0.3, 0.3])})
    return edgegrad.fit(start, noisy(1), [COLOR], iterations=4, spp=32, seed=1, uncertainty=True, **options)


def test_a_fit_that_has_not_arrived_says_what_is_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a colour without Newton steps, and of one that has arrived."""
    need("native")
    truth = parameters.get(small(), COLOR)
    monkeypatch.setattr(newton_steps, "MOST_STEPS", 0)
    early = shortened()
    (one,) = early.uncertainty
    # The third channel is within its error by chance.
    away = (truth - early.values[COLOR])[:2]
    assert np.abs(away).min() > 5.0 * one.errors[:2].min()
    assert one.ahead[:2] == pytest.approx(away, abs=2.0 * one.errors[:2].max())
    assert "not arrived" in str(one)
    late = fitted(1, [COLOR]).uncertainty[0]
    assert late.ahead == (0.0, 0.0, 0.0) and "not arrived" not in str(late)


def test_a_fit_that_has_not_arrived_goes_on_by_newton_steps() -> None:
    need("native")
    result, seen = shortened(), list[float]()
    (one,) = result.uncertainty
    truth = parameters.get(small(), COLOR)
    assert (np.abs(result.values[COLOR] - truth) < 4.0 * one.errors).all() and "not arrived" not in str(one)
    assert result.best == len(result.losses) - 1 > 4
    shortened(progress=seen.append)
    assert np.diff(seen).min() > -1e-9 and seen[-1] <= 1.0


def test_few_samples_measure_a_fit_that_has_arrived(monkeypatch: pytest.MonkeyPatch) -> None:
    """More samples follow for one that has not, or where the few are in doubt."""
    need("native")
    works: list[float] = []

    def measure(*given: Any) -> measurement.Measurement:
        works.append(given[4] if len(given) > 4 else measurement.WORK)
        return measurement.measure(*given)

    monkeypatch.setattr(newton_steps, "FEWEST", 1)
    monkeypatch.setattr(newton_steps, "measure", measure)
    fitted(1, [COLOR])
    assert works == [measurement.FIRST_LOOK]
    works.clear()
    shortened()
    assert works[0] == measurement.FIRST_LOOK and len(works) > 2 and set(works[1:]) == {measurement.WORK}
    works.clear()
    monkeypatch.setattr(newton_steps, "DOUBT", 0.0)
    fitted(1, [COLOR])
    assert works == [measurement.FIRST_LOOK, measurement.WORK]


def test_what_is_ahead_of_an_arrived_number_is_less_than_a_part_of_a_step() -> None:
    """However small its error is."""
    one = coordinates.Coordinate("lights.lamp.power", "", 1.0, "", 0.5, 1.0, lambda view: {}, 0)
    solution = Solution(np.array([[1e-12]]), np.zeros((1, 0)), np.zeros(0, bool), np.array([0.004]), np.array([1e-6]),
                        1.0, 0.1)
    found = measurement.Measurement({}, [one], [], [], [], solution)
    assert not found.late(found.errors).any()
    further = replace(solution, ahead=np.array([0.006]))
    assert replace(found, solution=further).late(found.errors).all()


def test_newton_steps_keep_poses_rigid_and_numbers_within_limits() -> None:
    """Of an object that is far off, and of a white ball in less light than it has."""
    need("native")
    pose = "meshes.object.transform"
    target = 1.3 * edgegrad.render(small(**{COLOR.replace(".", "/"): np.array([1.0, 0.5, 0.4])}), spp=256)
    scene = small(**{pose.replace(".", "/"): np.eye(4) + 0.2 * np.eye(4)[[3, 3, 3, 3]].T * [[0.0, 0.0, 0.0, 1.0]]})
    result = edgegrad.fit(scene, target, [pose, COLOR], iterations=8, spp=8, seed=1, uncertainty=True)
    assert len(result.losses) > 9
    turn = result.values[pose][:3, :3]
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-6)
    assert result.values[COLOR].max() <= 1.0


def test_a_known_gain_changes_no_error() -> None:
    """Of a picture that is twice as bright as the scene."""
    need("native")
    one, two = (fitted(1, [COLOR], Target(gain * noisy(1), gain=gain)) for gain in (1.0, 2.0))
    assert np.array_equal(one.values[COLOR], two.values[COLOR])
    assert one.uncertainty[0].errors == pytest.approx(two.uncertainty[0].errors, rel=1e-6)


def test_many_numbers_are_told_together() -> None:
    names = tuple(f"vertex {k} x" for k in range(16))
    errors = np.array([0.01] * 8 + [0.04, *[np.inf] * 4, *[np.nan] * 3])
    one = Uncertainty("cage", names, ("m",) * 16, (1.0,) * 16, errors, (False,) * 16, (0.0, 0.2) + (0.0,) * 14)
    assert str(one) == (
        "'cage': standard error 0.01 m in the median of 9 numbers, 0.04 m at most (vertex 8 x); 4 of 16 (vertex 9 x …) "
        "are open, alone or together with others; 3 of 16 (vertex 13 x …) are lost in noise; 1 of 16 (vertex 1 x …) "
        "are not there yet; more iterations are needed")
    assert "vertex 4 x and 11 other numbers can be exchanged" in str(Exchange(names))


def test_entries_of_arrays_have_the_errors_of_single_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of three channels, which hardly depend on each other. With four random directions the logarithm of an error has a
    standard deviation of about sqrt(2 / 4) / 2."""
    need("native")
    ratios = []
    for seed in range(3):
        single = fitted(seed, [COLOR]).uncertainty[0].errors
        with monkeypatch.context() as patched:
            patched.setattr(coordinates, "MOST", 0)
            (one,) = fitted(seed, [COLOR]).uncertainty
        assert one.names == () and "as if all others were known" in str(one)
        ratios.append(np.log(one.errors / single))
    assert abs(np.mean(ratios)) < 4.0 * 0.5 * np.sqrt(2.0 / 4.0 / np.size(ratios))
