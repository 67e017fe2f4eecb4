"""Errors of derivatives stay within noise and rounding as scenes get hard."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.stability.stresses import SEEDS, STRESSES, Stress
from tests.support.block_statistics import check
from tests.support.distributions import student_to_normal, two_sided
from tests.support.picture_differences import need_every_table

CASES = [
    pytest.param(stress, value, id=f"{stress.name}, {value:.3g}",
                 marks=() if value == stress.values[-1] else pytest.mark.slow)
    for stress in STRESSES for value in stress.values
]  # fmt: skip


@pytest.mark.parametrize(("stress", "value"), CASES)
def test_errors_are_those_of_noise_and_rounding(stress: Stress, value: float) -> None:
    need_every_table()
    error, noise = stress.error(value)
    # The error is the length of a vector, with the root of the sum of its variances as noise. Of all vectors of such a
    # noise those of one component are the most often far off: Student's distribution bounds the probability.
    beyond = max(error - stress.rounding(value), 0.0)
    t = beyond / noise if noise > 0.0 else (math.inf if beyond > 0.0 else 0.0)
    check(two_sided(float(student_to_normal(np.array(t), np.array(SEEDS - 1.0)))))
