"""Rendered views, without a window: cameras of views, incremental exports, and the thread that renders."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from mathutils import Matrix

import edgegrad
from edgegrad_addon.evaluation import Evaluation
from edgegrad_addon.export import export_scene
from edgegrad_addon.export.exported import Export
from edgegrad_addon.export.geometry import mesh
from edgegrad_addon.export.scene import export_evaluated
from edgegrad_addon.problem import Problem
from edgegrad_addon.render_engine import view, view_memory
from edgegrad_addon.render_engine.view_camera import Seen, camera_of_view, smaller, through_camera
from edgegrad_addon.render_engine.view_memory import ViewMemory
from edgegrad_addon.render_engine.view_thread import Request, Shown, ViewThread
from tests.support.scenes import blender_scenes as bs

MEMORY = Path("/proc/self/statm")
SECONDS = 60.0  # after which a thread is taken for hanging


pytestmark = pytest.mark.usefixtures("scene")


# ---------------------------------------------------------------- cameras
@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize(("width", "height", "aspect"), [(24, 16, 1.0), (16, 24, 1.0), (24, 24, 1.5)])
def test_camera_of_matrices(scene: Any, kind: str, width: int, height: int, aspect: float) -> None:
    """Blender's matrices of a camera give the camera that the export makes."""
    ob, render = scene.camera, scene.render
    lens = ob.data
    lens.type, lens.shift_x, lens.shift_y, lens.clip_start, lens.clip_end = kind, 0.2, -0.1, 0.5, 30.0
    render.resolution_x, render.resolution_y, render.pixel_aspect_y = width, height, aspect
    expected = export_scene(scene).scene.camera
    depsgraph = bpy.context.evaluated_depsgraph_get()
    projection = ob.calc_matrix_camera(depsgraph, x=width, y=height, scale_y=aspect)
    found = camera_of_view(np.array(ob.matrix_world.inverted()), np.array(projection), width, height)
    for name in ("to_world", "clip_start", "clip_end", "shift", "pixel_aspect", "width", "height", "kind", "ortho_width"
                 if kind == "ORTHO" else "fov_x"):  # fmt: skip
        one, two = getattr(found, name), getattr(expected, name)
        assert one == two if isinstance(two, str) else one == pytest.approx(two, rel=1e-5, abs=1e-6), name


def test_orthographic_view_sees_what_is_behind_its_origin() -> None:
    """As Blender's views: the clip distances are -10 and 10."""
    projection = np.diag([0.5, 0.5, -0.1, 1.0])
    found = camera_of_view(np.eye(4), projection, 8, 8)
    assert found.to_world[:3, 3] == pytest.approx([0.0, 0.0, 10.0])
    assert (found.clip_start, found.clip_end, found.ortho_width) == pytest.approx((0.0, 20.0, 4.0))


def test_smaller_picture_shows_the_same(scene: Any) -> None:
    camera = export_scene(scene).scene.camera
    camera.width, camera.height, camera.shift = 101, 67, np.array([0.1, -0.2])
    less = smaller(camera, 4)
    assert (less.width, less.height) == (25, 16)
    for one in (camera, less):
        one.validate()
    assert less.principal_point / (25, 16) == pytest.approx(camera.principal_point / (101, 67))
    assert less.pixel_aspect * 16 / 25 == pytest.approx(camera.pixel_aspect * 67 / 101)


@pytest.fixture
def fisheye(scene: Any) -> Any:
    """The scene's camera as a fisheye, 40 by 30 pixels."""
    lens, render = scene.camera.data, scene.render
    lens.type, lens.panorama_type, lens.shift_x = "PANO", "FISHEYE_EQUISOLID", 0.1
    render.resolution_x, render.resolution_y = 40, 30
    bpy.context.view_layer.update()
    return scene.camera


def seen_through(ob: Any, scale: float, offset: tuple[float, float], width: int, height: int) -> Seen:
    """What a view shows through a camera, scaled and moved from the camera's own picture (halves of the view)."""
    projection = np.array(ob.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=40, y=30))
    zoom = np.diag([scale * 40 / 30 * height / width, scale, 1.0, 1.0])
    zoom[:2, 3] = offset
    return through_camera(ob, bpy.context.scene, np.array(ob.matrix_world.inverted()), zoom @ projection, width, height)


