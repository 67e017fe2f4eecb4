"""Valid calls of every public function, and a small scene that has an object of every public class."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

import edgegrad
from edgegrad import expression as e
from edgegrad import images, losses
from edgegrad.scene import parameters
from tests.support import shapes
from tests.support.fields.splines import exact_sphere
from tests.torture import valid_conversions

SIDE = 4
VERTICES, COLOR = "meshes.box.vertices", "materials.clay.base_color"

# Argument or field to other words that an error about it may have.
NAMES: dict[str, tuple[str, ...]] = {
    "scene": ("camera", "meshes", "materials", "lights", "world", "images"),
    "wrt": ("parameter path",), "paths": ("parameter path", "unknown"), "targets": ("target",), "path": ("image",),
    "tangent": ("parameter path",), "camera": ("to_world",), "step_sizes": ("step size",),
    "image": ("picture", "pixels"), "dimage": ("derivative_image",), "meshes": ("mesh",),
    "lights": ("nothing emits light",),
    "materials": ("material",), "world": ("nothing emits light",), "instances": ("mesh",),
    "width": ("crop",), "height": ("crop",),
    "strength": ("nothing emits light",), "clip_start": ("clip_end",), "clip_end": ("clip_start",),
    "vertices": ("faces", "mesh 'box': is empty"), "faces": ("mesh 'box'",), "parts": ("part", "weights"),
    "images": ("image",), "attributes": ("attribute",), "smoothing": ("normals",), "weights": ("parts",),
    "loss": ("fit",),
    **valid_conversions.NAMES,
    "value": ("'materials.clay.base_color'", "material 'clay': base_color"), "spp": ("samples",),
}  # fmt: skip


def valid_scene() -> edgegrad.Scene:
    """A box, instances, every kind of light and of material, textures, an environment's image; a picture of 4 x 4."""
    vertices, faces = shapes.cube(1.0)
    vertices, faces = vertices.astype(np.float64), faces.astype(np.int32)
    rng = np.random.default_rng(1)
    camera = shapes.camera()
    camera.width = camera.height = SIDE
    pose = np.eye(4)
    pose[:3, 3] = [0.0, 0.0, 4.0]
    places = np.tile(np.eye(4), (2, 1, 1))
    places[0, 0, 3], places[1, 0, 3] = 2.0, -2.0
    return edgegrad.Scene(
        camera,
        {
            "box": edgegrad.Mesh(vertices, faces, ("paint", "sum"), face_material=np.arange(12, dtype=np.int32) % 2,
                                 smoothing=faces.copy(), normals=vertices.copy(),
                                 attributes={"UVMap": rng.random((12, 3, 2)).astype(np.float32)}),
            "copies": edgegrad.Mesh(vertices, faces, ("clay",), instances=places,
                                    instance_attributes={"own": np.linspace(0.1, 0.9, len(places))[:, None]}),
        },
        {
            "paint": edgegrad.Material(textures={"base_color": e.ImageTexture("dots", e.Attribute("UVMap"))}),
            "clay": edgegrad.Material(np.array([0.6, 0.5, 0.4])),
            "wax": edgegrad.Material(np.array([0.7, 0.6, 0.3])),
            "sum": edgegrad.Mixture(("clay", "paint"), np.array([0.3, 0.7])),
        },
        {
            "point": edgegrad.PointLight(np.array([2.0, -4.0, 3.0]), 300.0, 0.2),
            "spot": edgegrad.SpotLight(np.array([0.0, -4.0, 3.0]), np.array([0.0, 4.0, -3.0]), 300.0),
            "sun": edgegrad.SunLight(np.array([0.0, 0.3, -1.0]), 1.0, 0.1),
            "area": edgegrad.AreaLight(pose),
        },
        edgegrad.World(np.ones(3), 0.3, "sky"),
        {"dots": edgegrad.Image(rng.random((4, 4, 3)).astype(np.float32)),
         "sky": edgegrad.Image(rng.random((4, 8, 3)).astype(np.float32))},
        {"drop": valid_field()},
    )  # fmt: skip


