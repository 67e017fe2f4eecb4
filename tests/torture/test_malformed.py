"""Malformed input gives a clear error or a right result, and a forgotten update is an error; see `malformed`."""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from itertools import islice
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Material, Renderer, Scene, images, losses
from edgegrad import expression as e
from edgegrad._fields import Checked
from edgegrad.scene import parameters
from tests.torture import malformed
from tests.torture.malformed import cases, objects, outcome
from tests.torture.malformed_files import chunked, png, whole_files
from tests.torture.malformed_stores import read as read_store
from tests.torture.malformed_stores import transforms, whole
from tests.torture.valid import COLOR, VERTICES, valid_scene

# Every so many of the malformed calls are part of the fast tests.
SHARE, SHARE_OF_FILES = 71, 9
RIGHT = ("right", "refused")

# Results, which nobody makes by hand.
RESULTS = (edgegrad.Checkpoint, edgegrad.Exchange, edgegrad.Finding, edgegrad.FitResult, edgegrad.FitStep,
           edgegrad.Plan, edgegrad.Uncertainty)  # fmt: skip


def test_every_field_of_every_public_class_has_a_check() -> None:
    public: list[Any] = [getattr(edgegrad, name) for name in edgegrad.__all__]
    checked = [c for c in (*public, losses.Pyramid) if isinstance(c, type) and issubclass(c, Checked)]
    assert {c for c in public if is_dataclass(c)} - set(checked) == set(RESULTS)
    for one in checked:
        assert set(one.checks) == {f.name for f in fields(one)}, one  # type: ignore[arg-type]


def test_malformed_calls_are_refused_or_give_right_results() -> None:
    found = {case.what: outcome(case) for case in islice(cases(), 0, None, SHARE)}
    assert len(found) > 500
    assert {what: text for what, text in found.items() if text not in RIGHT} == {}


def test_broken_files_are_refused_or_read() -> None:
    found = malformed.run_all(SHARE_OF_FILES, files=True)
    assert len(found) > 300
    assert {what: text for what, text in found.items() if text not in RIGHT} == {}


@pytest.mark.slow
@pytest.mark.parametrize("files", [False, True], ids=["calls", "files"])
def test_all_malformed_input_is_refused_or_gives_right_results(files: bool) -> None:
    found = malformed.run_all(files=files)
    assert {what: text for what, text in found.items() if text not in RIGHT} == {}


def edit(path: str, field: str, value: Any) -> Callable[[Scene], Any]:
    def change(scene: Scene) -> Any:
        setattr(objects(scene)[path], field, value)
        return edgegrad.render(scene, 1)

    return change


