"""The commands and operators end to end: a fit is written and saved; a failure leaves every .blend as it was."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import hashlib
import json
import time
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
import edgegrad_addon
from edgegrad import images, losses
from edgegrad_addon import command_line
from edgegrad_addon.export.geometry.mesh import positions
from edgegrad_addon.parameters import Names
from edgegrad_addon.running.fit_job import FitJob
from edgegrad_addon.session import Picture, Request, Session
from tests.support.scenes import blender_scenes as bs

TRUE_COLOR, START_COLOR = (0.7, 0.3, 0.1), (0.3, 0.4, 0.5)


@pytest.fixture
def start(tmp_path: Any) -> Any:
    """A saved .blend with a wrong colour and a cube at the wrong place in its mesh, and the target beside it."""
    bs.empty()
    bs.camera((0, 0, 6), name="Front")
    bs.light("SUN", "Sun", rotation=(0.3, 0.4, 0), energy=3.0)
    bs.world((0.2, 0.2, 0.2))
    ob = bs.add("Cube", bs.cube("Cube", bs.material("Clay", TRUE_COLOR)), rotation=(0.4, 0.3, 0))
    images.write_image(tmp_path / "target.exr", edgegrad.render(bs.export().scene, spp=64))
    ob.data.vertices.foreach_set("co", (positions(ob.data) * 0.9 + 0.05).ravel())
    ob.data.update()
    bs.shader(bpy.data.materials["Clay"]).inputs["Color"].default_value = (*START_COLOR, 1.0)
    path = tmp_path / "start.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def arguments(start: Any, *more: Any) -> Any:
    target = f"Front={start.parent / 'target.exr'}"
    save = [] if "--save" in more else ["--save", str(start.parent / "unasked.blend")]
    return ["fit", str(start), "--target", target, "--samples", "4", "--iterations", "3", *save, *more]


def digest(path: Any) -> Any:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def data() -> Any:
    """All that a fit could change in Blender's data. (In background mode `is_dirty` is always set.)"""
    ob, color = bpy.data.objects["Cube"], bs.shader(bpy.data.materials["Clay"]).inputs["Color"]
    return (positions(ob.data).tobytes(), ob.data.shape_keys, color.default_value[:], len(ob.modifiers),
            bpy.data.lights["Sun"].energy, len(bpy.data.meshes), len(bpy.data.images))  # fmt: skip


@pytest.mark.parametrize("where", ["--shape-key", "--in-place"])
def test_fit_writes_pictures_report_and_another_blend(start: Any, where: Any, tmp_path: Any, capsys: Any) -> None:
    before = digest(start)
    saved, out = tmp_path / "fitted.blend", tmp_path / "out"
    code = command_line.main(arguments(start, "--vertices", "Cube", "--base-color", "Clay", "--iterations", "20", where,
                                       "--save", str(saved), "--out", str(out)))  # fmt: skip
    assert code == 0 and digest(start) == before
    said = capsys.readouterr().err
    assert all(text in said for text in ("pictures before [", "20 / 20   loss", "   finishing", "pictures after ["))
    report = json.loads((out / "report.json").read_text())
    assert min(report["losses"]) < 0.3 * report["losses"][0]
    assert images.read_image(out / "after_Front.exr").shape == (bs.SIZE, bs.SIZE, 3)
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    mesh = bpy.data.meshes["Cube"]
    assert (mesh.shape_keys is not None) == (where == "--shape-key")
    color = np.array(bs.shader(bpy.data.materials["Clay"]).inputs["Color"].default_value[:3])
    assert color == pytest.approx(report["values"]["materials.Clay.base_color"], abs=1e-6)
    assert np.linalg.norm(color - TRUE_COLOR) < np.linalg.norm(np.subtract(START_COLOR, TRUE_COLOR))


