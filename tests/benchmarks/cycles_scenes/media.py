"""Fog, smoke and murky liquids: homogeneous volumes in meshes and in the world."""

from __future__ import annotations

from functools import partial
from typing import Any

import bpy

from . import stage
from .case import case


def _volume(name: str, volume: stage.Shader, surface: stage.Shader | None = None) -> Any:
    """A material with a volume, and no surface if none is given."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    linked = {"Volume": volume(tree)} | ({"Surface": surface(tree)} if surface else {})
    stage.node(tree, "ShaderNodeOutputMaterial", linked)
    return made


def _scatter(tree: Any, **inputs: Any) -> Any:
    return stage.node(tree, "ShaderNodeVolumeScatter", inputs)


def _small() -> None:
    stage.studio()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 96, 72


def _dark() -> None:
    """The studio without its lamps and world."""
    _small()
    for ob in [ob for ob in bpy.data.objects if ob.type == "LIGHT"]:
        bpy.data.objects.remove(ob)
    bpy.context.scene.world = None


@case("Cubes of smoke, one with a ball in it, and their shadows", samples=128)
def smoke() -> None:
    """Volume Scatter of three densities and anisotropies."""
    _small()
    for k, (density, anisotropy, color) in enumerate(
        ((0.5, 0.0, (0.8, 0.8, 0.8)), (2.0, 0.7, (0.9, 0.5, 0.2)), (8.0, -0.4, (0.3, 0.5, 0.9)))
    ):
        inputs = {"Color": color, "Density": density, "Anisotropy": anisotropy}
        haze = _volume(f"Haze {k}", partial(_scatter, **inputs))
        stage.add(haze.name, stage.cube(haze.name, haze, size=1.2), (1.6 * (k - 1), 0.0, 0.65), (0, 0, 0.3 * k))
    stage.add("Ball", stage.sphere("Ball", stage.diffuse("Red", (0.8, 0.1, 0.1)), radius=0.3), (-1.6, 0.0, 0.6))


@case("A room full of fog around the camera, with the beam of a spot", samples=256)
def foggy_room() -> None:
    """A large cube whose surface is not seen."""
    _dark()
    stage.add("Fog", stage.cube("Fog", _volume("Fog", lambda tree: _scatter(tree, Density=0.05)), size=30.0))
    stage.lamp("SPOT", "Beam", 800.0, (-2.5, 1.0, 4.0), (0.5, 0.0, 0.3), spot_size=0.6, shadow_soft_size=0.05)
    stage.row([stage.diffuse("Clay"), stage.principled("Shiny", (0.1, 0.4, 0.8), Roughness=0.2)])


@case("A room full of dark haze that absorbs light alone, around camera, lamp and balls", samples=64)
def dark_haze() -> None:
    """Volume Absorption without a surface."""
    _dark()
    haze = _volume("Haze", lambda tree: stage.node(tree, "ShaderNodeVolumeAbsorption", {
        "Color": (0.2, 0.5, 0.8), "Density": 0.1}))  # fmt: skip
    stage.add("Haze", stage.cube("Haze", haze, size=30.0))
    stage.lamp("POINT", "Bulb", 800.0, (-2.5, 1.0, 4.0), shadow_soft_size=0.05)
    stage.row([stage.diffuse("Clay"), stage.principled("Shiny", (0.1, 0.4, 0.8), Roughness=0.2)])


@case("A bulb inside of a cloud, several bounces", bounces=4, volume_bounces=3, samples=256)
def lit_cloud() -> None:
    """A Principled Volume that absorbs a color."""
    _dark()
    cloud = _volume("Cloud", lambda tree: stage.node(tree, "ShaderNodeVolumePrincipled", {
        "Color": (0.7, 0.8, 0.9), "Density": 1.5, "Anisotropy": 0.3, "Absorption Color": (0.9, 0.3, 0.1)}))  # fmt: skip
    stage.add("Cloud", stage.sphere("Cloud", cloud, radius=1.0), (0.0, 0.0, 1.1))
    stage.lamp("POINT", "Bulb", 60.0, (0.2, -0.1, 1.3), shadow_soft_size=0.05)


@case("Milk: a ball of smooth glass full of a medium, and the sum and mix of volumes", bounces=6, volume_bounces=6,
      samples=256)  # fmt: skip
def murky_liquids() -> None:
    """Add Shader and Mix Shader of volumes."""
    _small()

    def glass(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeBsdfGlass", {"IOR": 1.33, "Roughness": 0.0})

    def added(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeAddShader", {
            0: _scatter(tree, Density=1.0), 1: stage.node(tree, "ShaderNodeVolumeAbsorption", {
                "Color": (0.2, 0.6, 0.9), "Density": 1.5})})  # fmt: skip

    def mixed(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeMixShader", {
            "Fac": 0.3, 1: _scatter(tree, Density=3.0, Anisotropy=0.5),
            2: _scatter(tree, Color=(0.8, 0.3, 0.3))})  # fmt: skip

    milk = _volume("Milk", lambda tree: _scatter(tree, Color=(0.9, 0.85, 0.8), Density=3.0), glass)
    stage.row([milk, _volume("Added", added), _volume("Mixed", mixed)])


@case("A world full of fog, which hides its background, under lamps", samples=256)
def foggy_world() -> None:
    """The fog has no end."""
    _small()
    tree = bpy.context.scene.world.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    fog = stage.node(tree, "ShaderNodeVolumeScatter", {"Density": 0.04, "Anisotropy": 0.2})
    tree.links.new(fog.outputs[0], output.inputs["Volume"])
    stage.row([stage.diffuse("Clay"), stage.principled("Shiny", (0.1, 0.4, 0.8), Roughness=0.2)])


@case("Fog that copies share, some of them mirrored and unevenly scaled, around a glowing rod", samples=128)
def copied_fog() -> None:
    """Linked duplicates of one mesh."""
    _small()
    mesh = stage.cube("Fog", _volume("Fog", lambda tree: _scatter(tree, Color=(0.6, 0.9, 0.7), Density=1.0)), size=1.0)
    for k, scale in enumerate(((1.0, 1.0, 1.0), (-1.0, 1.0, 1.4), (0.6, 1.5, 0.8))):
        stage.add(f"Fog {k}", mesh, (1.5 * (k - 1), 0.0, 0.8), (0.2 * k, 0.1, 0.4 * k), scale)
    rod = stage.cylinder("Rod", stage.emitter("Glow", (1.0, 0.6, 0.3), 5.0), radius=0.03, depth=5.0)
    stage.add("Rod", rod, (0.0, 0.1, 0.8), (0, 1.5708, 0))


@case("Smoke that the camera or shadow rays do not see, and in fog that scatters forwards", samples=128, differs=[
    "rays that do not see a volume's mesh pass its volume all the same",
    "overlapping volumes have one phase function"])  # fmt: skip
def hidden_smoke() -> None:
    """Visibility of objects, as it is set for surfaces, on volumes."""
    _small()
    smoke = _volume("Smoke", partial(_scatter, Density=1.0, Color=(0.8, 0.5, 0.3)))
    forwards = _volume("Forwards", partial(_scatter, Density=1.0, Anisotropy=0.8))
    for k, ray in enumerate(("camera", "shadow", "none")):
        ob = stage.add(f"Smoke {ray}", stage.cube(f"Smoke {ray}", smoke, size=1.2), (1.7 * (k - 1), 0.0, 0.65))
        if ray != "none":
            setattr(ob, f"visible_{ray}", False)
    stage.add("Forwards", stage.cube("Forwards", forwards, size=1.0), (1.9, -0.4, 0.6))
