"""Derivatives by properties of Blender against finite differences of the picture, in blocks within the noise."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad.scene import parameters
from edgegrad_addon.animated.driver import Driver
from edgegrad_addon.animated.parameter import Wanted
from tests.support.animated import scenes as zoo
from tests.support.block_statistics import ALARM, NOTICED, check, compare
from tests.support.scenes import blender_scenes as bs

SPP, SEEDS = 48, 3
PICTURES = 6
THETAS = 6  # values of the number within the interval of the difference, whose mean the difference is


def _armature(ob: Any) -> None:
    zoo.subdivided(ob)
    rig = zoo.armature(ob)
    rig.pose.bones["Bone1"].rotation_euler = (0.2, 0.1, 0.0)


def _parented(ob: Any) -> None:
    parent = bs.add("Parent", None, (0.2, 0.1, 0.0), (0.1, 0.2, 0.3), (1.0, 1.2, 0.9))
    ob.parent = parent


def _tracked(ob: Any) -> None:
    camera = bpy.context.scene.camera
    target = bs.add("Target", None, (0.0, 0.0, 0.2))
    constraint = camera.constraints.new("TRACK_TO")
    constraint.target = target


def _bend(ob: Any) -> None:
    zoo.subdivided(ob, 3)
    bend = ob.modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.deform_axis, bend.angle = "BEND", "X", 0.4


def _array(ob: Any) -> None:
    ob.scale = (0.5, 0.5, 0.5)
    array = ob.modifiers.new("Array", "ARRAY")
    array.relative_offset_displace = (1.4, 0.2, 0.1)


def _displace(ob: Any) -> None:
    zoo.subdivided(ob, 2)
    made = ob.modifiers.new("Displace", "DISPLACE")
    made.strength = 0.2


def _material(ob: Any) -> None:
    ob.data.materials[0] = zoo.mixed_material("Mixed", 0.5)


def _glossy(ob: Any) -> None:
    ob.data.materials[0] = bs.material("Shiny", (0.8, 0.5, 0.2), "ShaderNodeBsdfPrincipled", Roughness=0.45,
                                       Metallic=0.6)  # fmt: skip


def _smoke(ob: Any) -> None:
    """A cube of smoke alone."""
    made = bs.material("Smoke", (0.8, 0.5, 0.2), "ShaderNodeBsdfDiffuse")
    tree = made.node_tree
    output = tree.get_output_node("CYCLES")
    tree.links.remove(output.inputs["Surface"].links[0])
    volume = tree.nodes.new("ShaderNodeVolumeScatter")
    volume.inputs["Density"].default_value = 0.4
    tree.links.new(volume.outputs[0], output.inputs["Volume"])
    ob.data.materials[0] = made


def _driven(ob: Any) -> None:
    zoo.subdivided(ob, 1)
    bend = ob.modifiers.new("Bend", "SIMPLE_DEFORM")
    bend.deform_method, bend.deform_axis = "TAPER", "Z"
    zoo.driven_by(ob, "Taper", 0.3, ob, 'modifiers["Bend"].factor')


def _curve(ob: Any) -> None:
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.bevel_depth, curve.resolution_u = "3D", 0.3, 6
    spline = curve.splines.new("BEZIER")
    spline.bezier_points.add(1)
    for point, place in zip(spline.bezier_points, ((-1.2, -1.0, 0.5), (1.0, -1.2, 1.2)), strict=True):
        point.co = place
        point.handle_left_type = point.handle_right_type = "AUTO"
    curve.materials.append(bpy.data.materials["Clay"])
    tube = bs.add("Tube", curve)
    # Shadow edges of light from below the planes of smooth faces are not sampled, as the plan says
    bs.offset_shadow_rays(tube, 0.0)


def _panorama(kind: str) -> None:
    lens = bpy.data.cameras["Camera"]
    lens.type = "PANO"
    owner = lens if hasattr(lens, "panorama_type") else lens.cycles
    owner.panorama_type, owner.longitude_min, owner.longitude_max, owner.fisheye_lens = kind, -0.6, 0.6, 25.0


def _nothing(_: Any) -> None:
    pass


KINDS: dict[str, tuple[Callable[[Any], None], str]] = {
    "location": (_nothing, f"{zoo.CUBE}.location[0]"),
    "rotation under a parent": (_parented, f"{zoo.CUBE}.rotation_euler[1]"),
    "scale of a parent": (_parented, 'objects["Parent"].scale[2]'),
    "target of a constraint": (_tracked, 'objects["Target"].location[0]'),
    "camera's place under a constraint": (_tracked, 'objects["Camera"].location[2]'),
    "camera's rotation": (_nothing, 'objects["Camera"].rotation_euler[2]'),
    "lens": (_nothing, 'cameras["Camera"].lens'),
    "lens of a fisheye": (lambda _: _panorama("FISHEYE_EQUISOLID"), 'cameras["Camera"].fisheye_lens'),
    "shift of a panorama": (lambda _: _panorama("EQUIRECTANGULAR"), 'cameras["Camera"].shift_x'),
    "lens shift": (_nothing, 'cameras["Camera"].shift_y'),
    "light's energy": (_nothing, 'lights["Lamp"].energy'),
    "light's size": (_nothing, 'lights["Lamp"].size'),
    "light's place": (_nothing, 'objects["Lamp"].location[1]'),
    "world": (_nothing, 'worlds["World"].node_tree.nodes["Background"].inputs[1].default_value'),
    "socket": (_glossy, 'materials["Shiny"].node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value'),
    "density": (_smoke, 'materials["Smoke"].node_tree.nodes["Volume Scatter"].inputs["Density"].default_value'),
    "input of a node group": (_material, 'materials["Mixed"].node_tree.nodes["Tint"].inputs[0].default_value'),
    "colour within a node group": (_material, 'node_groups["Tint"].nodes["Mix"].inputs[6].default_value[1]'),
    "shape key": (lambda ob: zoo.shape_key(ob, "Key 1", 7, (0.6, -0.3, 0.4)), f'{zoo.KEYS}.key_blocks["Key 1"].value'),
    "bone": (_armature, 'objects["Rig"].pose.bones["Bone1"].rotation_euler[0]'),
    "modifier": (_bend, f'{zoo.CUBE}.modifiers["Bend"].angle'),
    "strength along normals": (_displace, f'{zoo.CUBE}.modifiers["Displace"].strength'),
    "offset of copies": (_array, f'{zoo.CUBE}.modifiers["Array"].relative_offset_displace[0]'),
    "geometry nodes": (zoo.geometry_nodes, f'{zoo.CUBE}.modifiers["Nodes"]["Lift"]'),
    "lattice point": (lambda ob: zoo.lattice(ob) and None, 'lattices["Lattice"].points[7].co_deform[2]'),
    "driver's input": (_driven, f'{zoo.CUBE}["Taper"]'),
    "bevel of a curve": (_curve, 'curves["Curve"].bevel_depth'),
    "point of a curve": (_curve, 'curves["Curve"].splines[0].bezier_points[1].co[2]'),
}  # fmt: skip


def derivative(driver: Driver, wrong: float = 1.0) -> Any:
    """(THETAS, SEEDS, H, W, 3) derivative pictures by the only number of the driver, over the difference's interval."""
    one = driver.variables[0]
    h = driver.parameters[0].steps[0].size
    out = []
    for k in range(THETAS):
        value = one.value + h * (2.0 * (k + 0.5) / THETAS - 1.0)
        scene = driver.export_at({one.path: value}).scene
        tangent = {path: wrong * column for path, column in tangents(driver, scene, value).items()}
        renderer = edgegrad.Renderer(scene)
        out.append([renderer.render_forward(tangent, spp=SPP, max_depth=2, seed=SEEDS * k + seed)
                    for seed in range(SEEDS)])  # fmt: skip
    return np.array(out)


