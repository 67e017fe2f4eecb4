"""Settings of scenes, view layers, worlds and lights: exported values, and Cycles as the judge of small pictures."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad_addon import parameters
from edgegrad_addon.export.effects import first_surfaces
from edgegrad_addon.problem import Problem
from tests.support.scenes import blender_scenes as bs


@pytest.fixture(name="scene", autouse=True)
def _scene() -> Any:
    scene = bs.empty()
    bs.camera()
    return scene


def ground(color: Any = (0.5, 0.5, 0.5), size: float = 20.0) -> Any:
    return bs.add("Ground", bs.plane("Ground", size, bs.material("Ground", color)))


def mean(made: Any, samples: int = 64) -> Any:
    limits = made.settings
    picture = edgegrad.Renderer(made.scene).render(spp=samples, max_depth=limits.max_depth, bounces=limits.bounces)
    return picture.mean(axis=(0, 1))


def mixed_world(output: str, others: Any = (0.2, 0.4, 0.6), seen: Any = (0.9, 0.3, 0.1)) -> Any:
    """A world of one colour for rays for which an output of Light Path is 1, and of another for others."""
    bs.world(others)
    tree = bpy.context.scene.world.node_tree
    path, mix = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMixShader")
    second = tree.nodes.new("ShaderNodeBackground")
    second.inputs["Color"].default_value = (*seen, 1.0)
    tree.links.new(path.outputs[output], mix.inputs[0])
    tree.links.new(tree.nodes["Background"].outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    return tree


def test_a_layer_without_sky_has_no_world(scene: Any) -> None:
    bs.world((0.2, 0.4, 0.6))
    assert bs.export().scene.world.color == pytest.approx([0.2, 0.4, 0.6])
    scene.view_layers[0].use_sky = False
    assert not bs.export().scene.world.color.any()


def test_a_layer_without_surfaces_has_no_meshes(scene: Any) -> None:
    ground()
    scene.view_layers[0].use_solid = False
    assert not bs.export().scene.meshes


def test_a_layer_overrides_materials_and_world(scene: Any) -> None:
    ground()
    bs.add("Bare", bs.cube("Bare"))
    bs.world((0.2, 0.4, 0.6))
    layer = scene.view_layers[0]
    layer.material_override = bs.material("Clay", (0.7, 0.6, 0.5))
    made = bs.export()
    assert list(made.materials) == ["Clay"]
    assert {name for mesh in made.scene.meshes.values() for name in mesh.used_materials} == {"Clay"}
    if hasattr(layer, "world_override"):
        other = layer.world_override = bpy.data.worlds.new("Other")
        if other.node_tree is None:
            other.use_nodes = True
        other.node_tree.nodes["Background"].inputs["Color"].default_value = (0.1, 0.1, 0.3, 1.0)
        assert bs.export().scene.world.color == pytest.approx([0.1, 0.1, 0.3])


def test_the_camera_does_not_see_the_world_through_a_transparent_film(scene: Any) -> None:
    bs.world((0.2, 0.4, 0.6))
    scene.render.film_transparent = True
    made = bs.export()
    assert "camera" not in made.scene.world.visible_to and made.report.lines == []


@pytest.mark.parametrize("output", ["Is Camera Ray", "Is Shadow Ray"])
def test_worlds_that_kinds_of_rays_see_differently(output: str, scene: Any, tmp_path: Path) -> None:
    """A plane that fills half of the picture: the world is behind it, and lights it."""
    bs.add("Board", bs.mesh("Board", [(-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)],
                            bs.material("Grey")))  # fmt: skip
    mixed_world(output)
    made = bs.export()
    assert made.report.lines == []
    picture = edgegrad.Renderer(made.scene).render(spp=64, max_depth=made.settings.max_depth)
    theirs = bs.cycles(tmp_path)[..., :3]
    # The world is constant, and the board convex: only the pixels of its edge are noisy.
    for half in (np.s_[:, :14], np.s_[:, 18:]):
        assert picture[half].mean(axis=(0, 1)) == pytest.approx(theirs[half].mean(axis=(0, 1)), rel=2e-3)


def test_an_image_lights_the_scene_and_the_camera_sees_one_colour() -> None:
    tree = mixed_world("Is Camera Ray")
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = bpy.data.images.new("Sky", 8, 4, float_buffer=True)
    tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    made = bs.export()
    world, suns = made.scene.world, made.scene.lights
    assert world.image == "Sky" and world.visible_to == {"diffuse", "glossy", "transmission", "shadow"}
    assert [sun.visible_to for sun in suns.values()] == [{"camera", "shadow"}] * 2
    assert sum(sun.direction for sun in suns.values()) == pytest.approx(np.zeros(3))
    for sun in suns.values():  # of the radiance that the camera sees
        assert sun.strength * sun.color / np.pi == pytest.approx([0.9, 0.3, 0.1])
    assert made.report.lines == []


def test_a_world_of_nodes_is_baked_as_surfaces_see_it() -> None:
    tree = mixed_world("Is Camera Ray")
    checker = tree.nodes.new("ShaderNodeTexGradient")
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["Generated"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    made = bs.export(bake=32)
    pixels = made.scene.images[made.scene.world.image].pixels
    assert pixels[..., 0] == pytest.approx(pixels[..., 2])  # grey: not the red that the camera sees
    assert "camera" not in made.scene.world.visible_to and len(made.scene.lights) == 2


def test_two_images_for_two_kinds_of_rays_are_named() -> None:
    tree = mixed_world("Is Glossy Ray")
    for k, background in enumerate(node for node in list(tree.nodes) if node.type == "BACKGROUND"):
        node = tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = bpy.data.images.new(f"Sky {k}", 8, 4, float_buffer=True)
        tree.links.new(node.outputs["Color"], background.inputs["Color"])
    made = bs.export()
    assert "glossy" in made.scene.world.visible_to
    assert any(line.startswith("world 'World': glossy rays see it as") for line in made.report.lines)


def test_edges_before_what_only_the_camera_sees_have_derivatives() -> None:
    """The border of a board moves over the backdrop: the finite difference of the mean is that of two areas."""
    bs.add("Board", bs.mesh("Board", [(-9, -9, 0), (0.1, -9, 0), (0.1, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)],
                            bs.material("Grey")))  # fmt: skip
    mixed_world("Is Camera Ray")
    scene = bs.export().scene
    moves = np.zeros_like(scene.meshes["Board"].vertices)
    moves[scene.meshes["Board"].vertices[:, 0] > 0.0, 0] = 1.0
    found = edgegrad.render_forward(scene, {"meshes.Board.vertices": moves}, spp=64, max_depth=2).mean(axis=(0, 1))
    board, backdrop = 0.5 * np.array([0.2, 0.4, 0.6]), np.array([0.9, 0.3, 0.1])
    width = 2.0 * 5.0 * np.tan(0.5 * scene.camera.fov_x)
    assert found == pytest.approx((board - backdrop) / width, rel=1e-2)


def test_the_film_exposure_multiplies_the_picture(scene: Any) -> None:
    ground()
    bs.world((0.2, 0.4, 0.6))
    bs.light("POINT", energy=50.0, location=(0, 0, 3))
    bs.light("SUN", "Sun", energy=0.5)
    lamp = bs.material("Lamp", node="ShaderNodeEmission", Strength=3.0)
    bs.add("Lamp", bs.cube("Lamp", lamp), (3, 0, 3), scale=(0.3, 0.3, 0.3))
    bs.add("Holdout", bs.cube("Holdout", lamp), (-3, 0, 3), scale=(0.3, 0.3, 0.3)).is_holdout = True
    plain = mean(bs.export())
    scene.cycles.film_exposure = 2.5
    made = bs.export()
    assert mean(made) == pytest.approx(2.5 * plain, rel=1e-5)
    # A fit's values are written as Blender has them.
    for path in ("lights.Light.power", "lights.Sun.strength", "materials.Lamp.emission"):
        value = edgegrad.scene.parameters.get(made.scene, path)
        parameters.write(made, path, value, 2.0 * np.asarray(value), in_place=True)
    assert bpy.data.lights["Light"].energy == pytest.approx(100.0) and bpy.data.lights["Sun"].energy == pytest.approx(1)
    assert bs.shader(lamp).inputs["Color"].default_value[:3] == pytest.approx([1.0] * 3)


@pytest.mark.parametrize(
    ("node", "inputs", "switch"),
    [("ShaderNodeBsdfAnisotropic", {"Roughness": 0.3}, "caustics_reflective"),
     ("ShaderNodeBsdfPrincipled", {"Metallic": 1.0}, "caustics_reflective"),
     ("ShaderNodeBsdfRefraction", {"Roughness": 0.3}, "caustics_refractive")],
)  # fmt: skip
def test_without_caustics_rough_surfaces_see_no_gloss(node: str, inputs: Any, switch: str, scene: Any) -> None:
    """The floor beside a wall is as bright as beside a black one; the camera does not see the wall."""
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = 2
    scene.cycles.transmission_bounces = 2
    ground()
    bs.world((1.0, 1.0, 1.0))
    wall = bs.material("Wall", (0.9, 0.8, 0.7), node, **inputs)
    bs.shader(wall).distribution = "GGX"
    bs.add("Wall", bs.plane("Wall", 20.0, wall), (-2.2, 0, 0), (0, np.pi / 2, 0))
    lit = mean(bs.export())
    setattr(scene.cycles, switch, False)
    made = bs.export()
    assert made.report.lines == []
    without = mean(made)
    bpy.data.objects["Wall"].data.materials[0] = bs.material("Black", (0.0, 0.0, 0.0))
    assert without == pytest.approx(mean(bs.export()), rel=2e-3)
    assert lit.mean() > 1.05 * without.mean()


def test_colours_that_caustics_change_are_not_fitted(scene: Any) -> None:
    bs.world((1.0, 1.0, 1.0))
    scene.cycles.caustics_reflective = False
    for name, metallic in (("Metal", 1.0), ("Plastic", 0.0)):
        bs.add(name, bs.cube(name, bs.material(name, node="ShaderNodeBsdfPrincipled", Metallic=metallic)))
    made = bs.export()
    assert parameters.Names(base_color=("Plastic",)).paths(made) == ["materials.Plastic.base_color"]
    with pytest.raises(Problem, match=r"material 'Metal': its base color .* caustics are off"):
        parameters.Names(base_color=("Metal",)).paths(made)


def test_quadratic_falloff_is_that_of_lights() -> None:
    data = bs.light("POINT", energy=20.0).data
    data.use_nodes = True
    tree = data.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    falloff = tree.nodes.new("ShaderNodeLightFalloff")
    falloff.inputs["Strength"].default_value = 3.0
    tree.links.new(falloff.outputs["Quadratic"], emission.inputs["Strength"])
    made = bs.export()
    light = made.scene.lights["Light"]
    assert light.power * light.color == pytest.approx([60.0] * 3) and made.report.lines == []
    falloff.inputs["Smooth"].default_value = 1.5
    light = bs.export().scene.lights["Light"]
    assert (light.decay, light.smooth) == ("QUADRATIC", 1.5) and light.color == pytest.approx([3.0] * 3)


@pytest.mark.parametrize("output", ["Linear", "Constant"])
def test_falloff_of_all_emission_is_the_decay_of_the_light(output: str) -> None:
    data = bs.light("AREA", energy=20.0).data
    data.use_nodes = True
    tree = data.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    falloff, twice = tree.nodes.new("ShaderNodeLightFalloff"), tree.nodes.new("ShaderNodeMath")
    twice.operation, twice.inputs[1].default_value = "MULTIPLY", 2.0
    falloff.inputs["Strength"].default_value = 3.0
    tree.links.new(falloff.outputs[output], twice.inputs[0])
    tree.links.new(twice.outputs[0], emission.inputs["Strength"])
    made = bs.export()
    light = made.scene.lights["Light"]
    assert light.decay == output.upper() and light.color == pytest.approx([6.0] * 3) and made.report.lines == []
    twice.operation = "ADD"  # a part that falls otherwise
    made = bs.export()
    assert made.scene.lights["Light"].decay == "QUADRATIC"
    assert any("its Light Falloff is not a factor of all of its emission" in line for line in made.report.lines)


def varying(kind: str, **settings: Any) -> Any:
    """A light of nodes that vary with position or direction."""
    data = bs.light(kind, energy=7.0, color=(0.3, 0.6, 0.9), **settings).data
    data.use_nodes = True
    tree = data.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    emission.inputs["Strength"].default_value = 3.0
    noise = tree.nodes.new("ShaderNodeTexNoise")
    # Both parts of a mix are the same, so the mean is known though the node varies.
    mix = tree.nodes.new("ShaderNodeMixShader")
    second = tree.nodes.new("ShaderNodeEmission")
    second.inputs["Strength"].default_value = 3.0
    for one in (emission, second):
        one.inputs["Color"].default_value = (0.5, 0.25, 1.0, 1.0)
    tree.links.new(noise.outputs["Color"], mix.inputs[0])
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    return data


@pytest.mark.parametrize(
    ("kind", "settings"),
    [("POINT", {"shadow_soft_size": 0.3}), ("SPOT", {"spot_size": 0.4}),
     ("AREA", {"shape": "ELLIPSE", "size": 2.0, "size_y": 0.5, "spread": 1.0})],
)  # fmt: skip
def test_lights_of_varying_nodes_emit_their_mean(kind: str, settings: Any) -> None:
    varying(kind, **settings)
    kinds = ("scenes", "lights", "cameras", "materials", "meshes", "objects", "images", "node_groups")
    before = [len(getattr(bpy.data, name)) for name in kinds]
    made = bs.export()
    assert [len(getattr(bpy.data, name)) for name in kinds] == before
    assert made.scene.lights["Light"].color == pytest.approx(3.0 * np.array([0.15, 0.15, 0.9]), rel=0.02)
    assert any("emits the mean of its nodes" in line for line in made.report.lines)
    unbaked = bs.export(bake=0)
    assert any("its nodes are left out" in line for line in unbaked.report.lines)


def test_lights_that_only_kinds_of_rays_see_are_dark() -> None:
    """Cycles evaluates lights where it samples them, by rays of no kind."""
    data = bs.light("POINT", energy=20.0).data
    data.use_nodes = True
    tree = data.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], emission.inputs["Strength"])
    made = bs.export()
    assert not made.scene.lights["Light"].color.any() and made.report.lines == []


def test_warnings_tell_how_much_of_the_picture_they_concern() -> None:
    bs.camera((0, 0, 5))  # sees a square of 3.6 metres
    bs.light("SUN", energy=1.0)
    half = bs.add("Half", bs.mesh("Half", [(-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)],
                                  bs.material("Left")))  # fmt: skip
    away = bs.add("Away", bs.plane("Away", 1.0, bs.material("Away")), (0, 0, 9))
    bs.add("Behind", bs.plane("Behind", 20.0, bs.material("Right")), (0, 0, -1))
    made = bs.export()
    kinds = [("object", name) for name in ("Half", "Away", "Behind")] + [("material", "Left"), ("material", "None")]
    shares = first_surfaces(made, kinds)
    assert set(shares) == set(kinds[:-1])
    assert shares[("object", "Half")] == pytest.approx(0.5, abs=0.02) == shares[("material", "Left")]
    assert shares[("object", "Behind")] == pytest.approx(0.5, abs=0.02) and shares[("object", "Away")] == 0.0
    for ob in (half, away):
        ob.is_shadow_catcher = True
    lines = bs.export().report.lines
    assert any(line.startswith("object 'Half'") and line.endswith("(50 % of the picture's pixels)") for line in lines)
    assert any(line.startswith("object 'Away'") and line.endswith("(0 % of the picture's pixels)") for line in lines)


def test_warnings_about_lights_tell_their_share_of_the_light() -> None:
    ground()
    for name, energy in (("Bright", 3.0), ("Dim", 1.0)):
        bs.light("SUN", name, energy=energy).data.cycles.is_caustics_light = True
    bpy.data.objects["Ground"].cycles.is_caustics_caster = True
    lines = bs.export().report.lines
    assert any(line.startswith("light 'Bright'") and line.endswith("(75 % of the picture's light)") for line in lines)
    assert any(line.startswith("light 'Dim'") and line.endswith("(25 % of the picture's light)") for line in lines)


def test_what_is_not_exported_has_no_share() -> None:
    ground()
    bs.light("AREA", energy=20.0, scale=(0.0, 1.0, 1.0))
    (line,) = bs.export().report.lines
    assert line == "light 'Light': has no size; it is left out"


def test_simplify_limits_images_by_means_of_their_stored_values() -> None:
    """The pixels of a step are those that Cycles averages: from the bottom left on, codes of 8-bit images as codes."""
    bs.light("POINT")
    codes = np.random.default_rng(1).integers(0, 256, (3, 515)) / 255.0
    image = bpy.data.images.new("Fine", 515, 3)
    image.pixels.foreach_set(np.repeat(codes[..., None], 4, axis=2).astype(np.float32).ravel())
    image.alpha_mode = "NONE"
    made = bs.material("M")
    texture = made.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    made.node_tree.links.new(texture.outputs[0], bs.shader(made).inputs["Color"])
    bs.add("Plane", bs.plane("Plane", 2.0, made))
    scene = bpy.context.scene
    scene.cycles.texture_limit_render = "128"
    (full,) = bs.export().scene.images.values()
    assert full.pixels.shape[:2] == (3, 515)
    scene.render.use_simplify = True
    export = bs.export()
    (small,) = export.scene.images.values()
    # 515 pixels become 64, each the mean of 8, and 3 rows are fewer than a step.
    assert small.pixels.shape[:2] == (1, 64)
    assert not any(line.startswith("scene") for line in export.report.lines)
    assert np.allclose(small.pixels[0, :, 0], codes[:, :512].reshape(3, 64, 8).mean(axis=(0, 2)), atol=1e-3)


def test_effects_of_lights_that_are_black_here_are_unknown() -> None:
    """The replaced length of rays makes the light black, so that its share of the light cannot be measured."""
    bs.empty()
    bs.camera()
    bs.world((0.5, 0.5, 0.5))
    bs.add("Plane", bs.plane("Plane", 4.0, bs.material("M")))
    lamp = bs.light("POINT", "Bulb", (0.0, 0.0, 3.0))
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    length = tree.nodes.new("ShaderNodeLightPath").outputs["Ray Length"]
    tree.links.new(length, next(one for one in tree.nodes if one.type == "EMISSION").inputs["Strength"])
    lines = [line for line in bs.export().report.lines if line.startswith("light 'Bulb'")]
    assert len(lines) == 1 and "is replaced by 0" in lines[0]
    assert lines[0].endswith("(it is black here, so its part of the picture's light is unknown)")
