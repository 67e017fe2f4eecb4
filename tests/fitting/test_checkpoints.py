"""Checkpoints: resumed fits end with the same bits; checkpoints of other fits and damaged files are refused by name."""

from __future__ import annotations

import errno
import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import FieldSteps, Scene, Target, read_checkpoint
from edgegrad import expression as e
from edgegrad.fitting.checkpoints import checkpoint_file
from edgegrad.fitting.fit_step import FitStep
from tests.fitting.killed_fits import kill_fits
from tests.support import shapes
from tests.support.fields.splines import sampled
from tests.support.fits import COLOR, POWER, VERTICES, ball, picture, same, state

ITERATIONS = 12


def textured() -> Scene:
    scene = ball()
    places = np.random.default_rng(0).uniform(0.0, 1.0, (len(scene.meshes["object"].faces), 3, 2))
    scene.meshes["object"].attributes = {"UVMap": places.astype(np.float32)}
    scene.images = {"paint": edgegrad.Image(np.full((4, 4, 3), 0.4, np.float32))}
    scene.materials["clay"].textures = {"base_color": e.ImageTexture("paint", e.Attribute("UVMap"))}
    return scene


def with_field() -> Scene:
    scene = shapes.scene(*shapes.cube())
    scene.fields = {"ball": sampled(lambda p: np.linalg.norm(p, axis=-1) - 0.5, 19)}
    scene.fields["ball"].transform[:3, 3] = (0.0, 0.0, 2.0)
    return scene


# Scene and parameters; together, steps of all kinds of variables.
CASES: dict[str, tuple[Any, list[str], dict[str, Any]]] = {
    "vertices, colour and power": (ball, [VERTICES, COLOR, POWER], {}),
    "poses": (ball, ["meshes.object.transform", "camera.to_world"], {}),
    "positions": (ball, ["lights.lamp.position", VERTICES], {"views_per_iteration": 1}),
    "texels": (textured, ["images.paint.pixels"], {}),
    "a field": (with_field, ["fields.ball.values"], {"field_steps": FieldSteps(coarser=1, redistance_every=3)}),
    "topological steps": (with_field, ["fields.ball.values"], {"field_steps": FieldSteps(topology_every=2)}),
    "unknown exposures": (ball, [VERTICES, COLOR], {"targets": {"gain": "exposure", "shared": "roll"}}),
    "a search": (ball, ["meshes.object.transform", COLOR], {"search": 12}),
    "several starts": (ball, ["lights.lamp.position", COLOR], {"search": 8, "restarts": 1}),
    "Newton steps": (ball, ["meshes.object.transform", COLOR], {"uncertainty": True}),
    "a silhouette": (ball, [VERTICES, COLOR], {"targets": {"objects": ["object"]}}),
}


def run(case: str, **options: Any) -> tuple[Scene, edgegrad.FitResult]:
    make, wrt, more = CASES[case]
    scene = make()
    seen = picture(scene) * 0.8
    first, more = Target(seen), dict(more)
    described = more.pop("targets", {})
    if "objects" in described:
        first = Target((seen.mean(axis=2) > 0.1).astype(np.float32), **described)
    elif described:
        first = Target(seen, **described)
    other = Target(seen * 0.9, weight=2.0)
    return scene, edgegrad.fit(scene, [first, other], wrt, iterations=ITERATIONS, spp=2, **more, **options)


def stop_at(iteration: int) -> Any:
    return lambda step: "restore" if step.iteration == iteration else None


