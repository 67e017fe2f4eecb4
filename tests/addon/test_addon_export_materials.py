"""Export of materials: shader trees, sockets as expressions, images, groups, and what is baked."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import procedural as p
from edgegrad_addon.export.geometry import attributes
from edgegrad_addon.export.materials.material import PART
from tests.support.scenes import blender_scenes as bs
from tests.support.scenes.material_tree import Tree

pytestmark = pytest.mark.usefixtures("lit_scene")


def snapshot() -> Any:
    """Names of all of Blender's data."""
    kinds = [kind for kind in dir(bpy.data) if isinstance(getattr(bpy.data, kind), type(bpy.data.objects))]
    return {kind: sorted(getattr(bpy.data, kind).keys()) for kind in kinds}


def test_every_field_of_principled() -> None:
    values = {"Metallic": 0.1, "Roughness": 0.2, "IOR": 1.6, "Alpha": 0.9, "Specular IOR Level": 0.4,
              "Anisotropic": 0.3, "Anisotropic Rotation": 0.25, "Transmission Weight": 0.35, "Coat Weight": 0.45,
              "Coat Roughness": 0.05, "Coat IOR": 1.7, "Sheen Weight": 0.55, "Sheen Roughness": 0.65,
              "Subsurface Weight": 0.15, "Emission Strength": 2.0}  # fmt: skip
    colors = {"Specular Tint": (0.9, 0.8, 0.7, 1), "Coat Tint": (0.6, 0.7, 0.8, 1), "Sheen Tint": (0.2, 0.3, 0.4, 1),
              "Emission Color": (0.1, 0.2, 0.3, 1)}  # fmt: skip
    tree = Tree(**values, **colors)
    tree.shader.distribution = "GGX"
    m = tree.export()
    got = [m.metallic, m.roughness, m.ior, m.alpha, m.specular_ior_level, m.anisotropy, m.anisotropy_rotation,
           m.transmission, m.coat_weight, m.coat_roughness, m.coat_ior, m.sheen_weight, m.sheen_roughness,
           m.subsurface_weight]  # fmt: skip
    assert got == pytest.approx(list(values.values())[:-1])
    assert m.kind == "PRINCIPLED" and not m.multiscatter and m.textures == {}
    assert m.specular_tint == pytest.approx([0.9, 0.8, 0.7]) and m.coat_tint == pytest.approx([0.6, 0.7, 0.8])
    assert m.sheen_tint == pytest.approx([0.2, 0.3, 0.4]) and m.emission == pytest.approx([0.2, 0.4, 0.6])
    assert any("subsurface" in line for line in tree.made.report.lines)
    assert any("read as Principled BSDF" in line for line in tree.made.report.readings)


@pytest.mark.parametrize(
    ("shader", "kind"),
    [("Diffuse", "DIFFUSE"), ("Glossy", "GLOSSY"), ("Glass", "GLASS"), ("Refraction", "REFRACTION"),
     ("Transparent", "TRANSPARENT"), ("Translucent", "TRANSLUCENT"), ("Sheen", "SHEEN"), ("Toon", "DIFFUSE"),
     ("Hair", "GLOSSY")],
)  # fmt: skip
def test_simple_shaders(shader: Any, kind: Any) -> None:
    tree = Tree("ShaderNodeBsdf" + shader)
    m = tree.export()
    assert m.kind == kind and m.base_color == pytest.approx([0.5] * 3)
    assert bool(tree.made.report.lines) == (shader in ("Toon", "Hair"))


@pytest.mark.parametrize(
    ("shader", "distribution", "expected"),
    [("Glossy", "BECKMANN", ("GLOSSY", "BECKMANN", False)), ("Glossy", "MULTI_GGX", ("GLOSSY", "GGX", True)),
     ("Glossy", "ASHIKHMIN_SHIRLEY", ("GLOSSY", "ASHIKHMIN_SHIRLEY", False)),
     ("Glass", "BECKMANN", ("GLASS", "BECKMANN", False)), ("Refraction", "BECKMANN", ("REFRACTION", "BECKMANN", False)),
     ("Metallic", "BECKMANN", ("PRINCIPLED", "BECKMANN", False)), ("Sheen", "ASHIKHMIN", ("VELVET", "GGX", True)),
     ("Sheen", "MICROFIBER", ("SHEEN", "GGX", True))],
)  # fmt: skip
def test_distributions(shader: str, distribution: str, expected: tuple[str, str, bool]) -> None:
    tree = Tree("ShaderNodeBsdf" + shader)
    tree.shader.distribution = distribution
    m = tree.export()
    assert (m.kind, m.distribution, m.multiscatter) == expected
    assert not tree.made.report.lines


