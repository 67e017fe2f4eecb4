"""Fits of films in Blender: frames from Cycles, keys as the result, refusals that name the cure."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import images
from edgegrad_addon.animated import refusals
from edgegrad_addon.animated.data_path import find
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.command_line import main
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.session import Picture, Request, Session
from edgegrad_addon.targets.film import FrameRange
from tests.support.animated import scenes as zoo

LOCATION, ENERGY = f"{zoo.CUBE}.location", 'lights["Lamp"].energy'
EXAMPLE = Path(__file__).parents[2] / "blend_examples" / "track_film.py"


def example() -> Any:
    spec = importlib.util.spec_from_file_location("track_film", EXAMPLE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def staged(folder: Path, frames: int = 3, size: int = 12) -> Any:
    """A cube keyed at the first frame, and grey pictures."""
    ob = zoo.stage(size)
    ob.keyframe_insert("location", frame=1)
    ob.keyframe_insert("location", frame=9)
    for frame in range(1, frames + 1):
        images.write_image(folder / f"film.{frame:04d}.exr", np.full((size, size, 3), 0.1 * frame, np.float32))
    return ob


def prepared(folder: Path, *wanted: Wanted, frames: FrameRange | None = None, **options: Any) -> Session:
    pictures = [Picture("Camera", str(folder / "film.%04d.exr"))]
    film = FrameRange(1, 3, first_every=2) if frames is None else frames
    return Session.prepare(bpy.context, Request(pictures, Names(), 8, 1, animated=wanted, film=film, **options))


def test_the_motion_of_the_example_is_found(tmp_path: Path) -> None:
    """A shorter film of the example: Cycles' pictures, the command line, the keys of the saved .blend."""
    found = example().track(tmp_path, 3, 32, 60, "--first-every", "2", "--out", str(tmp_path / "out"))
    before, after = found["before"], found["after"]
    assert before["place, largest"] > 0.12 and before["degrees, largest"] > 4.0
    assert after["place, largest"] < 0.4 * before["place, largest"]
    assert after["degrees, largest"] < 0.8 * before["degrees, largest"]
    curve = refusals.curve_of(find('objects["Box"].location')[0])
    assert [point.co[0] for point in curve.keyframe_points] == [1.0, 2.0, 3.0]
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["frames"] == [1, 2, 3] and np.shape(report["values"]['objects["Box"].location']) == (3, 3)
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"before_Camera_0001.png", "after_Camera_0002.png", "after_Camera_0003.png"} <= names


def test_only_names_of_files_have_numbers_of_frames(tmp_path: Path) -> None:
    """A folder may have # in its name, and so may a picture that is there."""
    folder = tmp_path / "shot #12"
    folder.mkdir()
    for name in ("film.0001.exr", "film.0002.exr", "take #1.exr"):
        images.write_image(folder / name, np.ones((2, 2, 3), np.float32))
    film = FrameRange(1, 2)
    numbered = film.pictures([Picture("Camera", str(folder / "film.####.exr"))], 1)
    assert [one.image for one in numbered] == [str(folder / f"film.000{k}.exr") for k in (1, 2)]
    for name in ("film.0001.exr", "take #1.exr"):
        (single,) = film.pictures([Picture("Camera", str(folder / name))], 1)
        assert single.image == str(folder / name) and single.time == 1


def test_keyed_values_are_those_of_frames_and_shared_ones_of_all(tmp_path: Path) -> None:
    ob = staged(tmp_path)
    bpy.context.scene.frame_set(7)
    session = prepared(tmp_path, Wanted(LOCATION), Wanted(ENERGY))
    assert bpy.context.scene.frame_current == 7
    result = session.run()
    assert result.values[LOCATION].shape == (3, 3) and result.values[ENERGY].shape == (1,)
    assert bpy.context.scene.frame_current == 7
    assert session.write(result) and not session.unwritten
    for k, frame in enumerate((1, 2, 3)):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(ob.location, result.values[LOCATION][k], rtol=1e-6)
    curve = refusals.curve_of(find(LOCATION)[0])
    assert [point.co[0] for point in curve.keyframe_points] == [1.0, 2.0, 3.0, 9.0]
    assert bpy.data.lights["Lamp"].energy == pytest.approx(result.values[ENERGY][0])
    assert not refusals.is_keyed(find(ENERGY)[0])


