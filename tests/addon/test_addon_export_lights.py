"""Export of lights, worlds and light linking: values in closed form, and Cycles as the judge of the sky's sun."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad_addon.evaluation import evaluate
from edgegrad_addon.export.bakes import cache
from edgegrad_addon.export.geometry.memory import Memory
from edgegrad_addon.export.scene import export_evaluated
from edgegrad_addon.export.surroundings import environment
from edgegrad_addon.problem import Problem
from tests.support.scenes import blender_scenes as bs
from tests.support.scenes.disks import fill, small_disk

NORMALIZES = bpy.app.version >= (4, 5, 0)


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()
    bs.camera()
    cache._kept.clear()


def exported(name: Any = "Light") -> Any:
    made = bs.export()
    made.scene.validate()
    return made.scene.lights[name]


def sheared(kind: str, **fields: Any) -> Any:
    """A turned light under a parent with an uneven scale; returns its object."""
    lamp = bs.light(kind, "Lamp", (1, -1, 3), (0.6, 0.4, 0.3), energy=100.0, **fields)
    lamp.parent = bs.add("Parent", None, scale=(0.6, 1.4, 1.0))
    bpy.context.view_layer.update()
    return lamp


def test_sheared_area_lights_are_their_projections() -> None:
    matrix = np.array(sheared("AREA", shape="ELLIPSE", size=1.2, size_y=0.7).matrix_world)[:3, :3]
    made = bs.export()
    light, z = made.scene.lights["Lamp"], matrix[:, 2] / np.linalg.norm(matrix[:, 2])
    axes = light.to_world[:3, :3]
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-6) and axes[:, 2] == pytest.approx(z, abs=1e-6)
    # The parallelogram that the ellipse touches, seen along Z
    area = 1.2 * 0.7 * abs(np.cross(matrix[:, 0], matrix[:, 1]) @ z)
    assert light.size.prod() == pytest.approx(area, rel=1e-5)
    assert any("shears it by" in line for line in made.report.lines)


def test_lights_that_are_flattened_do_not_end_the_export() -> None:
    for kind in ("SPOT", "AREA"):
        lamp = sheared(kind)
        lamp.parent.scale = (1.0, 1.0, 0.0)
    bs.light("POINT", "Other")
    assert "Other" in bs.export().scene.lights


def test_sheared_spots_have_the_cone_that_the_scale_makes() -> None:
    matrix = np.array(sheared("SPOT", spot_size=1.1, spot_blend=0.0).matrix_world)[:3, :3]
    spot = bs.export().scene.lights["Lamp"]
    axes = np.stack([spot.across, np.cross(spot.direction, spot.across), spot.direction])
    for turn in np.linspace(0.0, 6.0, 7):
        border = np.array([np.tan(0.55) * np.cos(turn), np.tan(0.55) * np.sin(turn), -1.0])
        x, y, along = axes @ matrix @ border
        assert np.hypot(x / spot.stretch[0], y / spot.stretch[1]) / along == pytest.approx(np.tan(0.55), rel=1e-4)


def test_point_light() -> None:
    bs.light("POINT", shadow_soft_size=0.3, use_soft_falloff=False, energy=20.0, scale=(2, 2, 2)).visible_glossy = False
    light = exported()
    assert (light.power, light.radius, light.sphere) == pytest.approx((20.0, 0.3, True))
    assert light.visible_to == {"diffuse", "transmission", "shadow"} and light.casts_shadow


def test_spot_light() -> None:
    bs.light("SPOT", spot_size=0.8, spot_blend=0.4, energy=7.0, shadow_soft_size=0.2, rotation=(0.5, 0, 0))
    light = exported()
    assert (light.power, light.angle, light.blend, light.radius) == pytest.approx((7.0, 0.8, 0.4, 0.2))
    assert light.direction == pytest.approx([0.0, np.sin(0.5), -np.cos(0.5)])


def test_scaled_spot_light() -> None:
    ob = bs.light("SPOT", spot_size=0.8, spot_blend=0.0, scale=(2, 2, 1))
    assert exported().angle == pytest.approx(2.0 * np.arctan(2.0 * np.tan(0.4))) and exported().stretch is None
    ob.scale, ob.rotation_euler.z = (3, 1, 2), 0.5
    light = exported()
    assert light.stretch == pytest.approx([1.5, 0.5]) and light.angle == pytest.approx(0.8)
    assert light.across == pytest.approx([np.cos(0.5), np.sin(0.5), 0.0]) and bs.export().report.lines == []


def test_sun_and_area_lights() -> None:
    bs.light("SUN", "Sun", energy=2.0, angle=0.3)
    bs.light("AREA", "Area", shape="ELLIPSE", size=2.0, size_y=1.0, spread=1.0, scale=(2, 1, 1), energy=5.0)
    sun, area = exported("Sun"), exported("Area")
    assert (sun.strength, sun.angle) == pytest.approx((2.0, 0.3)) and "camera" not in sun.visible_to
    assert area.size == pytest.approx([4.0, 1.0]) and (area.shape, area.power) == ("ELLIPSE", 5.0)
    assert area.spread == pytest.approx(1.0)


@pytest.mark.skipif(not NORMALIZES, reason="lights have 'Normalize' from Blender 4.5 on")
@pytest.mark.parametrize(
    ("kind", "settings", "factor"),
    [("POINT", {"shadow_soft_size": 0.5}, np.pi), ("POINT", {"shadow_soft_size": 0.0}, 4.0),
     ("SPOT", {"shadow_soft_size": 0.5}, np.pi), ("SUN", {"angle": 0.5}, np.pi * np.sin(0.25) ** 2),
     ("SUN", {"angle": 0.0}, 1.0), ("AREA", {"size": 3.0}, 9.0)],
)  # fmt: skip
def test_lights_that_are_not_normalized(kind: Any, settings: Any, factor: Any) -> None:
    bs.light(kind, energy=2.0, normalize=False, **settings)
    light = exported()
    assert (light.strength if kind == "SUN" else light.power) == pytest.approx(2.0 * factor)


def test_light_nodes() -> None:
    light = bs.light("AREA", energy=2.0).data
    if bpy.app.version < (5, 1, 0):
        light.use_nodes = True
    emission = next(node for node in light.node_tree.nodes if node.type == "EMISSION")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1, 0.5, 0.25, 1), 3.0
    assert exported().color * exported().power == pytest.approx([6.0, 3.0, 1.5])
    noise = light.node_tree.nodes.new("ShaderNodeTexNoise")
    light.node_tree.links.new(noise.outputs[0], emission.inputs["Strength"])
    made = bs.export()
    color = made.scene.lights["Light"].color
    assert color / color[0] == pytest.approx([1, 0.5, 0.25], rel=1e-3) and 0.3 < color[0] < 0.7  # noise's mean is half
    assert any("light 'Light'" in line and "its strength varies" in line for line in made.report.lines)


def wired(light: Any, kind: str, output: str, target: str, **settings: Any) -> Any:
    """A node of a light, one output of which feeds an input of its Emission node."""
    if bpy.app.version < (5, 1, 0):
        light.use_nodes = True
    node = light.node_tree.nodes.new(kind)
    for key, value in settings.items():
        setattr(node, key, value)
    emission = next(one for one in light.node_tree.nodes if one.type == "EMISSION")
    light.node_tree.links.new(node.outputs[output], emission.inputs[target])
    return node


def test_nodes_of_lights_read_the_object(tmp_path: Path) -> None:
    """Beside Cycles: a light's own random number, properties of two lights that share data, a colour times a noise."""
    scene = bs.empty(32)
    scene.cycles.samples = 64
    bs.camera((0.0, 0.0, 12.0), (0.0, 0.0, 0.0))
    bs.add("Floor", bs.plane("Floor", 20.0, bs.material("White", (0.8,) * 3)))
    own = bs.light("POINT", "Own", (3, 0, 2), energy=100.0)
    wired(own.data, "ShaderNodeObjectInfo", "Random", "Color")
    panel = bs.light("AREA", "Panel", (-3, 0, 2), energy=100.0)
    panel.color = (0.2, 0.9, 0.4, 1.0)
    wired(panel.data, "ShaderNodeObjectInfo", "Color", "Color")
    wired(panel.data, "ShaderNodeTexNoise", "Fac", "Strength")
    shared = bs.light("POINT", "Shared", (0, 3, 2), energy=100.0)
    wired(shared.data, "ShaderNodeAttribute", "Color", "Color", attribute_type="OBJECT", attribute_name="tone")
    twin = bs.add("Twin", shared.data, (0, -3, 2))
    shared["tone"], twin["tone"] = (0.9, 0.3, 0.1), (0.1, 0.3, 0.9)
    made = bs.export()
    ours = edgegrad.Renderer(made.scene).render(spp=64, max_depth=made.settings.max_depth)
    quarters = [one.reshape(2, 16, 2, 16, 3).mean(axis=(1, 3)) for one in (ours, bs.cycles(tmp_path)[..., :3])]
    assert quarters[0] == pytest.approx(quarters[1], rel=0.03)
    assert [line.split(":")[0] for line in made.report.lines] == ["light 'Panel'"]