@pytest.mark.parametrize(("scale", "offset", "size", "crop", "place"), [
    (1.0, (0.0, 0.0), (60, 80), (0, 0, 80, 60), (0.0, 0.0, 1.0, 1.0)),
    (0.5, (0.0, 0.0), (30, 40), (0, 0, 40, 30), (0.25, 0.25, 0.5, 0.5)),
    (2.0, (0.0, 0.0), (120, 160), (40, 30, 120, 90), (0.0, 0.0, 1.0, 1.0)),
    (1.0, (0.5, 0.2), (60, 80), (0, 6, 60, 60), (0.25, 0.1, 0.75, 0.9)),
    (1.0, (3.0, 0.0), (60, 80), (0, 0, 1, 1), (0.0, 0.0, 0.0, 0.0)),
])  # fmt: skip
def test_panorama_fills_the_frame_of_its_camera(
    fisheye: Any, scale: float, offset: tuple[float, float], size: tuple[int, int], crop: tuple[int, int, int, int],
    place: tuple[float, float, float, float],
) -> None:  # fmt: skip
    """Blender draws the frame of a panorama as that of a perspective camera."""
    seen = seen_through(fisheye, scale, offset, 80, 60)
    whole = export_scene(bpy.context.scene).scene.camera
    assert (seen.camera.height, seen.camera.width) == size
    assert seen.camera.crop == crop
    assert seen.place == pytest.approx(place)
    seen.camera.validate()
    assert seen.camera.kind == whole.kind and seen.camera.focal / size[1] == pytest.approx(whole.focal / 40)
    assert seen.camera.principal_point / size[::-1] == pytest.approx(whole.principal_point / (40, 30))
    assert seen.camera.to_world == pytest.approx(whole.to_world)


def test_smaller_picture_of_a_crop(fisheye: Any) -> None:
    """The coarse picture shows the same part of the frame, within one of its pixels."""
    camera = seen_through(fisheye, 3.3, (0.4, 0.1), 200, 140).camera
    less = smaller(camera, 4)
    less.validate()
    assert np.array(less.crop) == pytest.approx(np.array(camera.crop) / 4, abs=1.0)
    assert less.size == pytest.approx((35, 50), abs=1.0)


def test_view_through_a_camera_that_is_not_rendered(fisheye: Any) -> None:
    fisheye.data.panorama_type = "MIRRORBALL"
    with pytest.raises(Problem, match="Mirror Ball"):
        seen_through(fisheye, 1.0, (0.0, 0.0), 40, 30)


# ---------------------------------------------------------------- exports
class Exporter:
    """Exports a scene again and again, as a view does."""

    def __init__(self, monkeypatch: Any) -> None:
        self.memory = ViewMemory()
        self.read: list[int] = []
        self.first = True

        def counted(data: Any) -> mesh.MeshArrays:
            self.read.append(len(data.vertices))
            return mesh.read_mesh(data)

        monkeypatch.setattr(view_memory, "read_mesh", counted)

    def __call__(self) -> Export:
        changed: set[str] = set()

        def note(scene: Any, depsgraph: Any) -> None:
            changed.update(view._changed_objects(depsgraph))

        bpy.app.handlers.depsgraph_update_post.append(note)
        bpy.context.view_layer.update()
        bpy.app.handlers.depsgraph_update_post.remove(note)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        stale = None if self.first else changed
        self.first = False
        self.read.clear()
        self.memory.expect(lambda name: stale is None or name in stale)
        camera = edgegrad.Camera(np.eye(4))
        out = export_evaluated(Evaluation(bpy.context.scene, None, depsgraph), (), 0, memory=self.memory, view=camera)
        self.memory.end()
        return out


def _same(one: edgegrad.Scene, other: edgegrad.Scene) -> bool:
    return view._is_same(Export(one), Export(other))


