"""Numbers that single precision cannot hold are refused by name, and no index reaches beyond a table."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Renderer, Scene
from edgegrad import expression as e
from edgegrad.scene import parameters
from tests.support.apart import apart
from tests.support.small_scenes import box, camera, floating_box, matte, need


def under_image() -> Scene:
    """A box and copies of another one under a sky with an image."""
    rng = np.random.default_rng(3)
    copies = box((0.0, 0.0, 0.0), (0.2, 0.2, 0.2), "clay")
    copies.instances = np.tile(np.eye(4), (2, 1, 1))
    copies.instances[1, :3, 3] = (0.6, 0.2, 0.0)
    return Scene(
        camera(), {"box": box((-0.4, 0.0, 0.0), (0.3, 0.3, 0.3), "clay"), "copies": copies}, {"clay": matte()},
        {"lamp": edgegrad.PointLight(np.array([0.0, 2.0, 1.0]), radius=0.01)},
        world=edgegrad.World(np.ones(3), image="sky"),
        images={"sky": edgegrad.Image(rng.uniform(0.1, 1.0, (8, 16, 3)).astype(np.float32))},
    )


# Path, the size of its values, and the words of the error.
TOO_LARGE: list[tuple[str, float, str]] = [
    ("camera.filter_width", 1e30, "camera: filter_width must not exceed"),
    ("camera.filter_width", 1e60, "camera: filter_width must not exceed"),
    ("camera.shift", 1e37, "camera: shift must not exceed"),
    ("camera.aperture_radius", 1e37, "camera: aperture_radius must not exceed"),
    ("camera.aperture_radius", 1e60, "camera: aperture_radius must not exceed"),
    ("camera.pixel_aspect", 1e37, "camera: pixel_aspect must not exceed"),
    ("camera.pixel_aspect", 1e-37, "camera: pixel_aspect must not be below"),
    ("camera.fov_x", 1e-38, "camera: fov_x must not be below"),
    ("meshes.box.vertices", 1e37, "mesh 'box': vertices must not exceed"),
    ("meshes.box.vertices", 1e60, "mesh 'box': vertices must not exceed"),
    ("meshes.copies.instances", 1e37, "mesh 'copies': instances must not exceed"),
    ("meshes.copies.instances", 1e17, ""),
    ("meshes.box.transform", 1e37, "mesh 'box': transform must not exceed"),
    ("lights.lamp.position", 1e37, "light 'lamp': position must not exceed"),
    ("lights.lamp.power", 1e60, "light 'lamp': power must not exceed"),
    ("lights.lamp.power", 1e38, "light 'lamp': the radiance that its strength, color and size make must not exceed"),
    ("world.strength", 1e60, "world: strength must not exceed"),
    ("materials.clay.emission", 1e60, "material 'clay': emission must not exceed"),
]


def give(path: str, size: float, sentence: str) -> None:
    """A new scene, `update` and `update` by name refuse the values; or render whatever they make."""
    for way in ("new", "update", "named"):
        scene = under_image()
        renderer = Renderer(scene)
        value = np.asarray(parameters.get(scene, path))
        edited = np.where(value == 0.0, 0.0, size) if value.any() else np.full(value.shape, size)
        if sentence:
            parameters.put(scene, path, edited)
        else:
            parameters.put(scene, path, size * value)
        try:
            if way == "new":
                renderer = Renderer(scene)
            else:
                renderer.update(None if way == "update" else [path])
            renderer.render(spp=2, max_depth=3)
        except ValueError as error:
            assert sentence and str(error).startswith(sentence), error
        else:
            assert not sentence, f"{way}: {path} of {size:g} passes"


def give_all() -> None:
    for path, size, sentence in TOO_LARGE:
        give(path, size, sentence)


def test_numbers_beyond_single_precision_are_refused() -> None:
    need("native")
    apart(give_all)


def test_numbers_of_expressions_are_refused() -> None:
    with pytest.raises(ValueError, match=r"expression Math: operand a must not exceed 3\.4e"):
        e.Math("MULTIPLY", 1e60, e.Channel(e.Coordinates("POSITION"), 0))


def test_what_transforms_make_of_vertices_is_refused() -> None:
    scene = floating_box()
    scene.meshes["box"].vertices = scene.meshes["box"].vertices * 1e12
    scene.meshes["box"].transform = np.diag([1e12, 1e12, 1e12, 1.0])
    with pytest.raises(ValueError, match=r"mesh 'box': transform places vertices up to 1\.1e\+24 m away; the limit"):
        Renderer(scene)


def test_the_largest_numbers_are_accepted() -> None:
    scene = floating_box()
    scene.camera.clip_end = 3e38
    scene.lights["sun"].strength = 1e38
    scene.validate()


WILD = np.array([np.nan, np.inf, -np.inf, 3e38, -3e38, 1e20, 1e-45, 0.0, 1.0], np.float32)


def look_everywhere(instruction_set: str) -> None:
    from edgegrad.rendering.native_engine import Engine

    scene = under_image()
    engine = Engine(edgegrad.tables.tables.flatten(scene), 1, instruction_set)
    w = np.stack(np.meshgrid(WILD, WILD, WILD, indexing="ij"), axis=-1).reshape(-1, 3)
    found = engine._scene.look_at_environment(np.ascontiguousarray(w))
    unit = np.isfinite(w).all(axis=1) & (np.abs(w).max(axis=1) <= 1.0)
    assert np.isfinite(found["radiance"][unit]).all()


@pytest.mark.parametrize("which", [0, -1])
def test_directions_that_are_no_numbers_stay_within_the_sky(which: int) -> None:
    need("native")
    from edgegrad.rendering.native_engine import instruction_sets

    apart(look_everywhere, instruction_sets()[which])


def read_everywhere(instruction_set: str) -> None:
    from edgegrad.expression.procedural import Brick
    from tests.support.node_cases.texture_points import at_values

    rng = np.random.default_rng(5)
    images = {"image": edgegrad.Image(rng.uniform(0.1, 1.0, (5, 7, 4)).astype(np.float32))}
    sizes = np.array([3e38, -3e38, 1e20, -1e9, 4e6, -7.3, 0.4], np.float64)
    p = np.stack(np.meshgrid(sizes, sizes, sizes, indexing="ij"), axis=-1).reshape(-1, 3)
    place = e.Attribute("P")
    infinite = e.VectorMath("MULTIPLY", place, (1e30, 1e30, 1e30))
    for vector in (place, infinite, e.VectorMath("SUBTRACT", infinite, infinite)):
        nodes: list[Any] = [
            e.ImageTexture("image", vector, interpolation, extension)
            for interpolation in ("LINEAR", "CLOSEST", "CUBIC") for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR")
        ]
        nodes += [e.ImageTexture("image", vector, projection=kind) for kind in ("SPHERE", "EQUIRECTANGULAR", "BOX")]
        nodes += [Brick(vector, squash=0.5, offset_frequency=3), Brick(vector, row_height=1e-30)]
        at_values(nodes, p, images=images, instruction_set=instruction_set)


@pytest.mark.parametrize("which", [0, -1])
def test_coordinates_of_any_size_stay_within_images(which: int) -> None:
    need("native")
    from edgegrad.rendering.native_engine import instruction_sets

    apart(read_everywhere, instruction_sets()[which])
