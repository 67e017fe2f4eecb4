"""What needs no Blender data: curve, trend, times, qualities, and jobs in threads."""



from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon import quality
from edgegrad_addon.panel.words import lines
from edgegrad_addon.problem import sentence, spelt
from edgegrad_addon.running.curve import BACK, LINE, curve
from edgegrad_addon.running.fit_job import duration, trend
from edgegrad_addon.running.job import BEST, RESTORE, Job
from edgegrad_addon.running.overlay import edges_of


def drawn(losses: Any, width: int = 40, height: int = 30) -> Any:
    """Mean row of the line in each column; NaN where there is none."""
    picture = curve(losses, width, height)
    assert picture.shape == (height, width, 4)
    line = (picture == np.float32(LINE)).all(axis=2)
    assert ((picture == np.float32(BACK)).all(axis=2) | line).all()
    with np.errstate(invalid="ignore"):
        return (line * np.arange(height)[:, None]).sum(axis=0) / line.sum(axis=0)


def test_the_curve_falls_with_the_logarithm_of_the_loss() -> None:
    rows = drawn(np.exp(-0.1 * np.arange(40)))
    assert rows[0] > 25 and rows[-1] < 4
    assert np.allclose(np.diff(rows), np.diff(rows).mean(), atol=0.8)  # a straight line


def test_the_curve_is_whole_and_bears_what_cannot_be_drawn() -> None:
    # Neighbouring columns touch.
    steep = (curve([1.0, 1e-6, 1.0], 8, 200) == np.float32(LINE)).all(axis=2)
    assert all((one & other).any() for one, other in zip(steep.T, steep.T[1:], strict=False))
    assert np.isfinite(drawn([1.0])).all() and np.isfinite(drawn([1.0, np.nan, 0.0, 2.0])).all()
    assert np.isnan(drawn([])).all() and np.isnan(drawn([0.0, np.inf])).all()


def test_the_trend_compares_means() -> None:
    falling = list(np.exp(-0.1 * np.arange(40)))
    noisy = [1.0 + 0.001 * (-1) ** k for k in range(40)]
    assert [trend(one) for one in (falling, falling[::-1], noisy, [1.0], [])] == ["↓", "↑", "→", "", ""]


@pytest.mark.parametrize(("seconds", "text"), [(0.123, "0.12 s"), (12.3, "12 s"), (100.0, "2 min"), (7200.0, "2.0 h")])
def test_times_read_well(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_qualities_are_known_by_their_numbers() -> None:
    settings = SimpleNamespace(iterations=0, samples=0, views_per_iteration=0, targets=[1, 2])
    for k, name in enumerate(quality.QUALITIES):
        quality.put(settings, k)
        if name != quality.CUSTOM:
            assert quality.get(settings) == k
    settings.samples += 1
    assert list(quality.QUALITIES)[quality.get(settings)] == quality.CUSTOM
    settings.iterations, settings.samples, settings.views_per_iteration = 100, 10, 5
    assert quality.time_to_go(settings, 0.01) == "about 20 s"  # two pictures, not five
    assert quality.time_to_go(settings, 0.0) == ""


def endless(job: Job) -> str:
    while job.ending != BEST:
        job.check(0.5)
        job.wait_while_paused()
        time.sleep(0.001)
    return "best"


def test_a_job_pauses_and_ends_as_asked() -> None:
    job = Job("Work", endless).start()
    job.pause(True)
    job.end(BEST)  # also ends the pause
    job.wait()
    assert job.result == "best" and job.error is None and job.ending == BEST
    job = Job("Work", endless).start()
    job.end(RESTORE, "something changed")
    job.end(BEST)  # too late
    job.wait()
    assert job.result is None and job.error is None and (job.ending, job.reason) == (RESTORE, "something changed")


def test_an_error_in_a_job_is_kept() -> None:
    def broken(_: Job) -> None:
        raise ValueError("no")

    job = Job("Work", broken).start()
    job.wait()
    assert str(job.error) == "no"


def test_each_edge_is_drawn_once() -> None:
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    assert edges_of(faces).tolist() == [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]


def test_sentences_begin_with_a_capital_letter_but_names_of_the_code_and_quotes_do_not() -> None:
    for text in ("object 'Cube': has no faces", "non-finite values", "the camera's colour"):
        assert sentence(text) == text[0].upper() + spelt(text)[1:]
    for text in ("max_depth: must be positive", "'cube' has no faces", "Sample 3 of 4", "2 lights", "x.exr: none", ""):
        assert sentence(text) == text


def test_sentences_are_spelt_as_blender_does() -> None:
    assert spelt("Colours of 'My colour' and a colour's name") == "Colors of 'My colour' and a color's name"
    assert spelt("can't read the centre of 'My colour', whose neighbours are grey") == (
        "can't read the center of 'My colour', whose neighbors are gray")  # fmt: skip


def test_lines_end_neither_within_a_size_nor_before_a_unit() -> None:
    said = "Colours of 1920 × 1080 pixels, in 12 s or 3 min, as in 'colour 1'"
    for width in range(12, len(said)):
        found = lines(said, width)
        assert " ".join(found) == said.replace("Colours", "Colors")
        assert all(len(line) <= width for line in found)
        for whole in ("1920 × 1080", "12 s", "3 min"):
            assert any(whole in line for line in found), (width, found)
