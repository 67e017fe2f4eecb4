"""A change of the scene that the renderer has not been told of is an error, however many objects there are."""

from __future__ import annotations

import itertools
import weakref
from collections.abc import Callable
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from edgegrad import Camera, Image, Material, Mesh, Renderer, Scene, SunLight, World, _native
from edgegrad.expression import Attribute, ImageTexture
from edgegrad.rendering.taken_over import TakenOver
from tests.support.shapes import cube


def boxes(count: int) -> Scene:
    vertices, faces = cube()
    uv = np.zeros((len(faces), 3, 2), np.float32)
    meshes = {f"box{k}": Mesh(vertices + [3.0 * k, 0.0, 0.0], faces.copy(), ("clay",), attributes={"UVMap": uv.copy()})
              for k in range(count)}
    pose = np.eye(4)
    pose[2, 3] = 50.0
    clay = Material(textures={"base_color": ImageTexture("image", Attribute("UVMap"))})
    return Scene(Camera(to_world=pose, width=4, height=4), meshes, {"clay": clay},
                 {"sun": SunLight(np.array([0.1, 0.2, -1.0]))}, World(np.full(3, 0.2)),
                 {"image": Image(np.ones((300, 300, 3), np.float32))})


def in_place(field: str, *at: Any) -> Callable[[Scene], None]:
    def change(scene: Scene) -> None:
        value = getattr(scene.meshes["box7"], field)
        for key in at:
            value = value[key]
        value += 1

    return change


def replaced(field: str, value: Any) -> Callable[[Scene], None]:
    return lambda scene: setattr(scene.meshes["box7"], field, value)


def put(scene: Scene) -> None:
    scene.meshes["box7"].attributes["more"] = np.zeros((12, 3, 1), np.float32)  # type: ignore[index]


def exchanged(scene: Scene) -> None:
    held = scene.meshes["box7"].attributes
    held["UVMap"] = held["UVMap"] + 1.0  # type: ignore[index]


def renamed(scene: Scene) -> None:
    held = scene.meshes["box7"].attributes
    held["Other"] = held.pop("UVMap")  # type: ignore[attr-defined, index]


CHANGES = {
    "vertices in place": ("vertices", in_place("vertices")),
    "indices in place": ("faces", in_place("faces")),
    "an attribute in place": ("attributes", in_place("attributes", "UVMap")),
    "transform in place": ("transform", in_place("transform")),
    "other vertices": ("vertices", replaced("vertices", np.ones((8, 3)))),
    "every second row": ("vertices", replaced("vertices", np.ones((16, 3))[::2])),
    "another number": ("terminator_offset", replaced("terminator_offset", 0.5)),
    "dimmed light": ("terminator_shading", replaced("terminator_shading", 0.5)),
    "another attribute": ("attributes", put),
    "other values of an attribute": ("attributes", exchanged),
    "another name of an attribute": ("attributes", renamed),
}


@pytest.mark.parametrize("what", CHANGES)
def test_one_changed_object_of_many_is_named(what: str) -> None:
    scene = boxes(20)
    scene.validate()
    watched = TakenOver(scene)
    watched.check(scene)
    field, change = CHANGES[what]
    change(scene)
    with pytest.raises(ValueError, match=f"^mesh 'box7': {field} has changed since the last update"):
        watched.check(scene)
    TakenOver(scene).check(scene)