@pytest.mark.parametrize(("inputs", "layers"), [((), 1), (("Normal",), 2), (("Coat Normal",), 2),
                                                (("Normal", "Coat Normal"), 1)])  # fmt: skip
def test_coats_with_a_normal_of_their_own_are_layers(inputs: tuple[str, ...], layers: int) -> None:
    tree = Tree(**{"Coat Weight": 1.0})
    bent = tree.node("NormalMap")
    bent.inputs["Color"].default_value = (0.8, 0.5, 0.8, 1.0)
    for name in inputs:
        tree.link(bent.outputs[0], tree.shader.inputs[name])
    made = tree.export()
    assert len(made.parts if isinstance(made, edgegrad.Mixture) else (made,)) == layers
    assert not tree.made.report.lines


@pytest.mark.parametrize(("output", "named"), [("Is Diffuse Ray", True), ("Is Camera Ray", False)])
def test_emission_for_kinds_of_rays_that_depends_on_sampling_is_named(output: str, named: bool) -> None:
    tree = Tree("ShaderNodeEmission")
    path = tree.node("LightPath")
    tree.link(path.outputs[output], tree.shader.inputs["Strength"])
    tree.export()
    assert any("depends on the sampling" in line for line in tree.made.report.lines) == named


def test_mix_shaders_become_a_weighted_sum() -> None:
    tree = Tree()
    uv = tree.node("UVMap")
    outer, inner = tree.node("MixShader"), tree.node("MixShader")
    glass, add, emission = tree.node("BsdfGlass"), tree.node("AddShader"), tree.node("Emission")
    outer.inputs[0].default_value = 0.25
    tree.link(tree.shader.outputs[0], outer.inputs[1])
    tree.link(inner.outputs[0], outer.inputs[2])
    tree.link(uv.outputs[0], inner.inputs[0])
    tree.link(glass.outputs[0], inner.inputs[1])
    tree.link(add.outputs[0], inner.inputs[2])
    tree.link(emission.outputs[0], add.inputs[0])
    tree.surface(outer.outputs[0])
    m = tree.export()
    assert isinstance(m, edgegrad.Mixture) and len(m.parts) == 3 and m.weights[0] == 0.75
    kinds = [tree.made.scene.materials[name].kind for name in m.parts]
    assert kinds == ["PRINCIPLED", "GLASS", "DIFFUSE"]
    assert all(name.startswith("M" + PART) for name in m.parts)
    factor = e.Clamp(e.Average(e.Attribute("UVMap"))) if uv.uv_map else e.Clamp(
        e.Average(e.Attribute(attributes.ACTIVE_UV)))  # fmt: skip
    assert m.textures["2"] == e.Math("MULTIPLY", 0.25, factor)
    assert m.textures["1"] == e.Math("MULTIPLY", 0.25, e.Math("SUBTRACT", 1.0, factor))
    assert tree.made.scene.meshes["Cube"].attributes[attributes.ACTIVE_UV].shape == (12, 3, 2)


