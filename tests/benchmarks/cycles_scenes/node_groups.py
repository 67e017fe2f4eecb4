"""Node groups as they are shared: inputs without links, hidden values, nested and repeated groups, muted nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from . import stage
from .case import case

Build = Callable[[Any, Any, Any], None]


def _small() -> None:
    stage.studio()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96


def _group(name: str, inputs: dict[str, str], output: str, build: Build, hidden: tuple[str, ...] = ()) -> Any:
    """A node group; `inputs` maps names to kinds of sockets. Values of `hidden` inputs can't be set."""
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for key, kind in inputs.items():
        socket = group.interface.new_socket(key, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        socket.hide_value = key in hidden
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type=f"NodeSocket{output}")
    build(group, group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput"))
    return group


def _use(tree: Any, group: Any) -> Any:
    return stage.node(tree, "ShaderNodeGroup", node_tree=group)


def _rubber(group: Any, start: Any, end: Any) -> None:
    """A diffuse body under a gloss whose weight depends on the normal."""
    normal = start.outputs["Normal"]
    body = stage.node(group, "ShaderNodeBsdfDiffuse", {"Color": start.outputs["Color"], "Normal": normal})
    gloss = stage.node(group, "ShaderNodeBsdfGlossy", {"Roughness": 0.2, "Normal": normal}, distribution="GGX")
    fresnel = stage.node(group, "ShaderNodeFresnel", {"IOR": 1.45, "Normal": normal})
    mix = stage.node(group, "ShaderNodeMixShader", {0: fresnel, 1: body, 2: gloss})
    group.links.new(mix.outputs[0], end.inputs[0])


@case("Groups with a Normal input that nothing is linked to, its value hidden or not")
def group_normals() -> None:
    """Materials of kits: the normal is an input of the group."""
    _small()
    sockets = {"Color": "Color", "Normal": "Vector"}

    def of(group: Any, color: Any) -> Any:
        def shader(tree: Any) -> Any:
            node = _use(tree, group)
            node.inputs["Color"].default_value = (*color, 1.0)
            return node.outputs[0]

        return shader

    hidden = _group("Rubber", sockets, "Shader", _rubber, hidden=("Normal",))
    shown = _group("Rubber with a value", sockets, "Shader", _rubber)

    def outer(group: Any, start: Any, end: Any) -> None:
        node = _use(group, hidden)
        for name in sockets:
            group.links.new(start.outputs[name], node.inputs[name])
        group.links.new(node.outputs[0], end.inputs[0])

    nested = _group("Outer", sockets, "Shader", outer, hidden=("Normal",))
    half = _group("Half hidden", sockets, "Shader", outer)
    green = (0.1, 0.5, 0.15)
    stage.row([stage.material("Green rubber", of(hidden, green)), stage.material("Nested", of(nested, green)),
               stage.material("Red rubber", of(hidden, (0.6, 0.1, 0.1)))], y=-0.7)  # fmt: skip
    stage.row([stage.material("Shown", of(shown, green)), stage.material("Half hidden", of(half, green))], y=0.7)


@case("Groups with a Vector input that nothing is linked to: images, checks, noise")
def group_vectors() -> None:
    """Textures in a group use their default coordinates if the input has no value."""
    _small()
    picture = stage.image("Group", np.random.default_rng(5).uniform(0.1, 0.9, (6, 8, 3)))

    def textured(kind: str, output: Any, hide: bool, **settings: Any) -> Any:
        def build(group: Any, start: Any, end: Any) -> None:
            texture = stage.node(group, kind, {"Vector": start.outputs["Vector"]}, **settings)
            group.links.new(texture.outputs[output], end.inputs[0])

        group = _group(f"{kind} {hide}", {"Vector": "Vector"}, "Color", build, hidden=("Vector",) if hide else ())
        return stage.material(f"{kind} {hide}", lambda tree: stage.node(
            tree, "ShaderNodeBsdfDiffuse", {"Color": _use(tree, group)}))  # fmt: skip

    kinds: list[tuple[str, Any, dict[str, Any]]] = [
        ("ShaderNodeTexImage", 0, {"image": picture}), ("ShaderNodeTexChecker", 0, {}),
        ("ShaderNodeTexNoise", "Color", {}),
        ("ShaderNodeTexEnvironment", 0, {"image": picture}),
    ]  # fmt: skip
    stage.row([textured(kind, output, True, **given) for kind, output, given in kinds], y=-0.7)
    stage.row([textured(kind, output, False, **given) for kind, output, given in kinds], y=0.7)


@case("Muted nodes, muted links and reroutes in the way of colours, normals and shaders")
def muted_nodes() -> None:
    """Left from trying things out."""
    _small()

    def muted(kind: str, given: Any, to: str, mute: bool = True, link: bool = False, output: Any = 0) -> Any:
        def shader(tree: Any) -> Any:
            node = stage.node(tree, kind, given(tree))
            node.mute = mute
            made = stage.node(tree, "ShaderNodeBsdfPrincipled", {"Roughness": 0.3})
            tree.links.new(node.outputs[output], made.inputs[to]).is_muted = link
            return made

        return stage.material(f"{kind} {mute} {link}", shader)

    def noise(name: Any) -> Any:
        return lambda tree: {name: stage.node(tree, "ShaderNodeTexNoise", {"Scale": 4.0}).outputs["Color"]}

    stage.row([muted("ShaderNodeNormalMap", noise("Color"), "Normal"),
               muted("ShaderNodeBump", noise("Height"), "Normal"),
               muted("ShaderNodeGamma", noise("Color"), "Base Color"),
               muted("ShaderNodeRGB", lambda tree: {}, "Base Color")], y=-0.7)  # fmt: skip

    def muted_mix(tree: Any) -> Any:
        mix = stage.node(tree, "ShaderNodeMixShader", {
            1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.3, 0.1)}),
            2: stage.node(tree, "ShaderNodeEmission", {"Strength": 5.0})}, mute=True)  # fmt: skip
        reroute = tree.nodes.new("NodeReroute")
        tree.links.new(mix.outputs[0], reroute.inputs[0])
        return reroute.outputs[0]

    stage.row([muted("ShaderNodeTexNoise", lambda tree: {}, "Base Color", False, True, "Color"),
               muted("ShaderNodeTexNoise", lambda tree: {}, "Base Color", True, False, "Color"),
               stage.material("Muted mix", muted_mix)], y=0.7)  # fmt: skip


