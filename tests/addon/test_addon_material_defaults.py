"""Export of materials that lack nodes, have incomplete nodes, or have nodes that Edgegrad lacks."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad import expression as e
from edgegrad.tables.textures.lowering import Lowering, Resources
from edgegrad.tables.textures.ops import Builder
from edgegrad_addon.export.approximated import subsurface
from edgegrad_addon.export.geometry import attributes
from edgegrad_addon.export.nodes.expressions import Reader
from edgegrad_addon.problem import Problem
from edgegrad_addon.write_back.values import check_material
from tests.support.scenes import blender_scenes as bs

HIDDEN_VALUES = pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="groups keep their values before Blender 5.0")


@pytest.fixture(autouse=True)
def _scene() -> None:
    bs.empty()
    bs.camera()
    bs.light("POINT")


class Tree:
    """A material with an empty tree, on a cube of edge 2."""

    def __init__(self) -> None:
        self.material = bpy.data.materials.new("M")
        if self.material.node_tree is None:
            self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.tree.nodes.new("ShaderNodeOutputMaterial")
        bs.add("Cube", bs.cube("Cube", self.material))

    def node(self, kind: str, inputs: dict[Any, Any] | None = None, **settings: Any) -> Any:
        node = self.tree.nodes.new("ShaderNode" + kind)
        for key, value in settings.items():
            setattr(node, key, value)
        for key, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node

    def surface(self, output: Any) -> None:
        self.tree.links.new(output, self.output.inputs["Surface"])

    def export(self) -> Any:
        self.made = bs.export(bake=0)
        self.made.scene.validate()
        return self.made.scene.materials["M"]

    @property
    def lines(self) -> str:
        return "\n".join(self.made.report.lines)


def test_faces_without_material_have_the_default_surface_of_cycles() -> None:
    bs.add("Cube", bs.cube("Cube"))
    material = bs.export().scene.materials["(no material)"]
    assert material.base_color == pytest.approx([0.8] * 3)
    if bpy.app.version >= (5, 0, 0):
        assert (material.kind, material.specular_ior_level, material.ior) == ("PRINCIPLED", 0.5, 1.5)
        assert material.roughness == 0.5
    else:
        assert material.kind == "DIFFUSE"


def test_a_color_or_a_number_that_is_linked_to_the_surface_emits() -> None:
    tree = Tree()
    color = tree.node("RGB")
    color.outputs[0].default_value = (0.2, 0.5, 0.7, 1.0)
    tree.surface(color.outputs[0])
    m = tree.export()
    assert m.emission == pytest.approx([0.2, 0.5, 0.7]) and not m.base_color.any()
    tree.surface(tree.node("TexNoise").outputs["Color"])
    assert "emission" in tree.export().textures and not tree.made.report.lines


def test_a_shader_that_is_linked_to_a_color_leaves_the_value_of_the_socket() -> None:
    tree = Tree()
    diffuse = tree.node("BsdfDiffuse", {"Color": (0.1, 0.6, 0.2, 1.0)})
    tree.tree.links.new(tree.node("BsdfToon").outputs[0], diffuse.inputs["Color"])
    tree.surface(diffuse.outputs[0])
    assert tree.export().base_color == pytest.approx([0.1, 0.6, 0.2]) and not tree.made.report.lines


def test_nodes_of_other_add_ons_leave_the_value_of_the_input() -> None:
    class Odd(bpy.types.Node):  # type: ignore[name-defined, misc]
        bl_idname, bl_label = "EdgegradTestNode", "Odd"

        def init(self, context: Any) -> None:
            self.outputs.new("NodeSocketColor", "Color")

    tree = Tree()
    diffuse = tree.node("BsdfDiffuse", {"Color": (0.1, 0.6, 0.2, 1.0)})
    bpy.utils.register_class(Odd)
    try:
        tree.tree.links.new(tree.tree.nodes.new("EdgegradTestNode").outputs[0], diffuse.inputs["Color"])
        tree.surface(diffuse.outputs[0])
        assert tree.export().base_color == pytest.approx([0.1, 0.6, 0.2])
    finally:
        bpy.utils.unregister_class(Odd)
    assert tree.export().base_color == pytest.approx([0.1, 0.6, 0.2])


@HIDDEN_VALUES
def test_a_menu_switch_gives_the_shader_that_its_menu_names() -> None:
    tree = Tree()
    switch = tree.tree.nodes.new("GeometryNodeMenuSwitch")
    switch.data_type = "SHADER"
    for name, color in (("A", 0.1), ("B", 0.7)):
        shader = tree.node("BsdfDiffuse", {"Color": (color, color, color, 1.0)})
        tree.tree.links.new(shader.outputs[0], switch.inputs[name])
    tree.surface(switch.outputs[0])
    for name, color in (("A", 0.1), ("B", 0.7)):
        switch.inputs[0].default_value = name
        assert tree.export().base_color == pytest.approx([color] * 3)


@pytest.mark.parametrize("way", ["direct", "reroute", "muted"])
def test_muted_nodes_without_a_source_leave_the_value_of_the_input(way: str) -> None:
    tree = Tree()
    source = tree.node("RGB", mute=True).outputs[0]
    if way == "reroute":
        reroute = tree.tree.nodes.new("NodeReroute")
        tree.tree.links.new(source, reroute.inputs[0])
        source = reroute.outputs[0]
    elif way == "muted":
        source = tree.node("Gamma", {"Color": source}, mute=True).outputs[0]
    diffuse = tree.node("BsdfDiffuse", {"Color": (0.3, 0.5, 0.8, 1.0)})
    tree.tree.links.new(source, diffuse.inputs["Color"])
    tree.surface(diffuse.outputs[0])
    assert tree.export().base_color == pytest.approx([0.3, 0.5, 0.8])


def test_a_single_shader_of_a_mix_keeps_its_weight() -> None:
    tree = Tree()
    tree.surface(tree.node("MixShader", {0: 0.25, 1: tree.node("BsdfDiffuse").outputs[0]}).outputs[0])
    m = tree.export()
    assert isinstance(m, edgegrad.Mixture) and m.weights == pytest.approx([0.75, 0.25])
    assert not tree.made.scene.materials[m.parts[1]].base_color.any()


@HIDDEN_VALUES
@pytest.mark.parametrize("hidden", [False, True])
def test_inputs_of_groups_without_a_value_keep_the_defaults_of_cycles(hidden: bool) -> None:
    tree = Tree()
    group = bpy.data.node_groups.new("G", "ShaderNodeTree")
    for name in ("Normal", "Vector"):
        group.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketVector").hide_value = hidden
    for name in ("Factor", "Color"):
        group.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    weight, picture = group.nodes.new("ShaderNodeLayerWeight"), group.nodes.new("ShaderNodeTexImage")
    group.links.new(start.outputs["Normal"], weight.inputs["Normal"])
    group.links.new(start.outputs["Vector"], picture.inputs["Vector"])
    picture.image = bpy.data.images.new("I", 2, 2)
    node = tree.node("Group", node_tree=group)
    mixed = tree.node("MixRGB", {0: node.outputs["Factor"], 1: node.outputs["Color"]})
    group.links.new(weight.outputs["Facing"], end.inputs["Factor"])
    group.links.new(picture.outputs["Color"], end.inputs["Color"])
    tree.surface(tree.node("BsdfDiffuse", {"Color": mixed.outputs[0]}).outputs[0])
    found = list(e.nodes_of(tree.export().textures["base_color"]))
    (facing,) = (one for one in found if isinstance(one, e.LayerWeight))
    (image,) = (one for one in found if isinstance(one, e.ImageTexture))
    if hidden:
        assert facing.normal is None and image.vector == attributes.layer(attributes.ACTIVE_UV)
    else:
        assert facing.normal == (0.0, 0.0, 0.0) and image.vector == (0.0, 0.0, 0.0)


def test_surfaces_without_transparent_shadows_block_light() -> None:
    tree = Tree()
    tree.surface(tree.node("BsdfTransparent").outputs[0])
    assert tree.export().kind == "TRANSPARENT"
    tree.material.use_transparent_shadow = False
    m = tree.export()
    assert m.textures["0"] == e.Math("SUBTRACT", 1.0, e.LightPath("SHADOW"))
    tree.surface(tree.node("BsdfPrincipled", {"Alpha": 0.4}).outputs[0])
    assert tree.export().textures["alpha"].b == e.LightPath("SHADOW")


def test_colors_above_one_are_kept() -> None:
    tree = Tree()
    tree.surface(tree.node("BsdfDiffuse", {"Color": (1.5, 0.5, 0.2, 1.0)}).outputs[0])
    m = tree.export()
    color = m.textures["base_color"]
    assert isinstance(color, e.Combine) and (color.x, color.y, color.z) == pytest.approx((1.5, 0.5, 0.2))
    assert not tree.made.report.lines


@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="lights have temperatures from Blender 4.5 on")
def test_blackbody_is_not_white() -> None:
    tree = Tree()
    read = Reader().output(tree.node("Blackbody", {0: 3200.0}).outputs[0], ())
    assert read[:3] == pytest.approx([1.679368, 0.865955, 0.325887], rel=1e-4)


@pytest.mark.parametrize(
    ("name", "wanted"),
    [("Is Singular Ray", None), ("Ray Length", e.RayLength()), ("Ray Depth", e.RayBounces("ALL")),
     ("Transparent Depth", e.RayBounces("TRANSPARENT")), ("Glossy Depth", e.RayBounces("GLOSSY"))],
)  # fmt: skip
def test_rays_that_have_no_expression_are_named(name: str, wanted: e.Expression | None) -> None:
    path = Tree().node("LightPath")
    reader = Reader()
    found = reader.output(next(one for one in path.outputs if one.identifier == name), ())
    assert found == (0.0 if wanted is None else wanted)
    assert any(f"'{name}'" in note for note in reader.notes) == (wanted is None)


def test_a_color_that_subsurface_scattering_scales_is_not_written_to() -> None:
    tree = Tree()
    tree.surface(tree.node("BsdfPrincipled", {"Subsurface Weight": 1.0}).outputs[0])
    tree.export()
    with pytest.raises(Problem, match="material 'M': its base color is scaled by subsurface scattering"):
        check_material(tree.made.materials["M"], "M", "base_color")


def trapezoids() -> Any:
    """Weights of the trapezoidal rule at the cosines."""
    weights = np.full(len(subsurface.COSINES), 1.0 / (len(subsurface.COSINES) - 1))
    weights[[0, -1]] *= 0.5
    return weights


class TestSubsurface:
    """The albedo that is seen where light does not spread."""

    def test_rays_that_enter_diffusely_see_the_color(self) -> None:
        weights = trapezoids() * subsurface.COSINES
        mean = np.average(subsurface._half_space(), axis=0, weights=weights)
        low = subsurface.COLORS < 0.75  # above, Cycles' fit of the albedo is coarse, and long walks are lost
        assert mean[low] == pytest.approx(subsurface.COLORS[low], abs=0.012)

    def test_zeroth_moment_of_the_h_function(self) -> None:
        # Chandrasekhar 1960, section 38: the integral of H is 2 (1 - sqrt(1 - alpha)) / alpha.
        h, alpha = (one[..., 1:] for one in subsurface.h_functions())
        assert trapezoids() @ h == pytest.approx(2.0 * (1.0 - np.sqrt(1.0 - alpha)) / alpha, rel=2e-4)

    def test_long_walks_of_a_conservative_half_space_are_lost(self) -> None:
        # The tail of the series for alpha = 1 has a closed form; H(1) is in Chandrasekhar's table.
        assert subsurface._half_space()[-1, -1] == pytest.approx(1.0 - 2.9078 / np.sqrt(np.pi * 256.5), abs=2e-3)

    def test_textured_and_constant_colors_agree(self) -> None:
        from tests.support.node_cases.texture_points import at_values

        color = np.array([0.8, 0.4, 0.1])
        given = (tuple(color), e.Attribute("P"))
        read = [subsurface.seen_albedo(one, "RANDOM_WALK", 0.5, 1.5) for one in given]
        a, b = at_values(read, np.tile(color, (2, 1)))[:, :, :3]
        assert a == pytest.approx(b, abs=4e-3)
        assert np.all(a < color)  # seen along the normal, less light leaves

    def test_spread_is_named_unless_it_is_small(self) -> None:
        for scale, named in ((0.01, False), (1.0, True)):
            bs.empty()
            bs.camera()
            bs.light("POINT")
            tree = Tree()
            tree.surface(tree.node("SubsurfaceScattering", {"Scale": scale}).outputs[0])
            assert "base_color" in tree.export().textures
            assert ("spreads over" in tree.lines) is named


    def test_channels_without_a_radius_are_diffuse(self) -> None:
        color = np.array([0.8, 0.5, 0.3])
        tree = Tree()
        tree.surface(tree.node("SubsurfaceScattering", {"Color": (*color, 1.0), "Scale": 1e-3,
                                                        "Radius": (1.0, 1e-6, 0.0)}).outputs[0])  # fmt: skip
        made = tree.export().textures["base_color"]
        seen = Lowering(Builder(), Resources()).components(made)
        assert [seen[k] == pytest.approx(color[k]) for k in (1, 2)] == [True, True]
        assert not isinstance(seen[0], float)  # it depends on the view

    @pytest.mark.parametrize(("radius", "distance", "named"), [(1e-3, 0.0, False), (1e-5, 0.0, True),
                                                                (1e-3, 1e4, True)])  # fmt: skip
    def test_light_that_cycles_loses_by_rounding_is_named(self, radius: float, distance: float, named: bool) -> None:
        tree = Tree()
        bpy.data.objects["Cube"].location.x = distance
        tree.surface(tree.node("SubsurfaceScattering", {"Scale": 1.0, "Radius": (radius,) * 3}).outputs[0])
        tree.export()
        assert ("Cycles itself loses" in tree.lines) is named

    def test_loss_by_rounding_is_what_cycles_loses(self, tmp_path: Path) -> None:
        """Of a ball in white light, whose steps are a seventh of what coordinates are rounded by."""
        color, radius = np.array([0.8, 0.5, 0.3]), np.full(3, 1e-6)
        scene = bs.empty(24)
        scene.cycles.samples = 64
        bs.camera((0.0, 0.0, 4.0))
        bs.world((1.0, 1.0, 1.0))
        tree = Tree()
        inputs = {"Color": (*color, 1.0), "Scale": 1.0, "Radius": radius}
        tree.surface(tree.node("SubsurfaceScattering", inputs).outputs[0])
        bpy.data.objects.remove(bpy.data.objects["Cube"])
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(tree.material)
        made = bs.export()
        ours = edgegrad.Renderer(made.scene).render(spp=64, max_depth=made.settings.max_depth)
        middle = np.s_[9:15, 9:15]
        theirs = bs.cycles(tmp_path)[..., :3]
        lost = 1.0 - theirs[middle].mean() / ours[middle].mean()
        assert subsurface.rounded_share(color, radius, "RANDOM_WALK", 1.0) == pytest.approx(lost, rel=0.35)
