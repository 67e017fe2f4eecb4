"""What happens to Blender's data while a fit runs: renamed data are written, and no result is lost."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
import edgegrad_addon
from edgegrad import images
from edgegrad_addon import command_line
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.export.geometry.mesh import positions
from edgegrad_addon.parameters import Names
from edgegrad_addon.session import Picture, Request, Session
from edgegrad_addon.write_back.held import Held
from edgegrad_addon.write_back.kept import TEXT, write_kept
from tests.support.scenes import blender_scenes as bs

MOVE = np.array([0.25, -0.5, 0.125])
COLOR, POWER, PLACE = (0.25, 0.5, 0.125), 50.0, 0.75
SHIFTED = 'objects["Empty"].location[0]'


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    """A prepared fit of vertices, a colour, a power and a property."""
    bs.empty(16)
    bs.camera()
    bs.light("POINT", "Bulb")
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")), (0, 0, 0), (0.3, 0.4, 0.5), (1, -2, 0.5))
    child = bs.add("Child", bs.cube("Small", bs.material("Wax")), (1.5, 0, 0), scale=(0.3, 0.3, 0.3))
    child.parent = bs.add("Empty", None)
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    yield prepared(tmp_path)
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


def prepared(folder: Path, in_place: bool = False) -> Session:
    images.write_image(folder / "target.exr", np.full((16, 16, 3), 0.5, np.float32))
    names = Names(vertices=("Cube",), base_color=("Clay",), power=("Bulb",))
    return Session.prepare(bpy.context, Request([Picture("Camera", str(folder / "target.exr"))], names, iterations=1,
                                                in_place=in_place, animated=(Wanted(SHIFTED),)))  # fmt: skip


def result(session: Session) -> edgegrad.FitResult:
    """A result that moves each parameter by a known amount."""
    values = dict(session.before)
    control = 'objects["Cube"].data.vertices'  # with properties, vertices are fitted in the space of their object
    values[control] = values[control] + MOVE
    values["materials.Clay.base_color"] = np.array(COLOR)
    values["lights.Bulb.power"] = POWER
    values[SHIFTED] = np.array([PLACE])
    assert values.keys() == session.before.keys()
    return edgegrad.FitResult(values, [1.0, 0.5], 1, 1.0, False, {}, ())


def shown(ob: Any) -> Any:
    return positions(ob.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def color(material: Any) -> Any:
    return bs.shader(material).inputs["Color"].default_value[:3]


def test_renamed_data_are_written(session: Session) -> None:
    cube, bulb = bpy.data.objects["Cube"], bpy.data.objects["Bulb"]
    clay, empty = bpy.data.materials["Clay"], bpy.data.objects["Empty"]
    before = positions(cube.data)
    for renamed in (cube, bulb, clay, empty, cube.data, bulb.data):
        renamed.name = f"Other {renamed.name}"
    bs.add("Cube", bs.cube("Cube"))  # another object has the old name now
    assert session.write(result(session)) and not session.unwritten
    assert np.allclose(shown(cube), before + MOVE) and color(clay) == pytest.approx(COLOR)
    assert bulb.data.energy == pytest.approx(POWER) and empty.location.x == pytest.approx(PLACE)
    assert np.array_equal(shown(bpy.data.objects["Cube"]), positions(bpy.data.objects["Cube"].data))


REMOVED: dict[str, tuple[Callable[[], Any], str]] = {
    "object": (lambda: bpy.data.objects.remove(bpy.data.objects["Cube"]), "object 'Cube': was removed"),
    "material": (lambda: bpy.data.materials.remove(bpy.data.materials["Clay"]), "material 'Clay': was removed"),
    "light": (lambda: bpy.data.objects.remove(bpy.data.objects["Bulb"]), "object 'Bulb': was removed"),
    "property": (lambda: bpy.data.objects.remove(bpy.data.objects["Empty"]), "object 'Empty': was removed"),
    "node": (lambda: bpy.data.materials["Clay"].node_tree.nodes.clear(), "material 'Clay': its node"),
}


@pytest.mark.parametrize("name", REMOVED)
def test_what_was_removed_is_named_and_the_rest_is_written(name: str, session: Session) -> None:
    remove, words = REMOVED[name]
    remove()
    assert session.write(result(session)) and len(session.unwritten) == 1
    assert words in session.unwritten[0] and TEXT in session.unwritten[0]
    assert session.unwritten[0] in session.late_notes
    assert len(json.loads(bpy.data.texts[TEXT].as_string())["results"]) == 1
    written = [name != "object" and bpy.data.objects["Cube"].data.shape_keys is not None,
               name not in ("material", "node") and color(bpy.data.materials["Clay"]) == pytest.approx(COLOR),
               name != "light" and bpy.data.objects["Bulb"].data.energy == pytest.approx(POWER),
               name != "property" and bpy.data.objects["Empty"].location.x == pytest.approx(PLACE)]  # fmt: skip
    assert sum(map(bool, written)) == 3


def test_a_result_in_edit_mode_is_kept_and_written_later(session: Session) -> None:
    cube = bpy.data.objects["Cube"]
    before = positions(cube.data)
    bpy.ops.object.mode_set(mode="EDIT")
    assert session.write(result(session))
    assert "object 'Cube': is in edit mode" in session.unwritten[0]
    assert write_kept() == ([], [session.unwritten[0].split(";")[0] + "; leave it first"])
    bpy.ops.object.mode_set(mode="OBJECT")
    assert np.array_equal(positions(cube.data), before) and cube.data.shape_keys is None
    edgegrad_addon.register()
    try:
        assert bpy.ops.edgegrad.write_kept_result() == {"FINISHED"}
        assert not bpy.ops.edgegrad.write_kept_result.poll()
    finally:
        edgegrad_addon.unregister()
    assert np.allclose(shown(cube), before + MOVE) and bpy.data.texts.get(TEXT) is None


@pytest.mark.parametrize("change", ["cut", "turned around"])
def test_a_result_for_another_topology_is_kept(change: str, session: Session) -> None:
    cube = bpy.data.objects["Cube"]
    kept = cube.data.copy()
    if change == "cut":
        cube.data.vertices.add(1)
    else:
        cube.data.flip_normals()
    session.write(result(session))
    assert "object 'Cube': its mesh has another topology" in session.unwritten[0] and cube.data.shape_keys is None
    changed, cube.data = cube.data, kept
    bpy.data.meshes.remove(changed)
    assert write_kept() == (["object 'Cube'"], [])
    assert np.allclose(shown(cube), positions(kept) + MOVE)


def test_all_kinds_of_results_are_written_from_the_text(session: Session) -> None:
    """Locked by a rename of what they were called, all are kept; then they are written by name."""
    for ob in (bpy.data.objects["Cube"], bpy.data.objects["Bulb"], bpy.data.objects["Empty"]):
        other = ob.copy()
        bpy.context.collection.objects.link(other)
        name = ob.name
        bpy.data.objects.remove(ob)
        other.name = name
    clay = bpy.data.materials["Clay"]
    other = clay.copy()
    bpy.data.objects["Cube"].data.materials[0] = other
    bpy.data.materials.remove(clay)
    other.name = "Clay"
    before = positions(bpy.data.objects["Cube"].data)
    assert not session.write(result(session)) and len(session.unwritten) == 4
    done, failed = write_kept()
    assert sorted(done) == ["light 'Bulb'", "material 'Clay'", "object 'Cube'", f"property '{SHIFTED}'"] and not failed
    assert np.allclose(shown(bpy.data.objects["Cube"]), before + MOVE)
    assert color(other) == pytest.approx(COLOR) and bpy.data.lights["Bulb"].energy == pytest.approx(POWER)
    assert bpy.data.objects["Empty"].location.x == pytest.approx(PLACE)


def test_removed_data_are_named_by_their_kind() -> None:
    mesh = bpy.data.meshes.new("Net")
    held = Held.of("meshes", mesh)
    bpy.data.meshes.remove(mesh)
    with pytest.raises(edgegrad_addon.problem.Problem, match=r"^mesh 'Net': was removed"):
        held.get()


def test_texts_that_were_changed_are_refused(session: Session) -> None:
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    session.write(result(session))
    for content in ("no JSON", "[]", '{"results": [{"vertices": "Cube"}]}', '{"results": [7]}'):
        bpy.data.texts[TEXT].from_string(content)
        bs.add("Cube", bs.cube("Cube"))
        with pytest.raises(edgegrad_addon.problem.Problem, match=TEXT):
            write_kept()
        bpy.data.objects.remove(bpy.data.objects["Cube"])


def test_what_was_written_before_a_damaged_entry_is_not_written_twice(session: Session) -> None:
    cube = bpy.data.objects["Cube"]
    before = positions(cube.data)
    bpy.ops.object.mode_set(mode="EDIT")
    session.write(result(session))
    bpy.ops.object.mode_set(mode="OBJECT")
    kept = json.loads(bpy.data.texts[TEXT].as_string())["results"]
    bpy.data.texts[TEXT].from_string(json.dumps({"results": [*kept, {"vertices": "Cube"}]}))
    for _ in range(2):
        with pytest.raises(edgegrad_addon.problem.Problem, match=TEXT):
            write_kept()
        assert np.allclose(shown(cube), before + MOVE)


def test_the_command_line_says_what_was_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    bs.empty(8)
    bs.camera()
    bs.world((0.5, 0.5, 0.5))
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")))
    images.write_image(tmp_path / "target.exr", np.full((8, 8, 3), 0.1, np.float32))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "start.blend"))
    run = Session.run

    def removing(session: Session, *given: Any, **named: Any) -> edgegrad.FitResult:
        found = run(session, *given, **named)
        bpy.data.materials.remove(bpy.data.materials["Clay"])
        return found

    monkeypatch.setattr(Session, "run", removing)
    saved = tmp_path / "fitted.blend"
    code = command_line.main(["fit", str(tmp_path / "start.blend"), "--base-color", "Clay", "--target",
                              f"Camera={tmp_path / 'target.exr'}", "--iterations", "1", "--samples", "1", "--save",
                              str(saved)])  # fmt: skip
    assert code == 1 and "error: material 'Clay': was removed" in capsys.readouterr().err
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    assert bpy.data.texts.get(TEXT) is not None