BOX = valid_scene().meshes["box"].faces
SENTENCES: dict[str, tuple[Callable[[Scene], Any], str]] = {
    "half a vertex": (edit("meshes.box", "faces", BOX + 0.5),
                      "mesh 'box': faces must be whole numbers, but contains 0.5"),
    "beyond 32 bits": (edit("meshes.box", "faces", BOX.astype(np.int64) + 2**32),
                       "mesh 'box': faces contains 4294967303, which is too large for an index"),
    "beyond 63 bits": (edit("meshes.box", "faces", BOX.astype(np.uint64) + np.uint64(2**63)),
                       "mesh 'box': faces contains 9223372036854775815, which is too large for an index"),
    "complex": (edit("lights.point", "position", np.zeros(3, complex)),
                "light 'point': position must be an array of real numbers, not complex numbers"),
    "masked": (edit("lights.point", "position", np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0])),
               "light 'point': position is a masked array with missing numbers; call its filled"),
    "no shadow": (edit("lights.point", "casts_shadow", "no"),
                  "light 'point': casts_shadow must be True or False, not 'no'"),
    "terminator": (edit("meshes.box", "terminator_offset", 5),
                   "mesh 'box': terminator_offset must not be above 1, but is 5"),
    "text": (edit("lights.point", "power", "7"), "light 'point': power must be a number, not '7'"),
    "flat light": (edit("lights.area", "to_world", np.zeros((4, 4))),
                   "light 'area': to_world must be a rigid transform; its axes are not orthonormal"),
    "sheared light": (edit("lights.area", "to_world", np.triu(np.ones((4, 4)))),
                      "light 'area': to_world must be a rigid"),
    "codes": (edit("images.dots", "pixels", np.full((4, 4, 3), 200, np.uint8)),
              r"image 'dots': pixels holds whole numbers \(uint8\), but must be linear light; convert "),
    "letters": (edit("meshes.box", "materials", "clay"),
                "mesh 'box': materials must be a list of names of materials, not 'clay'"),
    "no mapping": (edit("scene", "meshes", []), "scene: meshes must be a dict by name, not a value of type list"),
    "huge": (edit("world", "strength", 10**400), "world: strength is too large for a float"),
    "scalar colour": (edit("materials.clay", "base_color", 0.5),
                      r"material 'clay': base_color must have the shape \(3,\), not the single number 0.5"),
    "array texture": (edit("materials.clay", "textures", {"roughness": np.zeros((9, 9))}),
                      r"material 'clay': textures\['roughness'\] must be an edgegrad.expression, not an array of"),
    "near name": (edit("meshes.box", "materials", ("paint", "cley")),
                  "mesh 'box': material 'cley' is not in the scene; did you mean 'clay'"),
    "missing UV map": (edit("materials.paint", "textures", {"base_color": e.Attribute("UVMpa")}),
                       "material 'paint': textures read the attribute 'UVMpa', which is not in attributes of any mesh "
                       "or field with the material; did you mean 'UVMap'"),
    "bounces": (lambda s: edgegrad.render(s, 1, bounces=(1, 1, 1, 1)),  # type: ignore[arg-type]
                "render: bounces must be an edgegrad.Bounces, not a value of type tuple"),
    "terms": (lambda s: edgegrad.render_backward(s, np.zeros((4, 4, 3)), [COLOR], 1, terms=3),  # type: ignore[arg-type]
              "render: terms must be a list of interior, primary, shadow, indirect, not 3"),
    "wrt": (lambda s: edgegrad.render_backward(s, np.zeros((4, 4, 3)), None, 1),  # type: ignore[arg-type]
            "render_backward: wrt must be a list of parameter paths, not None"),
    "path": (lambda s: edgegrad.plan(s, [5]),  # type: ignore[list-item]
             "plan: wrt must be a list of parameter paths, but contains 5"),
    "engine": (lambda s: edgegrad.render(s, 1, engine={}),  # type: ignore[arg-type]
               "engine must be 'auto', 'native' or 'reference', not a value of type dict"),
    "progress": (lambda s: edgegrad.render(s, 1, progress=5),  # type: ignore[arg-type]
                 "render: progress must be a function, not 5"),
    "callback": (lambda s: edgegrad.fit(s, np.zeros((4, 4, 3)), [COLOR], callback="print"),  # type: ignore[arg-type]
                 "fit: callback must be a function, not 'print'"),
    "loss": (lambda s: edgegrad.fit(s, np.zeros((4, 4, 3)), [COLOR], loss="l2"),  # type: ignore[arg-type]
             "fit: loss must be a function, not 'l2'"),
    "slide": (lambda s: edgegrad.fit(s, np.zeros((4, 4, 3)), [VERTICES], slide="0.5"),  # type: ignore[arg-type]
              "fit: slide must be a number, not '0.5'"),
    "uint8 target": (lambda s: edgegrad.fit(s, np.full((4, 4, 3), 200, np.uint8), [COLOR]),
                     r"target 0: image holds whole numbers \(uint8\), but must be linear light"),
    "loss's result": (lambda s: edgegrad.fit(s, np.zeros((4, 4, 3)), [COLOR], iterations=1, spp=1, loss=lambda *a: 1.0),  # type: ignore[arg-type]
                      r"fit: loss must return \(value, adjoint\), not 1.0"),
    "nan picture": (lambda s: losses.l2(np.full((4, 4, 3), np.nan), np.zeros((4, 4, 3))),
                    r"loss: image has 48 non-finite values, the first at \(0, 0, 0\)"),
}  # fmt: skip


@pytest.mark.parametrize("name", SENTENCES)
def test_each_error_is_one_clear_sentence(name: str) -> None:
    call, sentence = SENTENCES[name]
    with pytest.raises(ValueError, match=f"^{sentence}"):
        call(valid_scene())


def test_misspelt_fields_are_refused_with_the_near_name() -> None:
    with pytest.raises(AttributeError, match=r"^Material has no field 'rougness'; did you mean 'roughness'\?$"):
        Material().rougness = 0.1