def valid_field() -> edgegrad.Field:
    """A ball."""
    return exact_sphere(0.6, 8, material="wax", transform=np.eye(4) + np.eye(4, k=3))


@dataclass
class Call:
    """A valid call: `make` gives its arguments anew, `function` takes them."""

    name: str
    function: Callable[..., Any]
    arguments: Callable[[], dict[str, Any]]

    def run(self, changes: dict[str, Any]) -> Any:
        return self.function(**{**self.arguments(), **changes})


def _rays() -> dict[str, Any]:
    return {"spp": 1, "max_depth": 2, "seed": 0, "bounces": edgegrad.Bounces(), "threads": 1, "engine": "native",
            "progress": None}


def _zeros() -> np.ndarray:
    return np.random.default_rng(3).random((SIDE, SIDE, 3)).astype(np.float32)


def _render(**options: Any) -> Any:
    return edgegrad.render(**options)


def _renderer(scene: Any, threads: Any, engine: Any, learn: Any) -> Any:
    return edgegrad.Renderer(scene, threads=threads, engine=engine, learn=learn).render(spp=1)


def _renderer_render(camera: Any) -> Any:
    return edgegrad.Renderer(valid_scene(), threads=1).render(spp=1, camera=camera)


def _update(paths: Any) -> Any:
    renderer = edgegrad.Renderer(valid_scene(), threads=1)
    renderer.update(paths)
    return renderer.render(spp=1)


def _fit(**options: Any) -> Any:
    edgegrad.fit(**options)


def _target(**options: Any) -> Any:
    edgegrad.fit(valid_scene(), edgegrad.Target(**options), [COLOR], iterations=1, spp=1, threads=1)


def _silhouette(**options: Any) -> Any:
    edgegrad.fit(valid_scene(), edgegrad.Target(**options), [VERTICES], iterations=1, spp=1, threads=1)


def _bounces(**options: Any) -> Any:
    return edgegrad.render(valid_scene(), 1, threads=1, bounces=edgegrad.Bounces(**options))


def _pyramid(levels: Any, power: Any, focus: Any, image: Any, target: Any, mask: Any) -> Any:
    return losses.Pyramid(levels, power, focus)(image, target, mask)


def _at(progress: Any) -> Any:
    return losses.Pyramid().at(progress)


def _put(path: Any, value: Any) -> Any:
    scene = valid_scene()
    parameters.put(scene, path, value)
    return edgegrad.render(scene, 1, threads=1)


def _plan(**options: Any) -> Any:
    return str(edgegrad.plan(**options))


