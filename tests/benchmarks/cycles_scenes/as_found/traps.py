"""Node trees that mean something else than they seem to: groups with unlinked inputs, muted nodes, zones, outputs."""

from __future__ import annotations

from typing import Any

import bpy

from .. import stage
from ..case import case
from .habits import checks, small


def _group(name: str, sockets: Any, build: Any) -> Any:
    """A group with inputs (name, type, default) and an output Shader, filled by ``build(group, input node)``."""
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for label, kind, value in sockets:
        made = group.interface.new_socket(label, in_out="INPUT", socket_type=kind)
        if value is not None:
            made.default_value = value
        elif kind == "NodeSocketVector":
            made.hide_value = True
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(build(group, inner), end.inputs[0])
    return group


def _used(name: str, group: Any, **inputs: Any) -> Any:
    def shader(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        for key, value in inputs.items():
            node.inputs[key].default_value = value
        return node

    return stage.material(name, shader)


@case("Groups of asset packs: inputs for Normal and Vector without a link, defaults, groups in groups", bounces=2)
def unlinked_group_inputs() -> None:
    """The vector of a texture and the normal of a shader, handed through by a group and linked to nothing."""
    small()

    def wood(group: Any, inner: Any) -> Any:
        texture = stage.node(group, "ShaderNodeTexNoise", {"Vector": inner.outputs["Vector"], "Scale": 6.0})
        image = stage.node(group, "ShaderNodeTexImage", {"Vector": inner.outputs["Vector"]}, image=checks("Squares"))
        mixed = stage.node(group, "ShaderNodeMix", {0: 0.5, 6: texture.outputs[1], 7: image.outputs[0]},
                           data_type="RGBA")  # fmt: skip
        return stage.node(group, "ShaderNodeBsdfPrincipled", {
            "Base Color": mixed.outputs[2], "Normal": inner.outputs["Normal"],
            "Roughness": inner.outputs["Roughness"]}).outputs[0]  # fmt: skip

    sockets = (("Vector", "NodeSocketVector", None), ("Normal", "NodeSocketVector", None),
               ("Roughness", "NodeSocketFloat", 0.3))  # fmt: skip
    group = _group("Wood", sockets, wood)

    def outer(tree: Any, inner: Any) -> Any:
        nested = tree.nodes.new("ShaderNodeGroup")
        nested.node_tree = group
        tree.links.new(inner.outputs["Where"], nested.inputs["Vector"])
        return nested.outputs[0]

    shown = (("Where", "NodeSocketVector", (0.3, 0.2, 0.1)),)

    def bumped(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 9.0})
        bump = stage.node(tree, "ShaderNodeBump", {"Height": noise.outputs[0], "Distance": 0.1})
        tree.links.new(bump.outputs[0], node.inputs["Normal"])
        tree.links.new(stage.node(tree, "ShaderNodeTexCoord").outputs["UV"], node.inputs["Vector"])
        return node

    nested = _group("Outer", shown, outer)
    made = [_used("Plain", group), _used("Shiny", group, Roughness=0.05), _used("Nested", nested),
            stage.material("Bumped", bumped)]  # fmt: skip
    stage.row(made, gap=1.3, segments=32)


@case("Muted nodes, reroutes, muted links, holes in Mix and Add Shader, factors beyond 0 and 1", bounces=2)
def mixed_up_trees() -> None:
    """Trees in which someone tried things."""
    small()

    def muted_bump(tree: Any) -> Any:
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 9.0})
        bump = stage.node(tree, "ShaderNodeBump", {"Height": noise.outputs[0]})
        bump.mute = True
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.4, 0.2), "Normal": bump})

    def muted_color(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=checks("Muted"))
        shift = stage.node(tree, "ShaderNodeHueSaturation", {"Hue": 0.1, "Color": texture.outputs[0]})
        shift.mute = True
        mapping = stage.node(tree, "ShaderNodeMapping", {
            "Vector": stage.node(tree, "ShaderNodeTexCoord").outputs["UV"], "Scale": (5, 5, 5)})  # fmt: skip
        mapping.mute = True
        tree.links.new(mapping.outputs[0], texture.inputs[0])
        reroute = tree.nodes.new("NodeReroute")
        tree.links.new(shift.outputs[0], reroute.inputs[0])
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": reroute.outputs[0]})

    def muted_shader(tree: Any) -> Any:
        glossy = stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.2})
        diffuse = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.2, 0.6, 0.3)})
        mix = stage.node(tree, "ShaderNodeMixShader", {0: 0.7, 1: diffuse, 2: glossy})
        mix.mute = True
        return mix

    def half_mix(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeMixShader", {
            0: 0.4, 1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.8, 0.2)})})  # fmt: skip

    def beyond(tree: Any) -> Any:
        factor = stage.node(tree, "ShaderNodeMath", {0: stage.node(tree, "ShaderNodeTexCoord").outputs["UV"], 1: 3.0},
                            operation="MULTIPLY")  # fmt: skip
        lower = stage.node(tree, "ShaderNodeMath", {0: factor, 1: 1.0}, operation="SUBTRACT")
        return stage.node(tree, "ShaderNodeMixShader", {
            0: lower, 1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.1, 0.2, 0.8)}),
            2: stage.node(tree, "ShaderNodeEmission", {"Color": (0.9, 0.3, 0.1), "Strength": 0.5})})  # fmt: skip

    def muted_link(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=checks("Unlinked"))
        body = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.6, 0.1, 0.5)})
        tree.links.new(texture.outputs[0], body.inputs[0]).is_muted = True
        return body

    def doubled(tree: Any) -> Any:
        body = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.4, 0.3, 0.3)})
        return stage.node(tree, "ShaderNodeAddShader", {0: body, 1: body})

    def muted_texture(tree: Any) -> Any:
        texture = stage.node(tree, "ShaderNodeTexImage", image=checks("Off"))
        texture.mute = True
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs[0]})

    trees = (muted_bump, muted_color, muted_shader, half_mix, beyond, muted_link, doubled, muted_texture)
    made = [stage.material(one.__name__, one) for one in trees]
    stage.row(made[:4], y=0.9, gap=1.3, segments=32)
    stage.row(made[4:], y=-0.5, gap=1.3, segments=32)