def tangents(driver: Driver, scene: edgegrad.Scene, value: Any) -> dict[str, Any]:
    """Derivative of each parameter of the scene by the number of the driver, from its transposed map."""
    name = driver.variables[0].path
    placement = driver.place({name: value})
    out = {}
    for path in placement.paths[0]:
        shape = np.shape(parameters.get(scene, path))
        column = np.zeros(shape)
        for entry in np.ndindex(*shape):
            unit = np.zeros(shape)
            unit[entry] = 1.0
            column[entry] = placement.pull({path: unit}, 0)[name][0]
        out[path] = column
    return out


def finite_difference(driver: Driver) -> tuple[Any, Any]:
    """Central difference of pictures, and its standard error."""
    one = driver.variables[0]
    h = driver.parameters[0].steps[0].size
    pictures = []
    for side in (1.0, -1.0):
        scene = driver.export_at({one.path: one.value + side * h}).scene
        renderer = edgegrad.Renderer(scene)
        pictures.append(np.stack([renderer.render(spp=16 * SPP, max_depth=2, seed=seed) for seed in range(PICTURES)]))
    found = (pictures[0].astype(np.float64) - pictures[1]) / (2.0 * h)
    return found.mean(axis=0), found.std(axis=0, ddof=1) / np.sqrt(PICTURES)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_equal_differences_of_the_picture(kind: str) -> None:
    make, path = KINDS[kind]
    make(zoo.stage())
    bpy.context.view_layer.update()
    driver = Driver(bpy.context.scene, [bpy.context.scene.camera], [Wanted(path)])
    outcome = compare(derivative(driver), *finite_difference(driver))
    assert outcome.noticed(ALARM) < NOTICED
    check(outcome)