@pytest.mark.parametrize(("node", "hidden", "named"), [("Translucent", True, True), ("Translucent", False, False),
                                                       ("Diffuse", True, False)])  # fmt: skip
def test_lights_that_translucent_surfaces_see_as_another_kind_are_named(node: str, hidden: bool, named: bool) -> None:
    bs.add("Leaf", bs.plane("Leaf", 1.0, bs.material("Leaf", node=f"ShaderNodeBsdf{node}")))
    bs.light("POINT").visible_diffuse = not hidden
    assert any("light 'Light'" in line and "translucent" in line for line in bs.export().report.lines) is named


@pytest.mark.parametrize("hidden", [True, False])
def test_worlds_and_emissive_meshes_that_translucent_surfaces_see_as_another_kind_are_named(hidden: bool) -> None:
    bs.add("Leaf", bs.plane("Leaf", 1.0, bs.material("Leaf", node="ShaderNodeBsdfTranslucent")))
    lamp = bs.add("Lamp", bs.plane("Lamp", 1.0, bs.material("Glow", node="ShaderNodeEmission")), (0.0, 0.0, 2.0))
    bs.world((0.5, 0.5, 0.5))
    world = bpy.context.scene.world
    lamp.visible_diffuse = world.cycles_visibility.diffuse = not hidden
    found = [line.split(":")[0] for line in bs.export().report.lines if "translucent" in line]
    assert found == (["object 'Lamp'", f"world '{world.name}'"] if hidden else [])


