"""Errors of derivatives stay within noise and rounding, however hard a scene is."""

from __future__ import annotations

import pytest

from tests.stability.stresses import STRESSES, Stress
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
    # Four standard errors: samples with heavy tails need as many seeds as there are for them to be told.
    assert error <= 4.0 * noise + stress.rounding(value), (error, noise)
