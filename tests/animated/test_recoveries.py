"""Properties are found again from a picture by Cycles, headless, and written where they came from."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad.fitting.outcome import coordinates
from edgegrad_addon.animated import data_path
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.parameters import Names
from edgegrad_addon.session import Picture, Request, Session
from tests.support.animated import scenes as zoo
from tests.support.scenes import blender_scenes as bs

SIZE = 32


def read(paths: list[str]) -> Any:
    return np.array([place.read() for path in paths for place in data_path.find(path)])


def assign(paths: list[str], values: Any) -> None:
    places = [place for path in paths for place in data_path.find(path)]
    for place, value in zip(places, values, strict=True):
        place.write(float(value))
    bpy.context.view_layer.update()


def rendered(folder: Path, camera: str) -> Picture:
    """Cycles' picture of a camera, as a target."""
    scene, file = bpy.context.scene, str(folder / f"{camera}.exr")
    scene.camera, scene.render.filepath = bpy.data.objects[camera], file
    bpy.ops.render.render(write_still=True)
    return Picture(camera, file)


def recover(folder: Path, paths: list[str], offsets: Any, iterations: int = 60, samples: int = 8,
            cameras: tuple[str, ...] = ("Camera",), **request: Any) -> tuple[float, float]:  # fmt: skip
    """Move properties away from their values, fit them to Cycles' pictures; return both largest errors."""
    pictures = [rendered(folder, name) for name in cameras]
    truth = read(paths)
    assign(paths, truth + offsets)
    before = np.abs(read(paths) - truth).max()
    session = Session.prepare(bpy.context, Request(pictures, Names(), iterations=iterations, samples=samples,
                                                   animated=tuple(map(Wanted, paths)), **request))  # fmt: skip
    kept = read(paths)
    result = session.run()
    assert np.array_equal(read(paths), kept), "nothing in the file changes before the result is written"
    assert session.write(result)
    error = float(np.abs(read(paths) - truth).max())
    print(f"{paths[0]} …: error {before:.4f} -> {error:.4f} in {result.seconds:.1f} s, "
          f"loss {result.losses[0]:.4g} -> {result.losses[result.best]:.4g}")  # fmt: skip
    return float(before), error


def test_rotations_of_a_chain_of_bones(tmp_path: Path) -> None:
    """A long box in 48 slices, bent by eight bones."""
    before, after = recover(tmp_path, *zoo.bent_arm(SIZE), 50, cameras=("Camera", "Front"))
    assert after < 0.2 * before


def test_shape_keys(tmp_path: Path) -> None:
    ob = zoo.stage(SIZE)
    for k, move in ((7, (0.7, 0.0, 0.3)), (3, (-0.5, 0.0, 0.5)), (4, (0.4, -0.6, 0.0))):
        zoo.shape_key(ob, f"Key {k}", k, move).value = 0.5
    zoo.subdivided(ob, 2)
    paths = [f'{zoo.KEYS}.key_blocks["Key {k}"].value' for k in (7, 3, 4)]
    before, after = recover(tmp_path, paths, [0.4, -0.4, 0.4])
    assert after < 0.1 * before


def test_place_and_focal_length_of_a_camera(tmp_path: Path) -> None:
    zoo.stage(SIZE)
    bs.add("Post", bs.cube("Post", bs.material("Blue", (0.1, 0.2, 0.7))), (-1.6, 1.5, 0), scale=(0.3, 0.3, 1.2))
    bs.add("Box", bs.cube("Box", bs.material("Green", (0.1, 0.6, 0.2))), (1.7, -0.9, -0.7), scale=(0.35, 0.35, 0.35))
    paths = ['objects["Camera"].location', 'objects["Camera"].rotation_euler', 'cameras["Camera"].lens']
    before, after = recover(tmp_path, paths, [0.2, -0.2, 0.15, 0.02, 0.03, -0.03, 3.0], 80)
    assert after < 0.15 * before


def test_input_of_geometry_nodes_and_a_material_together(tmp_path: Path) -> None:
    ob = zoo.stage(SIZE)
    zoo.geometry_nodes(ob, 0.2)
    paths = [f'{zoo.CUBE}.modifiers["Nodes"]["Lift"]',
             f'{zoo.CLAY}.nodes["Diffuse BSDF"].inputs["Color"].default_value']  # fmt: skip
    assert len(read(paths)) == 5
    before, after = recover(tmp_path, paths, [0.3, -0.2, 0.2, 0.2, 0.0], 60)
    assert after < 0.1 * before