@pytest.mark.parametrize("name", ["cut.exr", "window.exr", "profile.png", "packed.png"])
def test_broken_files_say_what_is_broken(name: str, tmp_path: Any) -> None:
    data, words = {
        "cut.exr": (whole_files()["ZIP_float32.exr"][:-9], "its pixels can't be read; the file is cut off or damaged"),
        "window.exr": (_with_display(whole_files()["ZIP_float32.exr"], 9_000_000),
                       r"its displayWindow of 18 x 9000001 pixels exceeds 65536 a side"),
        "profile.png": (png(2, 8, 3, chunked(b"iCCP", b"x\0\0" + zlib.compress(b"no profile" * 20))),
                        "its colour profile is broken; remove it, or save the picture as sRGB"),
        "packed.png": (png(2, 8, 3, chunked(b"iCCP", b"x\0\0no compressed data")), "its colour profile is broken"),
    }[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ValueError, match=f"^image '.*{name}': {words}"):
        images.read_image(tmp_path / name)


def test_broken_stores_say_what_is_broken() -> None:
    data = bytearray(whole()["checkpoint"]["a.npz"])
    for place in re.finditer(b"PK\x01\x02", data):
        data[place.start() + 8] |= 1  # an archive's mark of encrypted parts
    with pytest.raises(ValueError, match=r"^checkpoint '.*a\.npz': is damaged or is no checkpoint of a fit"):
        read_store("checkpoint", {"a.npz": bytes(data)})
    text = json.dumps({**transforms(), "cx": 1e30}).encode()
    with pytest.raises(ValueError, match=r"^calibration '.*transforms\.json': picture 'a\.png': camera: shift "):
        read_store("transforms", {"transforms.json": text})
    text = json.dumps({**transforms(), "frames": [{**transforms()["frames"][0], "file_path": "x" * 1000}]}).encode()
    assert len(read_store("transforms", {"transforms.json": text})) == 1


@pytest.mark.parametrize(("fields", "words"), [
    ({"image": [[1.0], [1.0, 2.0]]}, "image cannot be read as an array of numbers"),
    ({"gain": [[1.0], [1.0, 2.0]]}, "gain cannot be read as an array of numbers"),
    ({"gain": 1e-320}, "gain of 1e-320 makes the image larger than single precision holds"),
])
def test_wrong_targets_say_what_is_wrong(fields: dict[str, Any], words: str) -> None:
    target = edgegrad.Target(**{"image": np.ones((4, 4, 3), np.float32), **fields})
    with pytest.raises(ValueError, match=f"^target 0: {words}"):
        edgegrad.fit(valid_scene(), target, [COLOR], iterations=1, spp=1, threads=1)


def _with_display(data: bytes, bottom: int) -> bytes:
    head = b"displayWindow\0box2i\0"
    at = data.index(head) + len(head) + 4
    return data[: at + 12] + np.int32(bottom).tobytes() + data[at + 16 :]


# ---- Forgotten updates ----
def moved(matrix: np.ndarray) -> np.ndarray:
    out = matrix.copy()
    out[..., :3, 3] += 0.2
    return out


# Field (of all classes that have it) to what gives it another valid value.
CHANGES: dict[str, Callable[[Any], Any]] = {
    "to_world": moved, "transform": moved, "instances": moved, "vertices": lambda v: 1.1 * v,
    "rotation": lambda v: v[[1, 0, 2]], "kind": lambda v: "ORTHOGRAPHIC" if v == "PERSPECTIVE" else "DIFFUSE",
    "filter": lambda v: "GAUSSIAN", "crop": lambda v: (0, 0, 2, 3), "shape": lambda v: "ELLIPSE",
    "falloff": lambda v: "LINEAR", "image": lambda v: None, "visible_to": lambda v: v - {"diffuse"},
    "decay": lambda v: "CONSTANT",
    "receivers": lambda v: ("box",), "blockers": lambda v: ("copies",), "textures": lambda v: {},
    "materials": lambda v: v[::-1], "parts": lambda v: v[::-1], "face_material": lambda v: 1 - v,
    "attributes": lambda v: {} if v else {"new": np.ones((2, 2, 2, 3), np.float32)},
    "instance_attributes": lambda v: {"own": 0.5 * v["own"]},
    "normal_uv": lambda v: "UV", "normal_space": lambda v: "WORLD", "distribution": lambda v: "BECKMANN",
    "width": lambda v: v + 1, "height": lambda v: v + 1,
    "aperture_blades": lambda v: 5, "smoothing": lambda v: np.where(v == 0, -1, v), "coat_ior": lambda v: 1.6,
    "material": lambda v: "clay",
    "normals": lambda v: v + [0.3, 0.0, 0.0], "clip_start": lambda v: 3.0, "pixels": lambda v: 0.5 * v,
}  # fmt: skip
# Fields that can't be changed by themselves: topology, what is the only one of its kind, what glows as instances, and
# what fields can't have.
ALONE = ("meshes.box.faces", "meshes.copies.faces", "meshes.box.attributes", "meshes.copies.attributes",
         "meshes.box.instance_attributes",
         "meshes.copies.materials", "materials.clay.textures", "materials.sum.textures", "materials.clay.emission",
         "lights.area.shape", "materials.wax.emission", "materials.wax.anisotropy", "materials.wax.textures")


