"""Films: each frame has its own values of the keyed parameters, and the others have one value for all frames."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Film, Scene, SpotLight, Target
from edgegrad.fitting.film.film_schedule import FilmSchedule
from edgegrad.fitting.film.keyed import KeyedNumbers, prior_gradient
from edgegrad.fitting.film.keyed_parameters import KeyedParameters
from edgegrad.fitting.rigid_variables import rotations
from edgegrad.fitting.schedule import Start
from tests.support import shapes
from tests.support.fits import COLOR, same, state

POSE = "meshes.object.transform"


def block(size: tuple[int, int] = (32, 24)) -> Scene:
    vertices, faces = shapes.cube()
    scene = shapes.scene(vertices * (0.5, 0.35, 0.25), faces)
    scene.camera = shapes.camera(size=size, fov_x=0.6)
    return scene


def moved(part: float) -> np.ndarray:
    """The pose at a part of the film, which is no straight motion."""
    out = np.eye(4)
    out[:3, :3] = rotations(np.array([0.15 * np.sin(5.0 * part), 0.2 * part, 0.5 * part]))
    out[:3, 3] = (-0.5 + part, 0.1 * np.sin(3.0 * part), 0.1 * np.sin(4.0 * part))
    return out


def film_of(count: int, size: tuple[int, int] = (32, 24), length: float = 1.0
            ) -> tuple[Scene, list[Target], np.ndarray]:  # fmt: skip
    """A scene with the pose of the first frame, the pictures of the film, and the true poses."""
    scene, targets = block(size), []
    poses = np.array([moved(length * k / max(count - 1, 1)) for k in range(count)])
    for k, pose in enumerate(poses):
        scene.meshes["object"].transform = pose
        targets.append(Target(edgegrad.render(scene, spp=64, seed=1000 + k)))
    scene.meshes["object"].transform = poses[0]
    return scene, targets, poses


def errors(found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """Largest distance of the places, and largest angle between the rotations, radians."""
    turn = np.einsum("kji,kjl->kil", found[:, :3, :3], true[:, :3, :3])
    angle = np.arccos(np.clip(0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0), -1.0, 1.0))
    return float(np.linalg.norm(found[:, :3, 3] - true[:, :3, 3], axis=1).max()), float(angle.max())


def test_a_moving_block_and_its_colour_are_found() -> None:
    """The colour is that of all frames; poses differ from frame to frame."""
    scene, targets, poses = film_of(7)
    true_color = scene.materials["clay"].base_color.copy()
    scene.materials["clay"].base_color = true_color * 0.7
    film = Film(range(7), [POSE], first_every=3)
    result = edgegrad.fit(scene, targets, [COLOR], iterations=160, spp=4, film=film)
    before, after = errors(np.repeat(poses[:1], 7, axis=0), poses), errors(result.values[POSE], poses)
    assert before[0] > 1.0 and before[1] > 0.5
    assert after[0] < 0.1 and after[1] < 0.08  # most of it in depth
    np.testing.assert_allclose(scene.materials["clay"].base_color, true_color, atol=0.02)
    assert np.array_equal(scene.meshes["object"].transform, poses[0]), "the scene keeps the value of no frame"


def test_a_moving_camera_is_found() -> None:
    scene = block()
    poses, targets = [], []
    start = scene.camera.to_world.copy()
    for k in range(3):
        scene.camera.to_world = start.copy()
        scene.camera.to_world[:3, 3] += (0.15 * k, 0.0, 0.1 * k)
        poses.append(scene.camera.to_world)
        targets.append(Target(edgegrad.render(scene, spp=64, seed=k)))
    scene.camera.to_world = start
    result = edgegrad.fit(scene, targets, [], iterations=120, spp=4,
                          film=Film([0, 1, 2], ["camera.to_world"], first_every=1))  # fmt: skip
    def apart(places: Any) -> float:
        """Mean distance of pictures from these places to the targets."""
        found = []
        for place, target in zip(places, targets, strict=True):
            scene.camera.to_world = place
            found.append(np.abs(edgegrad.render(scene, spp=64, seed=9) - target.image).mean())
        return float(np.mean(found))

    # A move and a turn of the camera look much alike, so poses may differ where pictures do not.
    noise, before = apart(poses), apart([start] * 3)
    assert apart(result.values["camera.to_world"]) - noise < 0.05 * (before - noise)


@pytest.mark.parametrize("stop", [3, 9, 17, 22])
def test_a_resumed_film_has_the_same_bits(stop: int, tmp_path: Path) -> None:
    path = tmp_path / "film.npz"

    def run(**options: Any) -> tuple[Scene, edgegrad.FitResult]:
        scene, targets, _ = film_of(5, (12, 9))
        return scene, edgegrad.fit(scene, targets, [COLOR], iterations=8, spp=1, views_per_iteration=2,
                                   film=Film(range(5), [POSE], first_every=2), **options)  # fmt: skip

    expected_scene, expected = run()
    assert len(expected.losses) > 23
    run(checkpoint=path, callback=lambda step: "restore" if step.iteration == stop else None)
    scene, resumed = run(checkpoint=path, resume=True)
    assert resumed.losses == expected.losses and resumed.best == expected.best
    assert same(state(scene), state(expected_scene)) and same(resumed.values, expected.values)


def test_progress_counts_frames_and_never_falls() -> None:
    """An iteration of all frames is as long as one of each of them."""
    scene, targets, _ = film_of(9, (12, 9))
    seen: list[float] = []
    ends: list[float] = []
    edgegrad.fit(scene, targets, [COLOR], iterations=8, spp=1, film=Film(range(9), [POSE], first_every=4),
                 progress=seen.append, callback=lambda _: ends.append(seen[-1]), uncertainty=False)  # fmt: skip
    assert seen == sorted(seen) and seen[-1] == pytest.approx(1.0)
    steps = np.diff(ends)
    assert steps[-1] == pytest.approx(9.0 * steps[0], rel=1e-3)


def test_every_frame_gets_its_turns_and_starts_from_its_neighbours() -> None:
    schedule = FilmSchedule(list(range(11)), 4, 8, 2, 0)
    turns = [schedule.turn(k) for k in range(schedule.iterations)]
    first = {frame: k for k, turn in reversed(list(enumerate(turns))) for frame in turn.views}
    assert sorted(first) == list(range(11)) and first[0] == 0
    assert first[0] < first[4] < first[8] < first[10] < first[2] < first[1]
    begun = {start.frame: start for turn in turns[8 + 3 * 6 :] for way in turn.starts[:1] for start in way}
    assert begun[2] == Start(2, 0, 4, 0.5) and begun[9] == Start(9, 8, 10, 0.5)
    counts = np.bincount([frame for turn in turns for frame in turn.views])
    assert counts.min() >= 4 and max(turn.factor for turn in turns) == 1.0


def test_frames_begin_with_the_changes_of_their_neighbours() -> None:
    """A motion that was keyed before stays, and limits hold."""
    keyed = np.array([[0.0], [1.0], [4.0]])
    one = KeyedNumbers("x", keyed, np.ones((3, 1)), np.full((3, 1), -10.0), np.full((3, 1), 5.0))
    now = keyed + [[2.0], [0.0], [4.0]]
    np.testing.assert_allclose(one.started(now, [Start(1, 0, 2, 0.25)]), [[2.0], [1.0 + 2.5], [5.0]])


def test_the_prior_is_the_gradient_of_squared_second_differences() -> None:
    random = np.random.default_rng(0)
    times, known, weight = [1, 2, 4, 5, 9], [0, 1, 2, 4], 0.3
    one = KeyedNumbers("x", random.normal(size=(5, 2)), random.uniform(0.5, 2.0, (5, 2)), np.full((5, 2), -np.inf),
                       np.full((5, 2), np.inf))  # fmt: skip

    def prior(value: np.ndarray) -> float:
        total = 0.0
        for a, b, c in zip(known, known[1:], known[2:], strict=False):
            fit = [np.polyfit([times[k] for k in (a, b, c)], value[[a, b, c], n] / one.steps[0, n], 2)[0]
                   for n in range(2)]  # fmt: skip
            total += weight * sum((2.0 * curve) ** 2 for curve in fit)
        return total

    one.steps[:] = one.steps[0]
    found = prior_gradient(one, times, known, weight)
    for at in np.ndindex(5, 2):
        step = np.zeros((5, 2))
        step[at] = 1e-4
        expected = (prior(one.value + step) - prior(one.value - step)) / 2e-4
        np.testing.assert_allclose(found[at], expected, rtol=1e-6, atol=1e-9)


def test_the_prior_smooths_what_pictures_do_not_determine() -> None:
    """A frame whose pixels are all ignored lies between its neighbours."""
    scene, targets, poses = film_of(3, length=0.4)
    targets[1].mask = np.zeros((24, 32))
    targets[1].mask[0, 0] = 1.0
    result = edgegrad.fit(scene, targets, [], iterations=120, spp=4, film=Film(range(3), [POSE], 0.01, 2))
    found, middle = result.values[POSE], 0.5 * (poses[0, :3, 3] + poses[2, :3, 3])
    assert np.linalg.norm(found[1, :3, 3] - 0.5 * (found[0, :3, 3] + found[2, :3, 3])) < 0.01
    assert np.linalg.norm(found[1, :3, 3] - middle) < 0.06


def test_poses_are_pulled_back_by_their_derivative() -> None:
    scene, film = block(), Film([1, 2], [POSE])
    scene.meshes["object"].transform = moved(0.7)
    keyed, random = KeyedParameters(scene, film), np.random.default_rng(1)
    numbers, gradient = random.normal(size=(2, 6)), random.normal(size=(4, 4))
    pulled = keyed.place({POSE: numbers}).pull({POSE: gradient}, 1)[POSE]
    assert not pulled[0].any()
    for k in range(6):
        step = np.zeros(6)
        step[k] = 1e-6
        slope = (keyed.value(POSE, numbers[1] + step) - keyed.value(POSE, numbers[1] - step)) / 2e-6
        np.testing.assert_allclose(pulled[1, k], np.vdot(gradient, slope), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize(("film", "wrt", "says"), [
    (Film([1], [POSE]), [], "frames has 1 frames, but there are 2 targets"),
    (Film([1, 2.5], [POSE]), [], r"frames\[1\]"),  # type: ignore[list-item]
    (Film([1, 2], [POSE]), [POSE], "keyed and in wrt"),
    (Film([1, 2], ["meshes.object.vertices"]), [], "can't be keyed"),
    (Film([1, 2], ["lights.lamp.position"]), [], "can't be keyed"),
    (Film([1, 2], ["lights.spot.across"]), [], "can't be keyed"),
    (Film([1, 2]), [], "no keyed parameter"),
    (Film([1, 2], [POSE], -1.0), [], "smoothness"),
])  # fmt: skip
def test_wrong_films_are_refused(film: Film, wrt: list[str], says: str) -> None:
    scene, targets, _ = film_of(2, (8, 6))
    down, across = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
    scene.lights["spot"] = SpotLight(np.array([0.0, 0.0, 5.0]), down, 10.0, 0.9, 0.3, across=across)
    with pytest.raises(ValueError, match=says):
        edgegrad.fit(scene, targets, wrt, iterations=1, film=film)