def _written(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that writes a file, in a folder of its own."""
    def call(**options: Any) -> Any:
        before = Path.cwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                return function(**options)
            finally:
                os.chdir(before)
    return call


def _read(path: Any) -> Any:
    return images.read_image(path)


def valid_calls() -> list[Call]:
    """A valid call of each public function."""
    picture = {"image": _zeros(), "target": 0.5 * _zeros(), "mask": np.ones((SIDE, SIDE))}
    held = Path(tempfile.gettempdir()) / "edgegrad_malformed.exr"
    images.write_image(held, _zeros())
    return [
        Call("render", _render, lambda: {"scene": valid_scene(), **_rays()}),
        Call("render_forward", edgegrad.render_forward,
             lambda: {"scene": valid_scene(), "tangent": {COLOR: np.ones(3)}, "terms": edgegrad.TERMS, **_rays()}),
        Call("render_backward", edgegrad.render_backward,
             lambda: {"scene": valid_scene(), "adjoint": _zeros(), "wrt": [COLOR], "terms": edgegrad.TERMS, **_rays()}),
        Call("tangent", lambda value: edgegrad.render_forward(valid_scene(), {COLOR: value}, 1, threads=1),
             lambda: {"value": np.ones(3)}),
        Call("Renderer", _renderer, lambda: {"scene": valid_scene(), "threads": 1, "engine": "native", "learn": False}),
        Call("Renderer.render", _renderer_render, lambda: {"camera": valid_scene().camera}),
        Call("Renderer.update", _update, lambda: {"paths": [COLOR]}),
        Call("plan", _plan, lambda: {"scene": valid_scene(), "wrt": [VERTICES], "max_depth": 2}),
        Call("differentiable", edgegrad.differentiable, lambda: {"scene": valid_scene()}),
        Call("fit", _fit, lambda: {
            "scene": valid_scene(), "targets": _zeros(), "wrt": [VERTICES], "iterations": 1, "spp": 1,
            "gradient_spp": 1, "max_depth": 2, "bounces": None, "loss": losses.l2, "smoothness": None, "slide": 0.5,
            "step_sizes": {}, "views_per_iteration": 1, "seed": 0, "threads": 1, "engine": "native",
            "on_cancel": "restore", "callback": lambda step: True, "progress": None}),
        Call("Target", _target,
             lambda: {"image": _zeros(), "camera": None, "mask": np.ones((SIDE, SIDE)), "weight": 1.0,
                      "alpha": "world", "gain": 1.0, "shared": "", "objects": None}),
        Call("Target of a silhouette", _silhouette,
             lambda: {"image": np.ones((SIDE, SIDE), np.float32), "objects": ("box",)}),
        Call("Bounces", _bounces, lambda: {"diffuse": 3, "glossy": 3, "transmission": 3, "transparent": 3,
                                           "filter_glossy": 1.0}),
        Call("l1", losses.l1, lambda: dict(picture)),
        Call("l2", losses.l2, lambda: dict(picture)),
        Call("Pyramid", _pyramid, lambda: {"levels": None, "power": 2, "focus": 0.5, **picture}),
        Call("Pyramid.at", _at, lambda: {"progress": 0.5}),
        Call("parameters.put", _put, lambda: {"path": COLOR, "value": np.full(3, 0.5)}),
        Call("read_image", _read, lambda: {"path": str(held)}),
        Call("write_image", _written(images.write_image), lambda: {"path": "a.exr", "image": _zeros(), "half": False}),
        Call("write_image png", _written(images.write_image), lambda: {"path": "a.png", "image": _zeros()}),
        Call("derivative_image", images.derivative_image, lambda: {"dimage": _zeros(), "scale": 1.0}),
        Call("write_derivative", _written(images.write_derivative),
             lambda: {"path": "a.png", "dimage": _zeros(), "scale": 1.0}),
        Call("srgb_to_linear", images.srgb_to_linear, lambda: {"code": _zeros()}),
        Call("linear_to_srgb", images.linear_to_srgb, lambda: {"light": _zeros()}),
        *(Call(*call) for call in valid_conversions.calls()),
    ]  # fmt: skip


def nodes() -> dict[str, tuple[type, dict[str, Any]]]:
    """Every kind of expression with valid values of all its fields, by its name."""
    given: dict[tuple[str, str], Any] = {
        ("Attribute", "name"): "UVMap", ("ImageTexture", "image"): "dots", ("Channel", "index"): 1,
        ("Ramp", "table"): ((0.0,) * 4, (1.0,) * 4), ("Curves", "table"): ((0.0,) * 3, (1.0,) * 3),
        ("Transform", "matrix"): tuple(tuple(row) for row in np.eye(3, 4).tolist()),
        ("ColorModel", "source"): "RGB", ("ColorModel", "target"): "HSV",
    }  # fmt: skip
    out: dict[str, tuple[type, dict[str, Any]]] = {}
    for name, kind in vars(e).items():
        if isinstance(kind, type) and issubclass(kind, e.Expression) and kind is not e.Expression:
            options: dict[str, Any] = {}
            for f in fields(kind):  # type: ignore[arg-type]
                words = kind.choices.get(f.name)
                value = 0.5 if f.default is MISSING else f.default
                options[f.name] = given.get((name, f.name), words[0] if words and f.default is MISSING else value)
            out[name] = (kind, options)
    return out