def test_portals_are_left_out_and_shadows_switched_off() -> None:
    bs.light("AREA", "Portal").data.cycles.is_portal = True
    bulb = bs.light("POINT", "Bulb").data
    if hasattr(bulb.cycles, "cast_shadow"):
        bulb.cycles.cast_shadow = False
    else:
        bulb.use_shadow = False
    made = bs.export()
    assert list(made.scene.lights) == ["Bulb"] and not made.scene.lights["Bulb"].casts_shadow
    assert any("portal" in line for line in made.report.lines)


def test_light_linking() -> None:
    for name in "ABC":
        bs.add(name, bs.cube(name))
    light = bs.light("POINT")
    only, without = bpy.data.collections.new("Only"), bpy.data.collections.new("Without")
    only.objects.link(bpy.data.objects["A"])
    without.objects.link(bpy.data.objects["B"])
    without.collection_objects[0].light_linking.link_state = "EXCLUDE"
    light.light_linking.receiver_collection, light.light_linking.blocker_collection = only, without
    found = exported()
    assert found.receivers == ("A",) and sorted(found.blockers) == ["A", "C"]


def test_linking_keeps_instances_of_different_objects_apart() -> None:
    first = bs.add("A", bs.cube("A"))
    bs.add("B", first.data, (3, 0, 0))
    light = bs.light("POINT")
    only = bpy.data.collections.new("Only")
    only.objects.link(first)
    light.light_linking.receiver_collection = only
    made = bs.export()
    assert sorted(made.scene.meshes) == ["A", "B"] and made.scene.lights["Light"].receivers == ("A",)