@pytest.mark.filterwarnings("ignore:fit. no gradient")
@pytest.mark.parametrize("case", CASES)
def test_a_resumed_fit_has_the_same_bits(case: str, tmp_path: Path) -> None:
    path = tmp_path / "fit.npz"
    expected_scene, expected = run(case)
    for stop in (1, 5, ITERATIONS - 1, ITERATIONS):
        path.unlink(missing_ok=True)
        scene, broken_off = run(case, checkpoint=path, callback=stop_at(stop))
        assert broken_off.cancelled and len(broken_off.losses) == stop
        scene, resumed = run(case, checkpoint=path, resume=True)
        assert resumed.losses == expected.losses and resumed.best == expected.best
        assert same(state(scene), state(expected_scene)) and resumed.untouched == expected.untouched
        assert resumed.notes == expected.notes
        assert str(resumed.uncertainty) == str(expected.uncertainty)
    # A finished fit is not run again.
    steps: list[FitStep] = []
    assert run(case, checkpoint=path, resume=True, callback=steps.append)[1].losses == expected.losses and not steps
    if case == "Newton steps":
        assert len(expected.losses) > ITERATIONS + 1


def test_the_best_values_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "fit.npz"
    _, result = run("vertices, colour and power", checkpoint=path, checkpoint_every=5)
    found = read_checkpoint(path)
    assert (found.iteration, found.iterations, found.best) == (ITERATIONS, ITERATIONS, result.best)
    assert found.losses == result.losses and isinstance(found.values[POWER], float)
    assert same(found.values, result.values)


def test_without_a_checkpoint_there_the_fit_begins_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "fit.npz"
    _, result = run("positions", checkpoint=path, resume=True)
    assert str(path) in result.notes[0] and path.exists()


def bigger(scene: Scene) -> None:
    scene.meshes["object"].vertices = scene.meshes["object"].vertices * 1.01


def renamed(scene: Scene) -> None:
    scene.materials = {"wax": scene.materials["clay"]}
    scene.meshes["object"].materials = ("wax",)


OTHER: dict[str, tuple[Any, Any, dict[str, Any], str]] = {
    "mesh": (bigger, None, {}, "mesh 'object' differs"),
    "names": (renamed, None, {"wrt": [VERTICES]}, "there is no material 'clay' now"),
    "parameters": (None, None, {"wrt": [VERTICES]}, "wrt was"),
    "target": (None, 0.7, {}, "the picture of target 0 differs"),
    "iterations": (None, None, {"iterations": 9}, "iterations was 4 and is 9"),
    "seed": (None, None, {"seed": 3}, "seed was 0 and is 3"),
    "loss": (None, None, {"loss": edgegrad.losses.l2}, "the loss differs"),
}


@pytest.mark.parametrize("name", OTHER)
def test_checkpoints_of_other_fits_are_refused_by_name(name: str, tmp_path: Path) -> None:
    change, level, options, words = OTHER[name]
    path = tmp_path / "fit.npz"
    scene = ball()
    target = picture(scene)
    plain: dict[str, Any] = {"wrt": [VERTICES, COLOR], "iterations": 4, "spp": 1, "checkpoint": path}
    edgegrad.fit(scene, Target(target), **plain)
    content = path.read_bytes()
    scene = ball()
    if change is not None:
        change(scene)
    before = state(scene)
    with pytest.raises(ValueError) as caught:
        edgegrad.fit(scene, Target(target * (level or 1.0)), **(plain | options), resume=True)
    assert str(path) in str(caught.value) and words in str(caught.value)
    assert path.read_bytes() == content and same(before, state(scene))


def test_options_with_long_texts_are_named_by_what_differs(tmp_path: Path) -> None:
    scene, path = ball(), tmp_path / "fit.npz"
    options: dict[str, Any] = {"wrt": [COLOR], "iterations": 2, "spp": 1, "checkpoint": path}
    target = Target(picture(scene))
    edgegrad.fit(ball(), target, **options, bounces=edgegrad.Bounces(glossy=2))
    for bounces, words in ((edgegrad.Bounces(glossy=2, filter_glossy=1.0), ("filter_glossy=0.0", "filter_glossy=1.0")),
                           (edgegrad.Bounces(glossy=3), ("glossy=2", "glossy=3"))):  # fmt: skip
        with pytest.raises(ValueError, match="bounces was") as caught:
            edgegrad.fit(ball(), target, **options, bounces=bounces, resume=True)
        assert all(word in str(caught.value) for word in words)