def test_groups_reroutes_and_muted_nodes_are_looked_through() -> None:
    tree = Tree()
    group = bpy.data.node_groups.new("G", "ShaderNodeTree")
    group.interface.new_socket("Value", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    math = group.nodes.new("ShaderNodeMath")
    math.operation, math.inputs[1].default_value = "MULTIPLY", 0.5
    group.links.new(start.outputs[0], math.inputs[0])
    group.links.new(math.outputs[0], end.inputs[0])
    node = tree.node("Group")
    node.node_tree = group
    reroute = tree.tree.nodes.new("NodeReroute")
    gamma = tree.node("Gamma", mute=True)
    gamma.inputs["Gamma"].default_value = 3.0
    tree.link(node.outputs[0], reroute.inputs[0])
    tree.link(reroute.outputs[0], gamma.inputs["Color"])
    tree.link(gamma.outputs[0], "Base Color")
    node.inputs[0].default_value = 0.6
    assert tree.export().base_color == pytest.approx([0.3] * 3)
    noise = tree.node("TexNoise")
    tree.link(noise.outputs["Color"], node.inputs[0])
    m = tree.export()
    # The colour becomes a number where it enters the group.
    read = m.textures["base_color"]
    assert isinstance(read, e.Math) and isinstance(read.a, e.Luminance) and isinstance(read.a.color, p.Noise)


def test_constants_are_folded() -> None:
    tree = Tree()
    ramp = tree.node("ValToRGB")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0, 0, 1), (0, 0, 1, 1)
    ramp.inputs[0].default_value = 0.25
    tree.link(ramp.outputs["Color"], "Base Color")
    math = tree.node("Math", operation="POWER")
    math.inputs[0].default_value, math.inputs[1].default_value = 0.5, 2.0
    tree.link(math.outputs[0], "Roughness")
    m = tree.export()
    assert m.textures == {} and m.roughness == pytest.approx(0.25)
    assert m.base_color == pytest.approx([0.75, 0.0, 0.25], abs=3e-3)


@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
@pytest.mark.parametrize("float_buffer", [False, True])
def test_images(space: Any, float_buffer: Any) -> None:
    tree = Tree()
    image = bpy.data.images.new("Picture", 3, 2, alpha=True, float_buffer=float_buffer, is_data=space == "Non-Color")
    codes = np.full((2, 3, 4), 1.0, np.float32)
    codes[0, 0] = (0.2, 0.4, 0.6, 0.5)  # Blender's first row is the lowest
    image.pixels.foreach_set(codes.ravel())
    node = tree.node("TexImage", image=image, interpolation="Closest", extension="CLIP")
    tree.link(node.outputs["Color"], "Base Color")
    data = space == "Non-Color"
    coded = not data and not float_buffer  # Cycles multiplies 8 bit sRGB codes by alpha before it makes them linear

    def texture(made: edgegrad.Material) -> Any:
        read = made.textures["base_color"]
        assert isinstance(read, e.Curves) == coded
        return read.value if isinstance(read, e.Curves) else read

    read = texture(tree.export())
    assert isinstance(read, e.ImageTexture) and (read.interpolation, read.extension) == ("CLOSEST", "CLIP")
    assert read.alpha == ("CHANNEL_PACKED" if data else "PREMULTIPLIED")
    pixels = tree.made.scene.images[read.image].pixels
    assert pixels.shape == (2, 3, 4)
    wanted: Any = np.array([0.2, 0.4, 0.6])
    if not data:
        wanted = wanted / 0.5 if float_buffer else np.round(wanted * 255) / 255
    assert pixels[1, 0, :3] == pytest.approx(wanted, abs=2e-3) and pixels[1, 0, 3] == pytest.approx(0.5, abs=3e-3)
    tree.link(node.outputs["Alpha"], "Alpha")
    m = tree.export()
    node.interpolation = "Linear"
    smooth = tree.export().textures["base_color"]
    # Cycles interpolates 8 bit sRGB codes before it makes them linear.
    assert isinstance(smooth, e.Curves) == (not data and not float_buffer)
    assert m.textures["alpha"] == e.Channel(texture(m), 3)
    assert texture(m).alpha == ("CHANNEL_PACKED" if data else "STRAIGHT")


def test_normal_map_and_its_tangents() -> None:
    tree = Tree()
    node, image = tree.node("NormalMap"), tree.node("TexImage")
    image.image = bpy.data.images.new("Normals", 4, 4, is_data=True)
    node.inputs["Strength"].default_value = 0.7
    tree.link(image.outputs["Color"], node.inputs["Color"])
    tree.link(node.outputs["Normal"], "Normal")
    m = tree.export()
    assert m.normal_strength == pytest.approx(0.7) and isinstance(m.textures["normal"], e.ImageTexture)
    mesh = tree.made.scene.meshes["Cube"]
    assert mesh.attributes[m.normal_uv + ".tangent"].shape == (12, 3, 4)
    node.inputs["Strength"].default_value = 0.0
    assert tree.export().textures == {}


def unreadable(tree: Any) -> Any:
    """A texture that shows one component of a vector, since its own mapping swaps axes."""
    made = tree.nodes.new("ShaderNodeTexGradient")
    made.texture_mapping.mapping_x = "Y"
    return made