def world() -> Any:
    bs.world((0.1, 0.2, 0.3), 2.0)
    return bpy.context.scene.world.node_tree


def test_world_visibility() -> None:
    world()
    bpy.context.scene.world.cycles_visibility.glossy = False
    assert bs.export().scene.world.visible_to == {"camera", "diffuse", "transmission", "shadow"}


def test_environment_image_turned_by_a_mapping_node() -> None:
    tree = world()
    image = bpy.data.images.new("Sky", 8, 4, float_buffer=True)
    node, mapping, coordinates = (tree.nodes.new("ShaderNode" + kind) for kind in
                                  ("TexEnvironment", "Mapping", "TexCoord"))  # fmt: skip
    node.image = image
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, 0.5)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    found = bs.export().scene.world
    assert (found.image, found.strength) == ("Sky", 2.0) and found.color == pytest.approx(np.ones(3))
    c, s = np.cos(0.5), np.sin(0.5)
    assert found.rotation == pytest.approx(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    mapping.inputs["Location"].default_value = (0.1, 0.0, 0.0)  # no rotation any more: baked
    assert bs.export(bake=16).scene.world.image == "World (baked)"


def test_baked_world_lies_in_the_directions_that_it_has() -> None:
    tree = world()
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], tree.nodes["Background"].inputs["Color"])
    before = sorted(bpy.data.scenes.keys() + bpy.data.images.keys() + bpy.data.worlds.keys() + bpy.data.cameras.keys())
    made = bs.export(bake=64)
    after = sorted(bpy.data.scenes.keys() + bpy.data.images.keys() + bpy.data.worlds.keys() + bpy.data.cameras.keys())
    assert before == after
    pixels = made.scene.images["World (baked)"].pixels
    rows, columns = np.mgrid[0:32, 0:64]
    longitude, latitude = 2 * np.pi * (0.5 - (columns + 0.5) / 64), np.pi * (0.5 - (rows + 0.5) / 32)
    x, y = np.cos(longitude) * np.cos(latitude), np.sin(longitude) * np.cos(latitude)
    directions = np.stack([x, y, np.sin(latitude)], axis=2)
    assert pixels == pytest.approx(2.0 * np.maximum(directions, 0.0), abs=0.05)


def _sky_of_turbidity(turbidity: float) -> Any:
    tree = world()
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type, sky.turbidity, sky.sun_direction = "PREETHAM", turbidity, (0.3, -0.6, 0.74)
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
    return sky


def test_smooth_worlds_are_baked_to_few_pixels_and_others_are_not() -> None:
    sky = _sky_of_turbidity(3.0)
    smooth = bs.export(bake=512).scene.images["World (baked)"].pixels
    assert smooth.shape == (128, 256, 3)
    tree = bpy.context.scene.world.node_tree
    checker, mixed = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeMix")
    mixed.data_type = "RGBA"
    mixed.inputs["Factor"].default_value = 0.2
    colors = [one for one in mixed.inputs if one.type == "RGBA"]
    tree.links.new(sky.outputs[0], colors[0])
    tree.links.new(checker.outputs["Color"], colors[1])
    tree.links.new(next(one for one in mixed.outputs if one.type == "RGBA"), tree.nodes["Background"].inputs["Color"])
    assert bs.export(bake=512).scene.images["World (baked)"].pixels.shape == (256, 512, 3)


def test_later_exports_of_a_fit_bake_a_world_to_as_many_pixels_as_the_first() -> None:
    """Else a world that becomes smooth would change its image's size, and a fit would stop."""
    memory, sky = Memory(), _sky_of_turbidity(3.0)
    tree = bpy.context.scene.world.node_tree
    checker = tree.nodes.new("ShaderNodeTexChecker")
    for output in (checker.outputs["Color"], sky.outputs[0]):
        tree.links.new(output, tree.nodes["Background"].inputs["Color"])
        made = evaluate(bpy.context.scene, lambda now: export_evaluated(now, [], 512, memory=memory))
        assert made.scene.images["World (baked)"].pixels.shape == (256, 512, 3)