def other_value(field: str, value: Any) -> Any:
    if field in CHANGES:
        return CHANGES[field](value)
    if isinstance(value, bool):
        return not value
    return 0.85 * value + 0.02 if isinstance(value, (float, np.ndarray)) else value


def fields_to_change() -> list[str]:
    scene = valid_scene()
    scene.validate()
    out = [f"{path}.{f.name}" for path, held in objects(scene).items() if path != "scene" for f in fields(held)
           if getattr(held, f.name) is not None or f.name in ("crop", "receivers", "blockers")]
    return [path for path in out if path not in ALONE]


def change(scene: Scene, path: str) -> None:
    where, _, field = path.rpartition(".")
    held = objects(scene)[where]
    setattr(held, field, other_value(field, getattr(held, field)))
    if field == "textures" and where == "materials.paint":
        scene.materials["paint"].textures = {"base_color": e.Attribute("UVMap")}


@pytest.mark.parametrize("path", fields_to_change())
def test_a_forgotten_update_is_an_error_and_an_update_shows_every_field(path: str) -> None:
    scene = valid_scene()
    renderer = Renderer(scene, threads=1)
    edgegrad.render(scene, 1, threads=1, max_depth=3)
    change(scene, path)
    with pytest.raises(ValueError, match=f"{path.rpartition('.')[2]} has changed since the last update"):
        renderer.render(spp=1)
    fresh = Renderer(scene, threads=1).render(spp=16, max_depth=3)
    np.testing.assert_array_equal(edgegrad.render(scene, 16, threads=1, max_depth=3), fresh)
    renderer.update()
    # Positions are relative to the first scene's centre: a few paths round to another side of an edge.
    assert np.mean(np.abs(renderer.render(spp=16, max_depth=3) - fresh)) < 0.02 * np.mean(np.abs(fresh))


def test_an_update_that_names_another_path_is_an_error() -> None:
    scene = valid_scene()
    renderer = Renderer(scene, threads=1)
    scene.materials["clay"].base_color = np.full(3, 0.2)
    scene.lights["sun"].strength = 2.0
    renderer.update(["lights.sun.strength"])
    with pytest.raises(ValueError, match=r"^material 'clay': base_color has changed since the last update"):
        renderer.render_backward(np.zeros((4, 4, 3)), [COLOR], spp=1)
    renderer.update([COLOR])
    renderer.render(spp=1)


def test_numbers_changed_in_place_and_objects_that_come_and_go_need_an_update_too() -> None:
    scene = valid_scene()
    renderer = Renderer(scene, threads=1)
    scene.meshes["box"].vertices *= 1.1
    with pytest.raises(ValueError, match=r"^mesh 'box': vertices has changed since the last update"):
        renderer.render(spp=1)
    renderer.update()
    lights = dict(scene.lights)
    scene.lights = {**lights, "more": edgegrad.PointLight(np.ones(3))}
    with pytest.raises(ValueError, match=r"^light 'more': was added after the last update"):
        renderer.render(spp=1)
    scene.lights = {name: light for name, light in lights.items() if name != "sun"}
    with pytest.raises(ValueError, match=r"^light 'sun': was removed after the last update"):
        renderer.render(spp=1)
    scene.lights = lights
    renderer.render(spp=1)


def test_a_fit_does_not_look_for_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    from edgegrad.rendering.taken_over import TakenOver

    def never(*arguments: Any, **options: Any) -> None:
        raise AssertionError("looked for changes")

    monkeypatch.setattr(TakenOver, "check", never)
    monkeypatch.setattr(TakenOver, "note", never)
    edgegrad.fit(valid_scene(), np.zeros((4, 4, 3)), [COLOR], iterations=2, spp=1, threads=1)


def test_parameters_say_the_near_name() -> None:
    with pytest.raises(ValueError, match=r"'rougness' is not one of the fields .*; did you mean 'roughness'\?$"):
        parameters.get(valid_scene(), "materials.clay.rougness")