BAD = {
    "unknown camera": (["--target", "Back=x.exr"], ["'Back'", "'Front'"]),
    "target without a file": (["--target", "Front"], ["CAMERA=FILE"]),
    "missing mask": (["--vertices", "Cube", "--mask", "Front=nowhere.png"], ["nowhere.png"]),
    "unknown object": (["--vertices", "Ball"], ["'Ball'"]),
    "unknown material": (["--base-color", "Marble"], ["'Marble'", "'Clay'"]),
    "unknown light": (["--power", "Lamp"], ["'Lamp'", "'Sun'"]),
    "nowhere to save": (["--vertices", "Cube", "--save", "/nowhere/x.blend"], ["/nowhere/x.blend"]),
    "no parameter": ([], ["no parameter"]),
    "bad smoothness": (["--vertices", "Cube", "--smoothness", "-1"], ["smoothness"]),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arguments_are_said_in_one_sentence(name: Any, start: Any, capsys: Any) -> None:
    more, words = BAD[name]
    before, as_it_was = digest(start), data()
    assert command_line.main(arguments(start, *more)) == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.startswith("edgegrad: error: ") and all(word in said for word in words)
    assert digest(start) == before and data() == as_it_was


def test_wrong_usage_has_its_own_exit_code(start: Any, capsys: Any) -> None:
    assert command_line.main(["fit", str(start)]) == 2
    assert "--save" in capsys.readouterr().err
    assert command_line.main(["fold"]) == 2
    assert command_line.main(arguments(start, "--iterations", "0")) == 2
    assert "usage" in capsys.readouterr().err


def test_files_that_cannot_be_opened(tmp_path: Any, capsys: Any) -> None:
    broken = tmp_path / "broken.blend"
    broken.write_bytes(b"no blend at all")
    for path in (broken, tmp_path / "missing.blend"):
        assert command_line.main(["render", str(path), "--out", str(tmp_path / "x.png")]) == 1
        assert path.name in capsys.readouterr().err


def spoil_nan() -> None:
    bpy.data.meshes["Cube"].vertices[0].co.x = float("nan")


def spoil_light() -> None:
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    bpy.context.scene.world = None


def spoil_size() -> None:
    bpy.context.scene.render.resolution_x = 48


def spoil_faces() -> None:
    bpy.data.meshes["Cube"].clear_geometry()


def spoil_modifier() -> None:
    bpy.data.objects["Cube"].modifiers.new("Round it", "BEVEL")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (spoil_nan, ["'Cube'", "non-finite"]),
        (spoil_light, ["light"]),
        (spoil_size, ["target.exr", "32 x 32", "48 x 32", "'Front'"]),
        (spoil_faces, ["'Cube'", "without faces"]),
        (spoil_modifier, ["'Cube'", "'Round it'", "apply that modifier"]),
    ],
)
def test_bad_scenes_are_named_and_stay(spoil: Any, words: Any, start: Any, capsys: Any, tmp_path: Any) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(start))
    spoil()
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    before, saved = digest(start), tmp_path / "fitted.blend"
    assert command_line.main(arguments(start, "--vertices", "Cube", "--save", str(saved))) == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert all(word in said for word in words), said
    assert digest(start) == before and not saved.exists()


def test_faces_without_area_are_no_problem(start: Any) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(start))
    mesh = bpy.data.meshes["Cube"]
    mesh.vertices[0].co = mesh.vertices[1].co
    bpy.ops.wm.save_as_mainfile(filepath=str(start))
    assert command_line.main(arguments(start, "--vertices", "Cube")) == 0


def prepared(start: Any) -> Any:
    bpy.ops.wm.open_mainfile(filepath=str(start))
    request = Request([Picture("Front", str(start.parent / "target.exr"))], Names(("Cube",), ("Clay",)), 5, 4)
    return Session.prepare(bpy.context, request)


def test_cancel_leaves_everything_as_it_was(start: Any) -> None:
    session = prepared(start)
    as_it_was = data()
    result = session.run(callback=lambda step: step.iteration < 2)
    assert result.cancelled
    assert session.write(result) is False
    assert data() == as_it_was


def test_cancel_keeps_the_best_if_asked(start: Any) -> None:
    session = prepared(start)
    result = session.run(callback=lambda step: "best" if step.iteration == 4 else None)
    assert result.cancelled and session.write(result) is True
    assert bpy.data.meshes["Cube"].shape_keys is not None


@pytest.mark.parametrize("how", ["restore", "best"])
def test_job_of_the_window_stops_as_asked(how: Any, start: Any) -> None:
    """The modal operator's response to Esc and the button Stop; the bpy module has no window for key presses."""
    session = prepared(start)
    session.request.iterations = 100_000
    as_it_was = data()
    job = FitJob(session, start.parent / "difference.png")
    job.start()
    while len(job.losses) < 4 and job.running:  # the first values are those of the start
        time.sleep(0.01)
    job.end(how)
    job.wait()
    assert job.error is None and job.result.cancelled and len(job.result.losses) < 100_000
    assert session.write(job.result) is (how == "best")
    assert (data() == as_it_was) is (how == "restore")


def test_interrupt_has_its_own_exit_code(start: Any, monkeypatch: Any) -> None:
    def interrupt(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Session, "run", interrupt)
    before, as_it_was = digest(start), data()
    assert command_line.main(arguments(start, "--vertices", "Cube")) == 130
    assert digest(start) == before and data() == as_it_was


def test_render_and_gradient_write_files(start: Any, tmp_path: Any) -> None:
    picture, change = tmp_path / "render.exr", tmp_path / "change.exr"
    assert command_line.main(["render", str(start), "--out", str(picture), "--samples", "8"]) == 0
    assert images.read_image(picture).max() > 0.1
    for direction, sign in (("x", 0.0), ("normal", 1.0)):
        assert command_line.main(["gradient", str(start), "--vertices", "Cube", "--direction", direction,
                                  "--out", str(change), "--samples", "64"]) == 0  # fmt: skip
        total = images.read_image(change).sum()
        # Moving sideways makes one side brighter and the other darker; growing makes the cube cover more.
        assert abs(total) < 30.0 if sign == 0.0 else total > 30.0
    assert command_line.main(["gradient", str(start), "--base-color", "Clay", "--out", str(tmp_path / "g.png")]) == 0