@case("Nodes of the camera and of the object: camera data, camera space, object space, tangents", bounces=1)
def camera_nodes() -> None:
    """Depth fades and matcaps."""
    _small()

    def glow(kind: str, output: Any, given: Any = None, low: float = 0.0, high: float = 1.0, **settings: Any) -> Any:
        def shader(tree: Any) -> Any:
            made = stage.node(tree, kind, given(tree) if given else {}, **settings)
            value = stage.node(tree, "ShaderNodeVectorMath", {0: made.outputs[output]}, operation="ABSOLUTE")
            span = stage.node(tree, "ShaderNodeMapRange", data_type="FLOAT_VECTOR")
            tree.links.new(value.outputs[0], span.inputs["Vector"])
            span.inputs[7].default_value, span.inputs[8].default_value = (low,) * 3, (high,) * 3
            return stage.node(tree, "ShaderNodeEmission", {"Color": span.outputs["Vector"], "Strength": 0.8})

        return stage.material(f"{kind} {output} {settings}", shader)

    def normal(tree: Any) -> Any:
        return {0: stage.node(tree, "ShaderNodeNewGeometry").outputs["Normal"]}

    space = "ShaderNodeVectorTransform"
    balls = stage.row([
        glow("ShaderNodeCameraData", "View Z Depth", low=6.0, high=9.0),
        glow("ShaderNodeCameraData", "View Distance", low=6.0, high=9.0), glow("ShaderNodeCameraData", "View Vector"),
        glow(space, 0, normal, vector_type="NORMAL", convert_from="WORLD", convert_to="CAMERA"),
    ], y=-0.7)  # fmt: skip
    balls += stage.row([glow(space, 0, normal, vector_type="VECTOR", convert_from="WORLD", convert_to="OBJECT"),
                        glow("ShaderNodeTangent", 0)], y=0.7)  # fmt: skip
    for ball in balls:
        ball.rotation_euler, ball.scale = (0.4, 0.3, 0.8), (1.0, 0.8, 1.1)


@case("Light Path in materials: glass without shadows, lamps that only the camera sees, depths", bounces=3)
def ray_nodes() -> None:
    """Tricks with Light Path."""
    _small()

    def by(output: str, first: Any, second: Any) -> Any:
        return stage.material(f"By {output}", lambda tree: stage.node(tree, "ShaderNodeMixShader", {
            0: stage.node(tree, "ShaderNodeLightPath").outputs[output], 1: first(tree), 2: second(tree)}))  # fmt: skip

    def glass(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfGlass", {"IOR": 1.4, "Roughness": 0.0})

    def clear(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfTransparent")

    def chalk(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.4, 0.2)})

    def metal(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfGlossy", {"Roughness": 0.2}, distribution="GGX")

    stage.row([by("Is Shadow Ray", glass, clear), by("Is Camera Ray", metal, chalk), by("Is Diffuse Ray", chalk, metal),
               by("Ray Depth", chalk, metal), by("Is Singular Ray", chalk, metal)])  # fmt: skip
