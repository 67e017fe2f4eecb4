"""Export of volumes of materials and of the world: media, absorption, and what is named."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.scenes import blender_scenes as bs
from tests.support.scenes import material_tree

pytestmark = pytest.mark.usefixtures("lit_scene")


class Tree(material_tree.Tree):
    """A material without a surface, on a cube of edge 2."""

    def __init__(self) -> None:
        super().__init__()
        self.output = self.tree.get_output_node("CYCLES")
        self.tree.links.remove(self.output.inputs["Surface"].links[0])

    def node(self, kind: str, inputs: dict[Any, Any] | None = None, **settings: Any) -> Any:
        node = super().node(kind, **settings)
        for key, value in (inputs or {}).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.link(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node

    @property
    def lines(self) -> str:
        return "\n".join(self.made.report.lines)


def test_homogeneous_volumes_become_media() -> None:
    tree = Tree()
    fog = tree.node("VolumeScatter", {"Color": (0.5, 0.25, 1.0, 1.0), "Density": 2.0, "Anisotropy": 0.4})
    tree.tree.links.new(fog.outputs[0], tree.output.inputs["Volume"])
    for kind in ("TRANSPARENT", "DIFFUSE"):
        m = tree.export()
        assert m.kind == kind and m.medium == edgegrad.Medium((1.0, 0.5, 2.0), anisotropy=pytest.approx(0.4))
        assert not tree.made.report.lines
        tree.surface(tree.node("BsdfDiffuse").outputs[0])
    ink = tree.node("VolumeAbsorption", {"Color": (0.5, 0.5, 1.0, 1.0), "Density": 3.0})
    tree.tree.links.new(tree.node("AddShader", {0: fog.outputs[0], 1: ink.outputs[0]}).outputs[0],
                        tree.output.inputs["Volume"])  # fmt: skip
    assert tree.export().medium == edgegrad.Medium((1.0, 0.5, 2.0), (1.5, 1.5, 0.0), pytest.approx(0.4))
    share = {0: 0.25, 1: fog.outputs[0], 2: ink.outputs[0]}
    tree.tree.links.new(tree.node("MixShader", share).outputs[0], tree.output.inputs["Volume"])
    medium = tree.export().medium
    assert medium.scattering == pytest.approx((0.75, 0.375, 1.5))
    assert medium.absorption == pytest.approx((0.375, 0.375, 0.0))
    tree.tree.links.new(ink.outputs[0], tree.output.inputs["Volume"])
    m = tree.export()  # absorption alone has derivatives
    assert m.medium is None and m.absorption == pytest.approx([1.5, 1.5, 0.0])
    for link in tree.output.inputs["Surface"].links:
        tree.tree.links.remove(link)
    m = tree.export()  # what stands in it counts
    assert m.medium == edgegrad.Medium((0.0, 0.0, 0.0), (1.5, 1.5, 0.0)) and not m.absorption.any()


def test_volumes_that_vary_or_glow_and_other_phase_functions_are_named() -> None:
    tree = Tree()
    fog = tree.node("VolumeScatter", {"Density": tree.node("TexNoise").outputs[0]})
    tree.tree.links.new(fog.outputs[0], tree.output.inputs["Volume"])
    assert tree.export().medium is None and "is left out, since it is not homogeneous" in tree.lines
    fire = tree.node("VolumePrincipled", {"Density": 1.0, "Blackbody Intensity": 1.0})
    tree.tree.links.new(fire.outputs[0], tree.output.inputs["Volume"])
    assert tree.export().medium is not None and "set 'Blackbody Intensity' to 0" in tree.lines
    if hasattr(fog, "phase"):
        fog = tree.node("VolumeScatter", {"Density": 1.0}, phase="RAYLEIGH")
        tree.tree.links.new(fog.outputs[0], tree.output.inputs["Volume"])
        assert tree.export().medium.anisotropy == 0.0 and "phase function Rayleigh" in tree.lines


def test_what_absorption_does_not_reach_is_named() -> None:
    """An object within an absorbing mesh, and a mesh with open borders."""
    tree = Tree()
    tree.tree.links.new(tree.node("VolumeAbsorption", {"Density": 1.0}).outputs[0], tree.output.inputs["Volume"])
    tree.surface(tree.node("BsdfGlass").outputs[0])
    for name, place in (("Within", (0.0, 0.0, 0.0)), ("Beside", (5.0, 0.0, 0.0))):
        other = bs.add(name, bs.cube(name, bs.material(name, (0.5, 0.5, 0.5))))
        other.location, other.scale = place, (0.2, 0.2, 0.2)
    tree.export()
    lines = [line for line in tree.made.report.lines if "absorbs light" in line]
    assert len(lines) == 1 and "'Cube'" in lines[0] and "'Within'" in lines[0]
    data = bpy.data.objects["Cube"].data
    data.clear_geometry()
    data.from_pydata([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], [], [(0, 1, 2)])
    tree.export()
    assert any("'Cube'" in line and "open borders" in line for line in tree.made.report.lines)
    tree.tree.links.new(tree.node("VolumeScatter", {"Density": 1.0}).outputs[0], tree.output.inputs["Volume"])
    tree.export()
    assert any("'Cube': holds a volume" in line and "open borders" in line for line in tree.made.report.lines)


def test_homogeneous_volumes_of_the_world_are_read() -> None:
    tree = Tree()
    bpy.context.scene.world = world = bpy.data.worlds.new("W")
    if world.node_tree is None:
        world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    output, fog = world.node_tree.get_output_node("CYCLES"), nodes.new("ShaderNodeVolumeScatter")
    fog.inputs["Color"].default_value, fog.inputs["Density"].default_value = (0.5, 0.5, 0.5, 1.0), 0.2
    links.new(fog.outputs[0], output.inputs["Volume"])
    tree.export()
    assert tree.made.scene.world.medium == edgegrad.Medium((pytest.approx(0.1),) * 3)
    links.remove(output.inputs["Surface"].links[0])
    tree.export()
    assert tree.made.scene.world.medium is not None
    links.new(nodes.new("ShaderNodeTexNoise").outputs[0], fog.inputs["Density"])
    tree.export()
    assert tree.made.scene.world.medium is None and "in Cycles, it has no end" in tree.lines


def test_mixed_phase_functions_and_partly_filled_meshes_are_named() -> None:
    tree = Tree()
    one, other = (tree.node("VolumeScatter", {"Density": 1.0, "Anisotropy": g}) for g in (0.0, 0.8))
    added = tree.node("AddShader", {0: one.outputs[0], 1: other.outputs[0]})
    tree.link(added.outputs[0], tree.output.inputs["Volume"])
    assert tree.export().medium.anisotropy == pytest.approx(0.4) and "rendered with their mean" in tree.lines
    tree.object.data.materials.append(bs.material("Wall", (0.5, 0.5, 0.5)))
    tree.object.data.polygons[0].material_index = 1
    tree.export()
    assert "'Cube': holds a volume, but not all of its faces" in tree.lines


def test_hidden_volumes_and_those_that_overlap_with_another_anisotropy_are_named() -> None:
    tree = Tree()
    smoke = tree.node("VolumeScatter", {"Density": 1.0})
    tree.link(smoke.outputs[0], tree.output.inputs["Volume"])
    tree.export()
    assert "volume of object" not in tree.lines
    tree.object.visible_camera = tree.object.visible_shadow = False
    tree.export()
    assert "volume of object 'Cube': camera and shadow rays do not see the object" in tree.lines
    assert "changes the picture by at most" in tree.lines
    tree.object.visible_camera = tree.object.visible_shadow = True
    fog = bs.material("Fog", (0.5, 0.5, 0.5))
    scatter = fog.node_tree.nodes.new("ShaderNodeVolumeScatter")
    scatter.inputs["Anisotropy"].default_value = 0.8
    fog.node_tree.links.new(scatter.outputs[0], fog.node_tree.get_output_node("CYCLES").inputs["Volume"])
    other = bs.add("Other", bs.cube("Other", fog), (5.0, 0.0, 0.0))
    tree.export()
    assert "volume of object" not in tree.lines  # they stand apart
    other.location.x = 0.5
    tree.export()
    assert "where it overlaps that of object 'Other', both scatter light with the mean" in tree.lines
    scatter.inputs["Anisotropy"].default_value = 0.0
    tree.export()
    assert "volume of object" not in tree.lines