@pytest.fixture
def rich(tmp_path: Any) -> Any:
    """A saved .blend with a spot, a soft lamp, a rough metal, a texture and deep light paths, and its picture."""
    scene = bs.empty()
    cycles = scene.cycles
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 6, 4, 4
    bs.camera((0, 0, 8), name="Front")
    bs.light("SPOT", "Spot", location=(2, 0, 6), rotation=(0, 0.35, 0), energy=900.0, shadow_soft_size=0.1)
    bs.light("POINT", "Soft", location=(-2, 2, 4), energy=300.0, shadow_soft_size=0.5)
    bs.add("Floor", bs.plane("Floor", 8.0, bs.material("White", (0.9, 0.9, 0.9))))
    metal = bs.material("Metal", (0.8, 0.5, 0.3), "ShaderNodeBsdfPrincipled", Metallic=1.0, Roughness=0.3)
    bs.add("Cube", bs.cube("Cube", metal), location=(0, 0, 1.5), rotation=(0.4, 0.3, 0), scale=(0.7, 0.7, 0.7))
    for polygon in bpy.data.meshes["Cube"].polygons:
        polygon.use_smooth = True
    path = tmp_path / "rich.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert command_line.main(["render", str(path), "--out", str(tmp_path / "target.exr"), "--samples", "256"]) == 0
    return path


def test_scenes_are_fitted_as_they_are(rich: Any, capsys: Any) -> None:
    """The fit renders the same picture as the render command, to the same depth, and notes missing derivatives."""
    bpy.ops.wm.open_mainfile(filepath=str(rich))
    request = Request([Picture("Front", str(rich.parent / "target.exr"))], Names(("Cube",)), 1, 256)
    session = Session.prepare(bpy.context, request)
    scene, limits = session.export.scene, session.export.settings
    assert isinstance(scene.lights["Spot"], edgegrad.SpotLight) and scene.lights["Soft"].radius == 0.5
    assert scene.materials["Metal"].metallic == 1.0 and scene.meshes["Cube"].smoothing is not None
    assert limits.max_depth == 8 and limits.bounces.glossy == 4
    assert not session.export.report.lines
    shallow = edgegrad.render(scene, spp=256)
    target = session.targets[0].image[..., :3]
    loss = session.run().losses[0]
    # The smooth cube is lit from below its faces' planes, which makes this picture noisy, in Cycles as well.
    assert 1.7 * loss < losses.Pyramid()(shallow, target)[0]
    command_line.main(["gradient", str(rich), "--vertices", "Cube", "--samples", "1", "--out", str(rich) + ".exr"])
    said = capsys.readouterr().err.splitlines()
    for note in edgegrad.plan(scene, session.wrt, max_depth=8).missing:
        assert f"not computed: {note}" in session.notes and any(line.endswith(note) for line in said)


@pytest.fixture
def registered(start: Any) -> Any:
    bpy.ops.wm.open_mainfile(filepath=str(start))
    edgegrad_addon.register()
    yield start
    edgegrad_addon.unregister()


def test_operators_run_in_background(registered: Any) -> None:
    settings = bpy.context.scene.edgegrad
    bpy.data.objects["Cube"].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    assert bpy.ops.edgegrad.render(samples=4) == {"FINISHED"}
    pixels = np.array(bpy.data.images["Edgegrad Render"].pixels[:]).reshape(bs.SIZE, bs.SIZE, 4)
    expected = edgegrad.render(bs.export().scene, spp=4)
    assert pixels[::-1, :, :3] == pytest.approx(expected, abs=1e-6)
    assert bpy.ops.edgegrad.parameters_add(of="VERTICES") == {"FINISHED"}
    assert bpy.ops.edgegrad.gradient(samples=4) == {"FINISHED"}
    assert bpy.ops.edgegrad.target_add() == {"FINISHED"}
    assert settings.targets[0].camera.name == "Front"
    settings.targets[0].image = "//target.exr"
    settings.iterations, settings.samples = 3, 4
    assert bpy.ops.edgegrad.fit() == {"FINISHED"}
    assert bpy.data.meshes["Cube"].shape_keys.key_blocks[-1].name == "Edgegrad"
    assert bpy.ops.edgegrad.target_remove() == {"FINISHED"}


def test_operator_tells_what_is_wrong(registered: Any) -> None:
    with pytest.raises(RuntimeError, match="no target"):
        bpy.ops.edgegrad.fit()


def test_registers_twice(registered: Any) -> None:
    edgegrad_addon.unregister()
    edgegrad_addon.register()
    assert bpy.context.scene.edgegrad.iterations == 200
