"""How fits end: by cancelling, by errors, and by being refused."""

from __future__ import annotations

import copy
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad.fitting.fit_step import FitStep
from edgegrad.fitting.scene_fit import fit
from edgegrad.fitting.targets import Target
from tests.support.fits import COLOR, VERTICES, ball, picture, same, state


def cancel_by_false(step: FitStep) -> bool:
    return step.iteration < 6


def cancel_by_error(step: FitStep) -> None:
    if step.iteration == 6:
        raise edgegrad.Cancelled


@pytest.mark.parametrize("callback", [cancel_by_false, cancel_by_error])
@pytest.mark.parametrize("on_cancel", ["restore", "best"])
def test_cancelling(callback: Callable[[FitStep], bool | None], on_cancel: str) -> None:
    truth, scene = ball(1.2), ball()
    before = state(scene)
    result = fit(
        scene, Target(picture(truth)), [VERTICES, COLOR], iterations=50, spp=2, callback=callback, on_cancel=on_cancel
    )
    assert result.cancelled and len(result.losses) == 6
    after = state(scene)
    if on_cancel == "restore":
        assert same(before, after)
        np.testing.assert_array_equal(result.values[VERTICES], before[VERTICES])
    else:
        assert result.best > 0 and not np.array_equal(after[VERTICES], before[VERTICES])
        np.testing.assert_array_equal(result.values[VERTICES], after[VERTICES])


@pytest.mark.parametrize("answer", ["restore", "best"])
def test_the_callback_may_choose_how_it_ends(answer: str) -> None:
    scene = ball()
    before = state(scene)
    target = Target(picture(ball(1.2)))
    other = "best" if answer == "restore" else "restore"
    fit(
        scene, target, [VERTICES], iterations=50, spp=2, on_cancel=other,
        callback=lambda step: answer if step.iteration == 5 else None,
    )
    assert same(before, state(scene)) == (answer == "restore")


def test_progress_runs_from_0_to_1_and_can_cancel() -> None:
    scene = ball()
    seen: list[float] = []
    fit(scene, Target(np.zeros((24, 32, 3))), [COLOR], iterations=3, spp=2, progress=seen.append)
    assert seen == sorted(seen) and 0.0 <= seen[0] < 0.3 and 0.9 < seen[-1] <= 1.0

    def stop(fraction: float) -> None:
        if fraction > 0.4:
            raise edgegrad.Cancelled

    before = state(scene)
    assert fit(scene, Target(np.zeros((24, 32, 3))), [COLOR], iterations=3, spp=2, progress=stop).cancelled
    assert same(before, state(scene))


def test_the_scene_is_untouched_while_a_fit_runs_and_after_an_error() -> None:
    scene = ball()
    before = state(scene)

    def fail(step: FitStep) -> None:
        assert same(before, state(scene))
        assert not np.array_equal(step.values[VERTICES], before[VERTICES])
        if step.iteration == 2:
            raise RuntimeError("full disk")

    with pytest.raises(RuntimeError, match="full disk"):
        fit(scene, Target(np.zeros((24, 32, 3))), [VERTICES], iterations=5, spp=2, callback=fail, on_cancel="best")
    assert same(before, state(scene))


def test_callback_is_told_what_happens() -> None:
    steps: list[FitStep] = []
    result = fit(ball(), Target(np.zeros((24, 32, 3))), [COLOR], iterations=4, spp=2, callback=steps.append)
    assert [s.iteration for s in steps] == [1, 2, 3, 4] and {s.iterations for s in steps} == {4}
    assert [s.loss for s in steps] == result.losses[:4]
    assert all(a.seconds <= b.seconds for a, b in pairwise(steps))
    assert steps[-1].smoothed == pytest.approx(np.mean(result.losses[:4]))


def test_non_finite_gradients_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = ball()
    before = state(scene)

    def broken(self: edgegrad.Renderer, adjoint: Any, wrt: Any, **options: Any) -> dict[str, np.ndarray]:
        gradient = np.zeros_like(scene.meshes["object"].vertices)
        gradient[3, 1] = np.nan
        return {VERTICES: gradient}

    monkeypatch.setattr(edgegrad.Renderer, "render_backward", broken)
    with pytest.raises(FloatingPointError, match=rf"the gradient of '{VERTICES}' is not finite at \(3, 1\)"):
        fit(scene, Target(np.zeros((24, 32, 3))), [VERTICES], iterations=2, spp=1)
    assert same(before, state(scene))