def archive(path: Path, **parts: Any) -> None:
    with path.open("wb") as file:
        np.savez(file, **parts)


def told(**content: Any) -> Any:
    return np.frombuffer(json.dumps(content).encode(), np.uint8)


BROKEN: dict[str, Any] = {
    "half a file": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "empty": lambda path: path.write_bytes(b""),
    "text": lambda path: path.write_text("no checkpoint"),
    "pickle": lambda path: path.write_bytes(pickle.dumps({"state": {}})),
    "pickled array": lambda path: archive(path, state=np.array([{"format": "edgegrad fit"}], object)),
    "other archive": lambda path: archive(path, values=np.zeros(3)),
    "other format": lambda path: archive(path, state=told(format="else", version=1, tree={})),
    "later version": lambda path: archive(path, state=told(format="edgegrad fit", version=99, tree={})),
    "no state": lambda path: archive(path, state=told(format="edgegrad fit", version=1, tree={"iterations": 4})),
    "missing array": lambda path: archive(path, state=told(format="edgegrad fit", version=1, tree={"array": "a7"})),
}


@pytest.mark.parametrize("name", BROKEN)
def test_damaged_files_are_refused_by_name(name: str, tmp_path: Path) -> None:
    path = tmp_path / "fit.npz"
    run("positions", checkpoint=path)
    BROKEN[name](path)
    for read in (lambda: read_checkpoint(path), lambda: run("positions", checkpoint=path, resume=True)):
        with pytest.raises(ValueError, match=r"checkpoint '.*fit\.npz': "):
            read()


def test_states_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    """Arrays that would lead the native code out of its memory."""
    path = tmp_path / "fit.npz"
    run("vertices, colour and power", checkpoint=path)
    tree = checkpoint_file.read_tree(path)
    for view in tree["state"]["learned"].values():
        for weights in view["sampling"]["weights"]:
            weights["first"] = weights["first"] + np.uint32(7)
    tree["state"]["done"] = 3
    checkpoint_file.write_checkpoint(path, tree)
    with pytest.raises(ValueError, match="is damaged"):
        run("vertices, colour and power", checkpoint=path, resume=True)


def test_a_full_disk_leaves_the_last_checkpoint_and_the_fit_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "fit.npz"
    expected = run("positions")[1].losses
    savez, wholes = np.savez, []

    def full(file: Any, **parts: Any) -> None:
        if wholes:
            file.write(b"PK")
            raise OSError(errno.ENOSPC, "No space left on device")
        savez(file, **parts)
        wholes.append(True)

    monkeypatch.setattr(np, "savez", full)
    with pytest.warns(RuntimeWarning, match=r"fit\.npz.*No space left") as caught:
        _, result = run("positions", checkpoint=path, checkpoint_every=3)
    assert result.losses == expected and len(caught) == 1
    assert read_checkpoint(path).iteration == 3 and [one.name for one in tmp_path.iterdir()] == ["fit.npz"]


def test_where_no_file_can_be_written_the_fit_does_not_begin(tmp_path: Path) -> None:
    for path, words in ((tmp_path / "none" / "a.npz", "no folder"), (tmp_path / "a.pickle", r"must end in \.npz")):
        with pytest.raises(OSError, match=words):
            run("positions", checkpoint=path)
    with pytest.raises(ValueError, match="resume needs a checkpoint"):
        run("positions", resume=True)


def test_killed_fits_go_on(tmp_path: Path) -> None:
    killed, _ = kill_fits(tmp_path, 3)
    assert killed


@pytest.mark.slow
def test_fifty_killed_fits_go_on(tmp_path: Path) -> None:
    killed, _ = kill_fits(tmp_path, 50, seed=1)
    assert killed > 25