def test_a_frame_shows_its_own_values(tmp_path: Path) -> None:
    """The export of a placement has what is keyed and what is given; other animation moves as in the file."""
    staged(tmp_path)
    floor = bpy.data.objects["Floor"]
    for frame, height in ((1, -1.1), (3, -1.5)):
        floor.location.z = height
        floor.keyframe_insert("location", frame=frame)
    session = prepared(tmp_path, Wanted(LOCATION))
    assert session.driver is not None
    values = session.before[LOCATION] + np.array([[0.0], [0.5], [1.0]])
    first, last = (session.scene_of({LOCATION: values}, view).meshes for view in (0, 2))

    def middle(mesh: Any) -> np.ndarray:
        return mesh.vertices.mean(axis=0) @ mesh.transform[:3, :3].T + mesh.transform[:3, 3]

    np.testing.assert_allclose(middle(last["Cube"]) - middle(first["Cube"]), 1.0, atol=1e-5)
    np.testing.assert_allclose(middle(last["Floor"]) - middle(first["Floor"]), (0.0, 0.0, -0.4), atol=1e-5)
    placed = session.driver.place({LOCATION: values}, [2])
    assert placed.own[2] and not placed.own[0]


@pytest.mark.parametrize("stop", [3, 12])
def test_a_resumed_film_has_the_same_bits(stop: int, tmp_path: Path) -> None:
    def run(**options: Any) -> Any:
        staged(tmp_path)
        return prepared(tmp_path, Wanted(LOCATION), Wanted(ENERGY)).run(**options)

    path = tmp_path / "fit.npz"
    expected = run()
    assert len(expected.losses) > 13
    run(checkpoint=path, callback=lambda step: "restore" if step.iteration == stop else None)
    resumed = run(checkpoint=path, resume=True)
    assert resumed.losses == expected.losses
    assert all(np.array_equal(resumed.values[path], expected.values[path]) for path in expected.values)


def test_refusals_name_the_cure(tmp_path: Path) -> None:
    ob = staged(tmp_path)
    driver = ob.driver_add("rotation_euler", 2).driver
    driver.type = "AVERAGE"
    variable = driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = bpy.data.objects["Floor"], "location.x"
    with pytest.raises(Problem, match=r"is driven.*fit what drives it \('location.x' of 'Floor'\)"):
        prepared(tmp_path, Wanted(f"{zoo.CUBE}.rotation_euler"))
    with pytest.raises(Problem, match=r"is keyed.*--frames"):
        Session.prepare(bpy.context, Request([Picture("Camera", str(tmp_path / "film.0001.exr"))], Names(),
                                             animated=(Wanted(LOCATION),)))  # fmt: skip
    with pytest.raises(Problem, match=r"no file '.*film\.0004\.exr' of frame 4"):
        prepared(tmp_path, Wanted(LOCATION), frames=FrameRange(1, 5))
    with pytest.raises(Problem, match="is a single picture, of frame 20"):
        late = Picture("Camera", str(tmp_path / "film.0001.exr"), frame=20)
        Session.prepare(bpy.context, Request([late], Names(), film=FrameRange(1, 3)))
    track = ob.animation_data.nla_tracks.new()
    track.strips.new("Strip", 1, ob.animation_data.action)
    with pytest.raises(Problem, match="NLA"):
        prepared(tmp_path, Wanted(LOCATION))


def test_objects_that_vanish_are_refused_with_the_frame(tmp_path: Path) -> None:
    staged(tmp_path)
    floor = bpy.data.objects["Floor"]
    for frame, hidden in ((1, False), (2, True)):
        floor.hide_render = hidden
        floor.keyframe_insert("hide_render", frame=frame)
    with pytest.raises(Problem, match="frame 2: 'Floor' disappears"):
        prepared(tmp_path, Wanted(LOCATION)).run()


def test_wrong_options_are_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for option, says in ((["--frames", "5:1"], "upwards"), (["--frames", "1"], "FIRST:LAST")):
        assert main(["fit", *option, "--target", "Camera=x.png", "--out", str(tmp_path)]) == 2
        assert says in capfd.readouterr().err