GOOD = Target(np.zeros((24, 32, 3)))
BAD: dict[str, tuple[dict[str, Any], str]] = {
    "size": ({"targets": Target(np.zeros((32, 32, 3)))}, r"target 0: image is 32 x 32 pixels, but .* is 32 x 24"),
    "second": ({"targets": [GOOD, Target(np.zeros((24, 32, 2)))]}, r"target 1: image must have the shape"),
    "nan": ({"targets": Target(np.full((24, 32, 3), np.nan))}, r"target 0: image has 2304 non-finite values"),
    "mask": ({"targets": Target(np.zeros((24, 32, 3)), mask=np.ones((32, 24)))}, r"target 0: mask is 24 x 32 pix"),
    "no mask": ({"targets": Target(np.zeros((24, 32, 3)), mask=np.zeros((24, 32)))}, r"target 0: mask is 0 everywhere"),
    "gain": ({"targets": Target(np.zeros((24, 32, 3)), gain=0.0)}, r"target 0: gain must be above 0, not 0"),
    "gain's name": ({"targets": Target(np.zeros((24, 32, 3)), gain="auto")}, r"target 0: gain must be .*'exposure'"),
    "gain over the world": ({"targets": Target(np.zeros((24, 32, 4)), gain="exposure")}, r"target 0: .*alpha='mask'"),
    "alpha": ({"targets": Target(np.zeros((24, 32, 4)), alpha="mask")}, r"target 0: image has no opaque pixel"),
    "silhouette": ({"targets": Target(np.zeros((24, 32)))}, r"target 0: .*needs the names of its objects"),
    "of nothing": ({"targets": Target(np.zeros((24, 32)), objects=["ball"])}, r"target 0: objects names 'ball', but"),
    "too bright": ({"targets": Target(np.full((24, 32), 255.0), objects=["object"])}, r"target 0: .*above 1, but"),
    "weight": ({"targets": Target(np.zeros((24, 32, 3)), weight=0.0)}, r"target 0: weight must be above 0"),
    "camera": ({"targets": Target(np.zeros((24, 32, 3)), camera="front")}, r"target 0: camera must be"),  # type: ignore[arg-type]
    "text": ({"targets": ["front.exr"]}, r"target 0: must be an edgegrad.Target or a picture, not 'front.exr'"),
    "no target": ({"targets": []}, r"there is no target"),
    "empty": ({"wrt": []}, r"wrt is empty"),
    "string": ({"wrt": COLOR}, r"wrt must be a list"),
    "twice": ({"wrt": [COLOR, COLOR]}, r"wrt names .* more than once"),
    "unknown": ({"wrt": ["meshes.cube.vertices"]}, r"there is no 'cube' in meshes"),
    "no derivative": ({"wrt": ["camera.clip_end"]}, r"'camera.clip_end' has no derivative"),
    "camera path": ({"wrt": ["camera.width"]}, r"'width' is not one of the fields"),
    "iterations": ({"iterations": 0}, r"iterations must be between 1"),
    "spp": ({"spp": 0}, r"spp must be between 1"),
    "views": ({"views_per_iteration": 2}, r"views_per_iteration must be between 1 and 1"),
    "seed": ({"seed": -1}, r"seed must be between 0"),
    "smoothness": ({"smoothness": -1.0}, r"smoothness must not be below 0"),
    "slide": ({"slide": 1.5}, r"slide must not be above 1"),
    "step path": ({"step_sizes": {VERTICES: 0.1}}, r"step_sizes names 'meshes.object.vertices', which is not in wrt"),
    "step": ({"step_sizes": {COLOR: 0.0}}, r"step size of 'materials.clay.base_color' must be above 0"),
    "on_cancel": ({"on_cancel": "keep"}, r"on_cancel must be one of restore, best"),
    "depth": ({"max_depth": 0}, r"max_depth must be between 1"),
    "engine": ({"engine": "gpu"}, r"engine must be"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_refused_before_anything_is_rendered(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def never(self: edgegrad.Renderer, **options: Any) -> None:
        raise AssertionError("rendered")

    monkeypatch.setattr(edgegrad.Renderer, "render", never)
    changes, message = BAD[name]
    scene = ball()
    before = copy.deepcopy(state(scene))
    arguments: dict[str, Any] = {"targets": GOOD, "wrt": [COLOR], "iterations": 1, "spp": 1} | changes
    with pytest.raises(ValueError, match=message):
        fit(scene, **arguments)
    assert same(before, state(scene))