def test_what_cannot_be_read_is_baked_and_nothing_else_changes() -> None:
    tree = Tree(Roughness=0.3)
    half = tree.node("Math", operation="MULTIPLY_ADD")
    half.inputs[1].default_value, half.inputs[2].default_value = 0.0, 0.25
    tree.link(unreadable(tree.tree).outputs["Fac"], half.inputs[0])
    tree.link(half.outputs[0], "Roughness")
    # Rounded edges can't be read, nor what is bumped on them.
    bevel, bump, checker = tree.node("Bevel"), tree.node("Bump"), tree.node("TexChecker")
    bump.inputs["Distance"].default_value = 0.1
    tree.link(checker.outputs["Fac"], bump.inputs["Height"])
    tree.link(bevel.outputs["Normal"], bump.inputs["Normal"])
    tree.link(bump.outputs["Normal"], "Normal")
    other = bs.add("Other", bs.cube("Other", tree.material), (4, 0, 0))
    other.data.uv_layers.new(name="UVMap")
    before = snapshot()
    m = tree.export()
    assert snapshot() == before and bpy.context.scene.name == "Scene"
    # Each mesh has its own images, and the second its own material.
    scene = tree.made.scene
    assert scene.meshes["Other"].materials == ("M (Other)",) and isinstance(scene.materials["M (Other)"], type(m))
    assert m.normal_uv == attributes.BAKED_UV and isinstance(m.textures["normal"], e.ImageTexture)
    pixels = scene.images[m.textures["normal"].image].pixels
    assert pixels.shape == (32, 32, 3)
    assert pixels[..., 2].mean() > 0.7 and np.ptp(pixels[..., 0]) > 0.05
    uv = scene.meshes["Cube"].attributes[attributes.BAKED_UV]
    assert uv.min() >= 0.0 and uv.max() <= 1.0 and len(np.unique(uv.reshape(-1, 2), axis=0)) >= 14
    assert m.normal_space == "TANGENT"
    assert any("baked" in line and "Bump" in line for line in tree.made.report.readings)


def test_baked_directions_are_those_of_the_surface() -> None:
    """A bake of a group's output on a moved cube: tangents around its axis run along its sides."""
    tree = Tree()
    tree.object.location = (1, 2, 3)
    group = bpy.data.node_groups.new("G", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    end, tangent = group.nodes.new("NodeGroupOutput"), group.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.axis = "RADIAL", "Z"
    component = unreadable(group)
    group.links.new(tangent.outputs[0], component.inputs["Vector"])
    group.links.new(component.outputs["Color"], end.inputs[0])
    node = tree.node("Group")
    node.node_tree = group
    tree.link(node.outputs[0], "Base Color")
    m = tree.export()
    scene = tree.made.scene
    mesh, picture = scene.meshes["Cube"], scene.images[m.textures["base_color"].image].pixels
    uv = mesh.attributes[attributes.BAKED_UV].mean(axis=1)
    around = mesh.vertices[mesh.faces].mean(axis=1) - (1, 2, 3)
    side = np.abs(np.ptp(mesh.vertices[mesh.faces][..., 2], axis=1)) > 1.0
    across = np.abs(around) == np.abs(around[:, :2]).max(axis=1)[:, None]  # the axis that a side is perpendicular to
    expected = np.where(across, 0.0, np.stack([-around[:, 1], around[:, 0], 0.0 * around[:, 2]], axis=1))
    expected = np.sign(np.round(expected, 6)).clip(0.0)[:, [1, 1, 1]]
    assert 0 < expected[side, 0].sum() < side.sum()
    x, y = (uv[:, 0] * 32).astype(int), ((1.0 - uv[:, 1]) * 32).astype(int)
    assert side.sum() == 8 and picture[y, x][side] == pytest.approx(expected[side], abs=0.02)


def test_failed_bakes_leave_the_sockets_values() -> None:
    tree = Tree(Roughness=0.3)
    tree.link(unreadable(tree.tree).outputs["Fac"], "Roughness")
    made = bs.export(bake=0)
    m = made.scene.materials["M"]
    assert m.textures == {} and m.roughness == pytest.approx(0.3)
    assert any("isn't baked" in line for line in made.report.lines)