def test_bakes_of_worlds_are_kept_until_what_decides_them_changes(monkeypatch: Any) -> None:
    sky = _sky_of_turbidity(3.0)
    made = []
    bake = environment._bake
    monkeypatch.setattr(environment, "_bake", lambda *given: made.append(1) or bake(*given))
    first = bs.export(bake=32).scene.images["World (baked)"].pixels
    count = len(made)
    assert np.array_equal(bs.export(bake=32).scene.images["World (baked)"].pixels, first) and len(made) == count
    sky.turbidity = 6.0
    assert not np.allclose(bs.export(bake=32).scene.images["World (baked)"].pixels, first, rtol=0.05)
    # What a driver gives cannot be told from the datablock.
    driver = bpy.context.scene.world.node_tree.driver_add(f'nodes["{sky.name}"].turbidity').driver
    driver.expression = "4.0"
    count = len(made)
    bs.export(bake=32)
    bs.export(bake=32)
    assert len(made) == count + 2


def test_a_fit_bakes_a_world_that_stays_once(monkeypatch: Any) -> None:
    _sky_of_turbidity(3.0)
    made, bake, memory = [], environment._bake, Memory()
    monkeypatch.setattr(environment, "_bake", lambda *given: made.append(1) or bake(*given))
    pictures = []
    for _ in range(3):
        one = evaluate(bpy.context.scene, lambda now: export_evaluated(now, [], 512, memory=memory))
        pictures.append(one.scene.images["World (baked)"].pixels)
    assert len(made) == 1 and all(np.array_equal(picture, pictures[0]) for picture in pictures)


def test_world_is_not_black_for_want_of_space(tmp_path: Path, monkeypatch: Any) -> None:
    tree = world()
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], tree.nodes["Background"].inputs["Color"])
    with small_disk(tmp_path / "disk", 64) as disk:
        fill(disk, leave=8192)
        monkeypatch.setattr(tempfile, "tempdir", str(disk))
        with pytest.raises(Problem, match=r"world 'World'.*temporary folder"):
            bs.export(bake=64)


@pytest.mark.slow  # Blender computes the sky's table for each picture
@pytest.mark.parametrize("elevation, size", [(0.6, 0.05), (0.12, 0.2)])  # low suns are brighter on their upper side
def test_suns_of_skies_become_lights(elevation: float, size: float, tmp_path: Any) -> None:
    """The ground under the sun of a sky: what the light gives is what the disc adds to Cycles' picture."""
    scene = bpy.context.scene
    tree = world()
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "SINGLE_SCATTERING" if bpy.app.version >= (5, 0, 0) else "NISHITA"
    sky.sun_rotation, sky.sun_elevation, sky.sun_size = 0.7, elevation, size
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.1
    bs.add("Ground", bs.plane("Ground", 20.0, bs.material("Grey")))
    made = bs.export(bake=64)
    (sun,) = made.scene.lights.values()
    assert isinstance(sun, edgegrad.SunLight) and sun.angle == pytest.approx(size)
    scene.cycles.sample_clamp_indirect = 0.0
    pictures = []
    for shown in (False, True):
        sky.sun_disc = shown
        pictures.append(bs.cycles(tmp_path).mean(axis=(0, 1)))
    ours = edgegrad.render(edgegrad.Scene(made.scene.camera, made.scene.meshes, made.scene.materials, {"sun": sun}), 64)
    assert ours.mean() == pytest.approx(np.mean(pictures[1] - pictures[0]), rel=0.01)
    # The light has one direction, and the disc is redder below.
    assert ours.mean(axis=(0, 1)) == pytest.approx(pictures[1] - pictures[0], rel=0.01 if size < 0.1 else 0.05)


def test_negative_lights_and_limits_of_bounces() -> None:
    ob = bs.light("POINT", energy=-20.0)
    assert exported().power == -20.0 and exported().max_bounces is None
    ob.data.cycles.max_bounces = 2
    assert exported().max_bounces == 2 and bs.export().report.lines == []