def test_only_changed_meshes_are_read(scene: Any, monkeypatch: Any) -> None:
    export = Exporter(monkeypatch)
    first = export()
    assert sorted(export.read) == [4, 8]
    again = export()
    assert export.read == [] and view._is_same(first, again)
    assert again.scene.meshes["Cube"] is first.scene.meshes["Cube"]
    # A transform
    bpy.data.objects["Cube"].location.x += 0.5
    moved = export()
    assert export.read == [] and moved.scene.meshes["Plane"] is first.scene.meshes["Plane"]
    assert moved.scene.meshes["Cube"].vertices - first.scene.meshes["Cube"].vertices == pytest.approx(
        np.tile([0.5, 0.0, 0.0], (8, 1)), abs=1e-6)  # fmt: skip
    # A material
    bs.shader(bpy.data.materials["Red"]).inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    painted = export()
    assert export.read == [] and painted.scene.materials["Red"].base_color == pytest.approx([0.1, 0.2, 0.3])
    assert not view._is_same(moved, painted)
    # Vertices, and topology by a modifier
    bpy.data.meshes["Cube"].vertices[0].co.x -= 1.0
    bpy.data.meshes["Cube"].update()
    export()
    assert export.read == [8]
    bpy.data.objects["Cube"].modifiers.new("Subdivide", "SUBSURF")
    fine = export()
    assert export.read == [len(fine.scene.meshes["Cube"].vertices)] and export.read[0] > 8
    # Selection changes nothing
    bpy.data.objects["Plane"].select_set(True)
    assert view._is_same(fine, export())
    bpy.data.objects["Plane"].hide_set(True)
    assert set(export().scene.meshes) == {"Cube"}


def test_incremental_export_is_a_full_one(scene: Any, monkeypatch: Any) -> None:
    """After each of many edits, the incremental export equals one without memory."""
    export = Exporter(monkeypatch)
    cube, plane = bpy.data.objects["Cube"], bpy.data.objects["Plane"]
    export()
    rng = np.random.default_rng(1)
    image = bpy.data.images.new("Image", 4, 4)
    material = bpy.data.materials["Green"]

    def texture() -> None:
        plane.data.uv_layers.new(name="Map")
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.links.new(node.outputs["Color"], bs.shader(material).inputs["Color"])

    def unwrap() -> None:
        plane.data.uv_layers[0].uv.foreach_set("vector", rng.random(8).astype(np.float32))
        plane.data.update()

    def copy() -> None:
        bs.add("Second", cube.data, (2, 0, 0))

    edits: list[Callable[[], Any]] = [
        lambda: setattr(cube, "scale", rng.uniform(0.5, 2.0, 3)), texture, copy,
        lambda: setattr(cube, "hide_viewport", True), lambda: setattr(cube, "hide_viewport", False),
        unwrap, lambda: setattr(cube.data.polygons[0], "use_smooth", True), lambda: setattr(plane, "data", cube.data),
        lambda: bpy.data.objects.remove(cube), lambda: setattr(bpy.data.lights["Light"], "energy", 7.0),
    ]  # fmt: skip
    for k, edit in enumerate(edits):
        edit()
        found = export().scene
        whole = Exporter(monkeypatch)().scene
        assert found.meshes.keys() == whole.meshes.keys() and _same(found, whole), f"edit {k}"


# ---------------------------------------------------------------- thread
@pytest.fixture
def thread() -> Iterator[ViewThread]:
    made = ViewThread()
    yield made
    made.stop()
    assert not made._thread.is_alive()


def request(export: Export, samples: int = 8, transparent: bool = False, **camera: Any) -> Request:
    made = edgegrad.Camera(export.scene.camera.to_world, width=30, height=20, **camera)
    return Request(export.scene, export.settings, Seen(made), transparent, samples, 0)


