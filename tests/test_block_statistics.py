"""The comparison by block sums: right probabilities, and it does fail."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.support import block_statistics, shared_objects
from tests.support.block_statistics import (
    ALARM,
    STAGE_ALARM,
    SUITE_ALARM,
    block_sums,
    compare,
    half_width,
    mean_p_value,
    means_p_value,
)
from tests.support.distributions import chi_square_quantile, chi_square_tail, student_quantile, student_to_normal
from tests.support.small_scenes import camera


@pytest.mark.parametrize(
    ("x", "n", "tail"),
    # tables: 95 % and 99.9 % points
    [(3.841459, 1, 0.05), (18.307038, 10, 0.05), (29.588298, 10, 0.001), (124.342113, 100, 0.05), (77.9295, 100, 0.95)],
)
def test_chi_square_tail_matches_tables(x: float, n: int, tail: float) -> None:
    assert chi_square_tail(x, n) == pytest.approx(tail, rel=2e-6)


@pytest.mark.parametrize(
    ("t", "freedom", "tail"), [(6.313752, 1, 0.05), (1.859548, 8, 0.05), (4.500791, 8, 0.001), (1.959964, 1e9, 0.025)]
)
def test_student_deviates_match_tables(t: float, freedom: float, tail: float) -> None:
    z = student_to_normal(np.array([t, -t]), np.array([freedom, freedom]))
    assert 0.5 * math.erfc(z[0] / math.sqrt(2.0)) == pytest.approx(tail, rel=1e-5)
    assert z[1] == -z[0]


def test_block_sums_keep_the_total_of_uneven_pictures() -> None:
    image = np.random.default_rng(0).normal(size=(2, 19, 30, 3))
    sums = block_sums(image)
    assert sums.shape == (2, 3, 4, 3)
    assert sums[:, 0, 0] == pytest.approx(image[:, :8, :8].sum(axis=(1, 2)))
    assert sums.sum() == pytest.approx(image.sum())


def test_p_values_of_pure_noise_are_uniform() -> None:
    rng = np.random.default_rng(1)
    truth = rng.normal(size=(48, 48, 3))
    spread = np.exp(rng.normal(size=truth.shape))
    p = []
    for _ in range(100):
        samples = truth + spread * rng.normal(size=(4, 3, *truth.shape))
        reference = truth + 0.2 * spread * rng.normal(size=truth.shape)
        p.append(compare(samples, reference, 0.2 * spread).p_value)
    # Bonferroni over three independent channels: P(p < q) is about q, a bit less for large q.
    assert 20 <= sum(v < 0.3 for v in p) <= 42
    assert min(p) > 1e-4


def test_theta_dependence_is_not_noise() -> None:
    rng = np.random.default_rng(2)
    slope = np.linspace(-1.0, 1.0, 8)[:, None, None, None, None]
    samples = slope + 0.01 * rng.normal(size=(8, 2, 32, 32, 3))
    biased = compare(samples + 0.002, np.zeros((32, 32, 3)))
    assert compare(samples, np.zeros((32, 32, 3))).p_value > ALARM
    assert biased.p_value < ALARM


@pytest.mark.parametrize("bias", [1.5, -1.5])
def test_a_bias_in_one_block_alarms(bias: float) -> None:
    rng = np.random.default_rng(3)
    samples = rng.normal(size=(8, 2, 64, 64, 3))
    samples[..., 8:16, 24:32, 1] += bias
    outcome = compare(samples, np.zeros((64, 64, 3)))
    assert outcome.p_value < ALARM
    assert abs(outcome.z[1, 3, 1]) == np.abs(outcome.z).max()


def test_a_difference_without_noise_alarms() -> None:
    samples = np.zeros((2, 16, 16, 3))
    samples[..., :8, :8, :] = np.random.default_rng(4).normal(size=(2, 8, 8, 3))
    reference = np.zeros((16, 16, 3))
    assert compare(samples, reference).p_value > ALARM
    reference[12, 12] = 1.0
    assert compare(samples, reference).p_value == 0.0


def test_one_seed_is_refused() -> None:
    with pytest.raises(ValueError, match="one seed"):
        compare(np.zeros((8, 1, 8, 8, 3)), np.zeros((8, 8, 3)))


# ---------------------------------------------------------------- levels and power
@pytest.mark.parametrize(("tail", "n"), [(0.05, 1), (0.05, 100), (1e-7, 16)])
def test_quantiles_are_inverse_to_tails(tail: float, n: int) -> None:
    assert chi_square_tail(chi_square_quantile(tail, n), n) == pytest.approx(tail, rel=1e-6)
    z = float(student_to_normal(np.array(student_quantile(tail, n)), np.array(float(n))))
    assert math.erfc(z / math.sqrt(2.0)) == pytest.approx(tail, rel=1e-6)


def test_all_comparisons_together_have_the_level_of_the_suite() -> None:
    assert pytest.approx(SUITE_ALARM) == block_statistics.MOST_COMPARISONS * ALARM
    assert pytest.approx(ALARM) == STAGE_ALARM**2


def test_every_verdict_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(block_statistics.Count, "made", 0)
    block_statistics.check(0.5)
    with pytest.raises(AssertionError):
        block_statistics.check(0.5 * ALARM)
    assert block_statistics.Count.made == 2


def test_half_of_the_errors_that_are_said_to_be_noticed_raise_an_alarm() -> None:
    rng = np.random.default_rng(5)
    reference, level = np.abs(rng.normal(size=(32, 32, 3))) + 0.5, STAGE_ALARM
    noticed = compare(reference + rng.normal(size=(8, 8, 32, 32, 3)), reference).noticed(level)
    wrong = [compare((1.0 + noticed) * reference + rng.normal(size=(8, 8, 32, 32, 3)), reference) for _ in range(60)]
    # Of 60 fair coins less than 12 or more than 48 are heads with the probability 2e-6. Three channels take part.
    assert 12 <= sum(outcome.p_value < level for outcome in wrong) <= 58
    slight = [compare((1.0 + 0.25 * noticed) * reference + rng.normal(size=(8, 8, 32, 32, 3)), reference)
              for _ in range(60)]  # fmt: skip
    assert sum(outcome.p_value < level for outcome in slight) < 12


def test_p_values_of_means_are_uniform() -> None:
    rng = np.random.default_rng(6)
    one = [mean_p_value(rng.normal(2.0, 3.0, 5), 2.0) for _ in range(400)]
    two = [means_p_value(rng.normal(2.0, 3.0, 5), rng.normal(2.0, 1.0, 20)) for _ in range(400)]
    for p in (one, two):  # the number below 0.1 is binomial, with a standard deviation of 6
        assert abs(sum(v < 0.1 for v in p) - 40) < 5 * 6


def test_means_that_are_off_by_more_than_the_half_width_alarm() -> None:
    samples = np.random.default_rng(7).normal(size=(12, 4))
    off = 1.01 * half_width(samples)
    assert mean_p_value(samples, samples.mean(axis=0) + off) < ALARM
    assert mean_p_value(samples, samples.mean(axis=0) + 0.98 * off) > ALARM
    assert mean_p_value(samples, samples.mean(axis=0) + off, rounding=off) == 1.0
    assert mean_p_value(np.ones(5), 1.5) == 0.0


# ---------------------------------------------------------------- what tests share
SHARED = {"views": [camera()]}


def test_a_change_of_something_shared_is_named() -> None:
    before = shared_objects.fingerprints()
    assert shared_objects.changes(before, shared_objects.fingerprints()) == []
    view = SHARED["views"][0]
    width, view.width = view.width, 7
    assert shared_objects.changes(before, shared_objects.fingerprints()) == [f"{__name__}.SHARED['views'][0]"]
    view.width = width
    view.to_world[0, 3] += 1.0
    assert len(shared_objects.changes(before, shared_objects.fingerprints())) == 1
    view.to_world[0, 3] -= 1.0
    assert shared_objects.changes(before, shared_objects.fingerprints()) == []