@pytest.mark.parametrize("shape", [(8, 3), (7, 3), (1, 1), (300, 3)])
def test_the_least_change_of_an_array_is_found(shape: tuple[int, int]) -> None:
    held = {"values": np.linspace(-1.0, 1.0, shape[0] * shape[1]).reshape(shape)}
    values = held["values"].reshape(-1)
    step = max(1, len(values) // 64)  # these are compared
    watched = _native.HeldObjects(np.ndarray, 64)
    watched.hold(0, held)
    for k in range(0, len(values), step):
        kept = values[k]
        for other in (np.nextafter(kept, 2.0), -kept):
            values[k] = other
            assert watched.touched() == [0]
        values[k] = kept
    for wide in (1, 2) if step == 1 else (step,):  # entries, and pairs of them, change places
        pieces = values[: len(values) // wide * wide].reshape(-1, wide)
        for a, b in itertools.combinations(range(len(pieces)), 2):
            pieces[[a, b]] = pieces[[b, a]]
            assert watched.touched() == [0]
            pieces[[a, b]] = pieces[[b, a]]
    assert watched.touched() == []


def test_objects_that_are_exchanged_come_or_go_are_named() -> None:
    scene = boxes(5)
    scene.validate()
    watched = TakenOver(scene)
    boxes_ = dict(scene.meshes)
    scene.meshes = {**boxes_, "more": boxes_["box0"]}
    with pytest.raises(ValueError, match=r"^mesh 'more': was added after"):
        watched.check(scene)
    scene.meshes = {name: mesh for name, mesh in boxes_.items() if name != "box3"}
    with pytest.raises(ValueError, match=r"^mesh 'box3': was removed after"):
        watched.check(scene)
    scene.meshes = {**boxes_, "box3": boxes_["box4"]}
    with pytest.raises(ValueError, match=r"^mesh 'box3': vertices has changed"):
        watched.check(scene)
    scene.meshes = boxes_
    watched.check(scene)


def test_equal_values_in_other_objects_are_no_change() -> None:
    scene = boxes(5)
    scene.validate()
    watched = TakenOver(scene)
    mesh = scene.meshes["box2"]
    mesh.vertices = mesh.vertices.copy()
    mesh.attributes = MappingProxyType(dict(mesh.attributes))
    watched.check(scene)
    mesh.vertices[0, 0] += 1.0
    with pytest.raises(ValueError, match=r"^mesh 'box2': vertices has changed"):
        watched.check(scene)


def test_values_that_cannot_be_watched_are_compared() -> None:
    scene = boxes(5)
    scene.meshes["box2"].attributes = MappingProxyType(dict(scene.meshes["box2"].attributes))
    scene.validate()
    watched = TakenOver(scene)
    watched.check(scene)
    scene.meshes["box2"].attributes["UVMap"][...] = 2.0
    with pytest.raises(ValueError, match=r"^mesh 'box2': attributes has changed"):
        watched.check(scene)


def test_an_update_of_one_field_leaves_changes_of_others_to_be_found() -> None:
    scene = boxes(5)
    scene.validate()
    watched = TakenOver(scene)
    mesh = scene.meshes["box2"]
    mesh.vertices = mesh.vertices + 1.0
    mesh.transform = 2.0 * np.eye(4)
    watched.note(scene, ["meshes.box2.vertices"])
    with pytest.raises(ValueError, match=r"^mesh 'box2': transform has changed"):
        watched.check(scene)
    watched.note(scene, ["meshes.box2.transform"])
    watched.check(scene)
    mesh.vertices += 1.0
    with pytest.raises(ValueError, match=r"^mesh 'box2': vertices has changed"):
        watched.check(scene)


def test_values_before_an_update_are_not_kept() -> None:
    scene = boxes(3)
    scene.validate()
    watched = TakenOver(scene)
    mesh = scene.meshes["box1"]
    for layers in (["UVMap"], ["UVMap", "more"], ["UVMap"]):
        old = weakref.ref(mesh.vertices)
        mesh.vertices = mesh.vertices + 1.0
        mesh.attributes = {name: np.zeros((12, 3, 2), np.float32) for name in layers}
        watched.note(scene, ["meshes.box1.vertices", *(f"meshes.box1.attributes.{name}" for name in layers)])
        assert old() is None
        watched.check(scene)
    mesh.vertices += 1.0
    with pytest.raises(ValueError, match=r"^mesh 'box1': vertices has changed"):
        watched.check(scene)


def test_a_renderer_finds_a_forgotten_update_of_a_large_image() -> None:
    scene = boxes(2)
    renderer = Renderer(scene, threads=1)
    renderer.render(spp=1)
    scene.images["image"].pixels *= 0.5
    with pytest.raises(ValueError, match=r"^image 'image': pixels has changed since the last update"):
        renderer.render(spp=1)