def complete(thread: ViewThread, wanted: Request) -> Shown:
    """Wait for the last picture of a request."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        shown = thread.shown
        if shown is not None and shown.request is wanted and shown.samples == wanted.samples:
            return shown
        assert thread.error is None
        time.sleep(0.005)
    raise AssertionError("no picture")


def picture(wanted: Request) -> Any:
    renderer = edgegrad.Renderer(wanted.scene)
    return renderer.render(spp=wanted.samples, max_depth=wanted.settings.max_depth, bounces=wanted.settings.bounces,
                           camera=wanted.seen.camera)  # fmt: skip


def test_the_view_becomes_the_picture(scene: Any, thread: ViewThread) -> None:
    export = export_scene(scene)
    wanted = request(export)
    thread.post(wanted)
    shown = complete(thread, wanted)
    assert np.array_equal(shown.pixels[::-1, :, :3], picture(wanted)) and (shown.pixels[..., 3] == 1.0).all()
    # Another camera; other vertices, values, topology
    turned = request(export, fov_x=1.2)
    thread.post(turned)
    assert np.array_equal(complete(thread, turned).pixels[::-1, :, :3], picture(turned))
    cube = bpy.data.objects["Cube"]
    for edit in (lambda: setattr(cube, "rotation_euler", (0.3, 0.2, 0.1)),
                 lambda: setattr(bpy.data.lights["Light"], "energy", 30.0),
                 lambda: cube.modifiers.new("Subdivide", "SUBSURF"),
                 lambda: bpy.data.objects.remove(bpy.data.objects["Plane"])):  # fmt: skip
        edit()
        edited = request(export_scene(scene))
        thread.post(edited)
        assert complete(thread, edited).pixels[::-1, :, :3] == pytest.approx(picture(edited), abs=1e-5)


def test_a_new_request_ends_the_old_one(scene: Any, thread: ViewThread) -> None:
    export = export_scene(scene)
    thread.post(request(export, 1 << 24))
    time.sleep(0.05)
    wanted = request(export, 4, fov_x=1.0)
    thread.post(wanted)
    thread.wait(wanted, SECONDS)
    complete(thread, wanted)


def test_slow_views_begin_with_few_pixels(scene: Any, thread: ViewThread, monkeypatch: Any) -> None:
    thread._seconds = 1.0  # for a sample of a pixel
    sizes: list[tuple[int, int]] = []
    add = edgegrad.Progressive.add

    def noted(self: Any, spp: int, progress: Any = None) -> Any:
        out = add(self, spp, progress)
        sizes.append(out.shape[:2])
        return out

    monkeypatch.setattr(edgegrad.Progressive, "add", noted)
    wanted = request(export_scene(scene))
    thread.post(wanted)
    complete(thread, wanted)
    assert sizes[:2] == [(1, 1), (20, 30)]


def test_transparent_film(scene: Any, thread: ViewThread) -> None:
    scene.render.film_transparent = True
    wanted = request(export_scene(scene), transparent=True)
    thread.post(wanted)
    alpha = complete(thread, wanted).pixels[..., 3]
    assert alpha.min() == 0.0 and alpha.max() == 1.0


def test_errors_are_told_and_end(scene: Any, thread: ViewThread) -> None:
    export = export_scene(scene)
    wrong = request(export)
    wrong.seen.camera.fov_x = 7.0
    thread.post(wrong)
    thread.wait(wrong, SECONDS)
    assert thread.error is not None and thread.error.startswith("camera: fov_x")
    right = request(export)
    thread.post(right)
    end = time.monotonic() + SECONDS
    while thread.error is not None and time.monotonic() < end:
        time.sleep(0.005)
    complete(thread, right)


def test_many_updates_leave_nothing(scene: Any) -> None:
    before = threading.active_count()
    threads = [ViewThread() for _ in range(5)]
    for one in threads:
        one.post(request(export_scene(scene)))
    for one in threads:
        one.stop()
    assert threading.active_count() == before


@pytest.mark.slow
@pytest.mark.skipif(not MEMORY.exists(), reason="the memory of the process is read from /proc")
def test_orbits_and_edits_of_materials_keep_no_memory(scene: Any, thread: ViewThread, monkeypatch: Any) -> None:
    export = Exporter(monkeypatch)
    color = bs.shader(bpy.data.materials["Red"]).inputs["Color"]
    found, sizes = export(), []
    for k in range(1300):
        if k % 2:
            color.default_value = (0.1 + 0.0005 * k, 0.2, 0.3, 1.0)
            found = export()
        turned = np.array(Matrix.Rotation(0.01 * k, 4, "Z"))
        camera = edgegrad.Camera(turned, width=200, height=150)
        wanted = Request(found.scene, found.settings, Seen(camera), False, 1, 0)
        thread.post(wanted)
        complete(thread, wanted)
        if k >= 300 and k % 100 == 0:
            sizes.append(int(MEMORY.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
    # A picture has 0.48 MB: if each were kept, 480 MB.
    assert sizes[-1] - sizes[0] < 10e6, [round(size / 1e6, 1) for size in sizes]


def test_short_pictures_do_not_make_views_coarser(scene: Any, thread: ViewThread) -> None:
    """The start of a call is most of a coarse picture, and not a cost of its pixels."""
    wanted = replace(request(export_scene(scene)), first_seconds=0.02)
    thread._seconds = 1e-5
    assert thread._divisor(wanted) == 1
    thread._learn(0.01, 100, coarse=True, budget=0.02)
    assert thread._divisor(wanted) == 1
    thread._learn(0.05, 100, coarse=True, budget=0.02)
    assert thread._divisor(wanted) == 4
    thread._learn(0.001, 100, coarse=True, budget=0.02)
    assert thread._divisor(wanted) == 1
