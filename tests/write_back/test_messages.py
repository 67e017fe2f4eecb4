"""What stops a fit names the thing and the cure; what is rendered otherwise than the user may expect is a warning."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad import images
from edgegrad_addon.animated.parameter import Wanted
from edgegrad_addon.parameters import Names
from edgegrad_addon.problem import Problem
from edgegrad_addon.session import Picture, Request, Session
from tests.support.scenes import blender_scenes as bs

CUBE, CLAY, BULB = Names(vertices=("Cube",)), Names(base_color=("Clay",)), Names(power=("Bulb",))
LOCATION = (Wanted('objects["Cube"].location'),)


@pytest.fixture(autouse=True)
def _scene() -> None:
    stage()


def stage() -> None:
    bs.empty(16)
    bs.camera(name="Front")
    bs.light("POINT", "Bulb")
    bs.add("Cube", bs.cube("Cube", bs.material("Clay")))


def prepare(folder: Path, names: Names, camera: str = "Front", picture: str = "target.exr", width: int = 16,
            animated: tuple[Wanted, ...] = (), targets: int = 1) -> Session:  # fmt: skip
    images.write_image(folder / "target.exr", np.full((16, width, 3), 0.5, np.float32))
    path = str(folder / picture) if picture else ""
    return Session.prepare(bpy.context, Request([Picture(camera, path)] * targets, names, animated=animated))


def lib(folder: Path, override: bool) -> Any:
    """Replace the cube by one from a library, or by its override."""
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "library.blend"))
    stage()
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (_, target):
        target.objects = ["Cube"]
    bpy.context.collection.objects.link(target.objects[0])
    if override:
        ob = target.objects[0].override_create(remap_local_usages=True)
        ob.data = ob.data.override_create(remap_local_usages=True)


def color() -> Any:
    return bs.shader(bpy.data.materials["Clay"]).inputs["Color"]


def textured(kind: str, **settings: Any) -> Any:
    """Link a new node to the colour of the material."""
    tree = bpy.data.materials["Clay"].node_tree
    node = tree.nodes.new(kind)
    node.name = "Paint"
    for name, value in settings.items():
        setattr(node, name, value)
    tree.links.new(node.outputs[0], color())
    return node


def hide() -> None:
    bpy.data.objects["Cube"].hide_render = True


def edit() -> None:
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    bpy.ops.object.mode_set(mode="EDIT")


# What is done to the scene, the arguments of `prepare`, and words of the message: the thing, the trouble, the cure.
REFUSED: dict[str, tuple[Callable[[], Any] | None, dict[str, Any], tuple[str, ...]]] = {
    "no target": (None, {"names": CUBE, "targets": 0}, ("no target", "add a camera and its target picture")),
    "no picture": (None, {"names": CUBE, "picture": ""}, ("camera 'Front'", "has no picture", "choose one")),
    "missing picture": (None, {"names": CUBE, "picture": "none.png"}, ("none.png'", "there is no such file")),
    "no camera": (None, {"names": CUBE, "camera": ""}, ("target 1", "has no camera", "choose one")),
    "another camera": (None, {"names": CUBE, "camera": "Back"}, ("'Back'", "no such camera", "'Front'")),
    "other aspect": (None, {"names": CUBE, "width": 32},
                     ("target.exr'", "32 x 16", "camera 'Front'", "16 x 16, of another aspect", "crop the image")),
    "no parameter": (None, {"names": Names()}, ("no parameter is chosen", "choose at least one")),
    "a light's vertices": (None, {"names": Names(vertices=("Bulb",))}, ("'Bulb'", "is a light", "meshes")),
    "hidden": (hide, {"names": CUBE}, ("'Cube'", "isn't rendered", "show it in renders")),
    "edit mode": (edit, {"names": CUBE}, ("'Cube'", "is in edit mode", "leave it")),
    "driven colour": (lambda: color().driver_add("default_value", 0), {"names": CLAY},
                      ('materials["Clay"]', "is driven", "remove its driver")),
    "keyed colour": (lambda: color().keyframe_insert("default_value"), {"names": CLAY},
                     ('materials["Clay"]', "is keyed", "remove its keyframes")),
    "driven power": (lambda: bpy.data.lights["Bulb"].driver_add("energy"), {"names": BULB},
                     ('lights["Bulb"].energy', "is driven", "remove its driver")),
    "keyed power": (lambda: bpy.data.lights["Bulb"].keyframe_insert("energy"), {"names": BULB},
                    ('lights["Bulb"].energy', "is keyed", "remove its keyframes")),
    "driven property": (lambda: bpy.data.objects["Cube"].driver_add("location", 1),
                        {"names": Names(), "animated": LOCATION}, ("location[1]", "is driven", "remove its driver")),
    "keyed property": (lambda: bpy.data.objects["Cube"].keyframe_insert("location"),
                       {"names": Names(), "animated": LOCATION}, ("location[0]", "is keyed", "remove its keyframes")),
    "fed colour": (lambda: textured("ShaderNodeTexNoise"), {"names": CLAY},
                   ("'Clay'", "is fed by node 'Paint'", "unlink it")),
    "no colour": (lambda: bpy.data.materials["Clay"].node_tree.nodes.remove(color().node), {"names": CLAY},
                  ("'Clay'", "has no node whose base color can be written", "as properties instead")),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_fit_that_cannot_run_says_why(name: str, tmp_path: Path) -> None:
    spoil, arguments, words = REFUSED[name]
    if spoil is not None:
        spoil()
    try:
        with pytest.raises((Problem, ValueError)) as caught:
            prepare(tmp_path, **arguments)
    finally:
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
    assert all(word in str(caught.value) for word in words), str(caught.value)
    assert "\n" not in str(caught.value)


FOREIGN = {
    "vertices": ({"names": CUBE}, "object 'Cube': its mesh 'Cube"),
    "colour": ({"names": Names(base_color=("Clay [library.blend]",))}, "material 'Clay"),
    "property": ({"names": Names(), "animated": LOCATION}, 'objects["Cube"]'),
}


@pytest.mark.parametrize("name", FOREIGN)
@pytest.mark.parametrize("override", [False, True])
def test_data_of_other_files_are_not_fitted(name: str, override: bool, tmp_path: Path) -> None:
    arguments, words = FOREIGN[name]
    lib(tmp_path, override)
    with pytest.raises(Problem) as caught:
        prepare(tmp_path, **arguments)  # type: ignore[arg-type]
    said = str(caught.value)
    assert words in said and "make it local first" in said, said
    assert ("library override" in said) == (override and name != "colour"), said


def paint_without_map() -> None:
    textured("ShaderNodeTexImage", image=bpy.data.images.new("Pattern", 4, 4))


def paint_by_another_map() -> None:
    bpy.data.meshes["Cube"].uv_layers.new(name="Mine")
    paint_without_map()
    tree = bpy.data.materials["Clay"].node_tree
    node = tree.nodes.new("ShaderNodeUVMap")
    node.uv_map = "Gone"
    tree.links.new(node.outputs[0], tree.nodes["Paint"].inputs[0])


WARNED: dict[str, tuple[Callable[[], Any], tuple[str, ...]]] = {
    "no UV map": (paint_without_map, ("object 'Cube': has no UV map", "material 'Clay'", "unwrap the mesh")),
    "missing UV map": (paint_by_another_map, ("object 'Cube': ", "'Gone'", "material 'Clay'", "add it")),
    "unset image": (lambda: textured("ShaderNodeTexImage"), ("material 'Clay': node 'Paint' has no image", "magenta")),
    "unsupported node": (lambda: textured("ShaderNodeBevel"), ("material 'Clay': ", "node 'Paint'", "can't be read")),
}


@pytest.mark.parametrize("name", WARNED)
def test_what_looks_otherwise_is_a_warning(name: str, tmp_path: Path) -> None:
    spoil, words = WARNED[name]
    spoil()
    lines = prepare(tmp_path, CUBE).export.report.lines
    assert len(lines) == 1 and all(word in lines[0] for word in words), lines
