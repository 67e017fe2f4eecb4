"""What ends a fit because the scene has changed, and what does not."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import images
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.parameters import Names
from edgegrad_addon.running import guard as guard_module
from edgegrad_addon.running.guard import Guard
from edgegrad_addon.session import Picture, Request, Session
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(name="start")
def _start(tmp_path: Path) -> Callable[..., Guard]:
    bs.empty(16)
    bs.camera((0, 0, 6), name="Front")
    bs.light("POINT", "Lamp")
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")))
    bs.add("Other", bs.cube("Other"), (3, 0, 0))
    images.write_image(tmp_path / "target.exr", np.zeros((16, 16, 3), np.float32))

    def start(names: Names, *paths: str) -> Guard:
        asked = Request([Picture("Front", str(tmp_path / "target.exr"))], names, iterations=2, samples=1,
                        animated=tuple(Wanted(path) for path in paths))  # fmt: skip
        return Guard(Session.prepare(bpy.context, asked), bpy.context.scene)

    return start


def cube() -> Any:
    return bpy.data.objects["Cube"]


def edit() -> None:
    bpy.context.view_layer.objects.active = cube()
    bpy.ops.object.mode_set(mode="EDIT")


def socket() -> Any:
    return bs.shader(bpy.data.materials["Clay"]).inputs["Color"]


ALL = Names(vertices=("Cube",), base_color=("Clay",), power=("Lamp",))
CHANGES: dict[str, tuple[Callable[[], Any], str]] = {
    "delete": (lambda: bpy.data.objects.remove(cube()), "object 'Cube' was deleted"),
    "unlink": (lambda: bpy.context.scene.collection.objects.unlink(cube()), "object 'Cube' was deleted"),
    "rename": (lambda: setattr(cube(), "name", "Box"), "object 'Cube' was renamed to 'Box'"),
    "replace": (lambda: (setattr(cube(), "name", "Box"), setattr(bpy.data.objects["Other"], "name", "Cube")),
                "object 'Cube' was renamed to 'Box'"),
    "edit mode": (edit, "object 'Cube' was put into Edit Mode"),
    "vertex": (lambda: setattr(cube().data.vertices[3].co, "x", 7.0), "the mesh of object 'Cube' was edited"),
    "camera": (lambda: setattr(bpy.data.objects["Front"].location, "z", 5.0), "object 'Front' was moved"),
    "color": (lambda: setattr(socket(), "default_value", (1, 0, 0, 1)),
              "the base color of material 'Clay' was changed"),
    "node": (lambda: bpy.data.materials["Clay"].node_tree.nodes.clear(),
             "the base color of material 'Clay' was removed"),
    "lens": (lambda: setattr(bpy.data.cameras["Front"], "lens", 20.0), "the lens of camera 'Front' was changed"),
    "projection": (lambda: setattr(bpy.data.cameras["Front"], "type", "ORTHO"),
                   "the lens of camera 'Front' was changed"),
    "material": (lambda: bpy.data.materials.remove(bpy.data.materials["Clay"]), "material 'Clay' was deleted"),
    "power": (lambda: setattr(bpy.data.lights["Lamp"], "energy", 1.5), "light 'Lamp' was changed"),
    "scene": (lambda: setattr(bpy.context.scene, "name", "Shot 2"), "scene 'Scene' was deleted or renamed"),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
def test_changes_of_what_is_fitted_are_found(name: str, start: Callable[..., Guard]) -> None:
    bpy.context.scene.name = "Scene"
    guard = start(ALL)
    assert guard.problem() is None
    act, sentence = CHANGES[name]
    act()
    assert guard.problem() == sentence


def test_other_work_does_not_end_a_fit(start: Callable[..., Guard]) -> None:
    guard = start(ALL)
    other = bpy.data.objects["Other"]
    other.location.x, other.name = 9.0, "Renamed"
    other.data.vertices[0].co.x = 5.0
    bpy.data.objects["Lamp"].location.x = 1.0
    cube().hide_set(True)
    bpy.context.scene.frame_set(7)
    bpy.context.scene.render.resolution_percentage = 200
    assert guard.problem() is None


def test_properties_are_watched_at_their_frame(start: Callable[..., Guard]) -> None:
    guard = start(Names(), 'objects["Other"].location')
    assert guard.problem() is None
    bpy.data.objects["Other"].location.x += 0.5
    assert guard.problem() == "property 'objects[\"Other\"].location' was changed"
    bpy.data.objects["Other"].location.x -= 0.5
    assert guard.problem() is None
    bpy.context.scene.render.resolution_percentage = 200
    assert guard.problem() == "the size of renders was changed"
    bpy.context.scene.render.resolution_percentage = 100
    bpy.context.scene.frame_set(7)
    assert guard.problem() == "the frame was changed"


def _image() -> Any:
    """Put an image on the cube."""
    image = bpy.data.images.new("Skin", 4, 4, alpha=False)
    tree = bpy.data.materials["Clay"].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    tree.links.new(node.outputs["Color"], socket())
    return image


@pytest.mark.parametrize(("act", "sentence"), [
    (lambda image: image.pixels.foreach_set(np.full(64, 0.25, np.float32)), "image 'Skin' was changed"),
    (lambda image: image.scale(2, 2), "image 'Skin' was changed"),
    (lambda image: setattr(image.colorspace_settings, "name", "Non-Color"), "image 'Skin' was changed"),
    (lambda image: setattr(image, "name", "Hide"), "image 'Skin' was renamed to 'Hide'"),
    (lambda image: bpy.data.images.remove(image), "image 'Skin' was deleted"),
])  # fmt: skip
def test_changes_of_an_image_are_found(act: Callable[[Any], Any], sentence: str, start: Callable[..., Guard]) -> None:
    image = _image()
    guard = start(Names(image=("Skin",)))
    assert guard.problem(last=True) is None
    bpy.context.scene.frame_set(7)  # pixels are the same in all frames
    act(image)
    assert guard.problem(last=True) == sentence


def test_pixels_are_looked_at_now_and_then(start: Callable[..., Guard], monkeypatch: pytest.MonkeyPatch) -> None:
    _image()
    guard = start(Names(image=("Skin",)))
    clock, looks, plain = [100.0], list[str](), guard_module._digest

    def look(image: Any) -> bytes:
        looks.append(image.name)
        clock[0] += 0.01
        return plain(image)

    monkeypatch.setattr(guard_module, "_digest", look)
    monkeypatch.setattr(guard_module, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    for seconds, count in ((0.0, 1), (0.3, 1), (0.3, 2)):
        clock[0] += seconds
        assert guard.problem() is None and len(looks) == count
    assert guard.problem(last=True) is None and len(looks) == 3