def test_two_cameras_with_moving_poses(tmp_path: Path) -> None:
    zoo.stage(32)
    bs.camera((5.0, 0.5, 2.0), (1.2, 0.0, 1.5), "Side")
    paths = ['objects["Side"].location', 'objects["Camera"].location', f"{zoo.CUBE}.location[2]"]
    before, after = recover(tmp_path, paths, [0.0, 0.15, 0.1, 0.15, 0.0, -0.1, 0.0], 40, cameras=("Camera", "Side"))
    assert after < 0.3 * before


def test_a_fit_in_another_thread_is_served_by_the_main_thread(tmp_path: Path) -> None:
    zoo.stage(16)
    request = Request([rendered(tmp_path, "Camera")], Names(), iterations=4, samples=2,
                      animated=(Wanted(f"{zoo.CUBE}.location"),))  # fmt: skip
    assign([f"{zoo.CUBE}.location"], [0.3, 0.2, 0.1])
    alone = Session.prepare(bpy.context, request).run()
    session = Session.prepare(bpy.context, request)
    results: list[Any] = []
    thread = threading.Thread(target=lambda: results.append(session.run()))
    thread.start()
    ends = time.monotonic() + 60.0
    while thread.is_alive() and time.monotonic() < ends:
        session.serve()
        time.sleep(0.002)
    thread.join(1.0)
    assert results and results[0].losses == alone.losses
    closed = Session.prepare(bpy.context, request)
    assert closed.relay is not None
    def cancelled() -> None:
        with pytest.raises(edgegrad.Cancelled):
            closed.run()

    thread = threading.Thread(target=cancelled)
    thread.start()
    closed.relay.close()
    thread.join(60.0)
    assert not thread.is_alive()


def test_a_start_out_of_view_is_searched_for_and_the_result_has_errors(tmp_path: Path) -> None:
    """The cube is moved out of the picture: no gradient; the report says how well its place is known."""
    zoo.stage(SIZE)
    path = f"{zoo.CUBE}.location"
    before, after = recover(tmp_path, [path], [0.0, 6.0, 0.0], 60, search=200, restarts=1)
    assert after < 0.05 * before


def test_a_fit_that_its_gradient_leads_astray_goes_on_elsewhere(tmp_path: Path) -> None:
    zoo.stage(SIZE)
    path, offset = f"{zoo.CUBE}.location", [1.5, -0.5, 0.4]
    before, after = recover(tmp_path, [path], offset, 60, search=0)
    assert after > 0.5 * before
    zoo.stage(SIZE)
    before, after = recover(tmp_path, [path], offset, 60)
    assert after < 0.05 * before


def test_errors_of_properties_are_reported(tmp_path: Path) -> None:
    zoo.stage(32)
    target = rendered(tmp_path, "Camera")
    path = f"{zoo.CUBE}.location"
    truth = read([path])
    assign([path], truth + [0.1, -0.1, 0.1])
    session = Session.prepare(bpy.context, Request([target], Names(), iterations=40, samples=8,
                                                   animated=(Wanted(path),)))  # fmt: skip
    result = session.run()
    found = result.uncertainty[0]
    assert found.path == path
    assert found.names == ("[0]", "[1]", "[2]")
    assert (found.errors < 0.1).all()
    assert (np.abs(np.array(found.values) - truth) < 5.0 * found.errors + 0.01).all()
    assert str(found) in session.late_notes


def test_too_many_properties_for_one_by_one_have_errors_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each as if all others were known, which is no more than among others."""
    zoo.stage(32)
    target = rendered(tmp_path, "Camera")
    errors = []
    for most in (coordinates.MOST, 0):
        monkeypatch.setattr(coordinates, "MOST", most)
        request = Request([target], Names(), iterations=40, samples=8, animated=(Wanted(f"{zoo.CUBE}.location"),))
        errors.append(Session.prepare(bpy.context, request).run().uncertainty[0].errors)
    assert np.isfinite(errors[1]).all() and (errors[1] > 0.0).all()
    assert np.log(errors[1] / errors[0]).mean() < 0.7, errors