@case("Several outputs of a material: of Cycles, of EEVEE, active or not; shaders and colours mixed up", bounces=2)
def several_outputs() -> None:
    """A file made for EEVEE, with what its author added for Cycles."""
    small()

    def outputs(name: str, *wanted: tuple[str, bool, Any]) -> Any:
        made = bpy.data.materials.new(name)
        if made.node_tree is None:
            made.use_nodes = True
        tree = made.node_tree
        tree.nodes.clear()
        for target, active, color in wanted:
            body = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": color})
            stage.node(tree, "ShaderNodeOutputMaterial", {"Surface": body}, target=target, is_active_output=active)
        return made

    def cel(tree: Any) -> Any:
        body = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.5, 0.3)})
        flat = stage.node(tree, "ShaderNodeShaderToRGB", {0: body})
        ramp = stage.node(tree, "ShaderNodeValToRGB", {0: flat.outputs[0]})
        ramp.color_ramp.interpolation = "CONSTANT"
        ramp.color_ramp.elements[0].color = (0.3, 0.1, 0.4, 1.0)
        return stage.node(tree, "ShaderNodeEmission", {"Color": ramp.outputs[0]})

    def number(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeValue").outputs[0]

    def alpha(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeTexImage", image=checks("Alpha", alpha=True)).outputs["Alpha"]

    def vector(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeNewGeometry").outputs["Normal"]

    red, green, blue = (0.7, 0.1, 0.1), (0.1, 0.7, 0.1), (0.1, 0.1, 0.7)
    made = [outputs("Cycles last", ("EEVEE", True, red), ("CYCLES", False, green)),
            outputs("All and Cycles", ("ALL", True, red), ("CYCLES", False, green)),
            outputs("Two", ("ALL", False, red), ("ALL", True, blue)),
            outputs("Only EEVEE", ("EEVEE", True, red)),
            stage.material("Cel", cel), stage.material("Number", number), stage.material("Alpha", alpha),
            stage.material("Vector", vector)]  # fmt: skip
    stage.row(made[:4], y=0.9, gap=1.3, segments=32)
    stage.row(made[4:], y=-0.5, gap=1.3, segments=32)


@case("Zones and menus of Blender 5: a Repeat zone, a Menu Switch, in shaders", bounces=2)
def zones() -> None:
    """What newcomers copy from Geometry Nodes."""
    small()

    def repeated(tree: Any) -> Any:
        start, end = tree.nodes.new("GeometryNodeRepeatInput"), tree.nodes.new("GeometryNodeRepeatOutput")
        start.pair_with_output(end)
        end.repeat_items.clear()
        end.repeat_items.new("RGBA", "Color")
        start.inputs["Iterations"].default_value = 3
        start.inputs["Color"].default_value = (0.1, 0.2, 0.05, 1.0)
        more = stage.node(tree, "ShaderNodeMix", {0: 0.5, 6: start.outputs["Color"], 7: (0.9, 0.5, 0.2)},
                          data_type="RGBA")  # fmt: skip
        tree.links.new(more.outputs[2], end.inputs["Color"])
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": end.outputs["Color"]})

    def switched(tree: Any) -> Any:
        menu = tree.nodes.new("GeometryNodeMenuSwitch")
        menu.data_type = "RGBA"
        menu.inputs[1].default_value = (0.2, 0.3, 0.9, 1.0)
        menu.inputs[2].default_value = (0.9, 0.3, 0.2, 1.0)
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": menu.outputs[0]})

    made = []
    for one in (repeated, switched):
        try:
            made.append(stage.material(one.__name__, one))
        except (RuntimeError, AttributeError, KeyError, TypeError) as error:
            print(one.__name__, error)
    stage.row(made, gap=1.3, segments=32)
