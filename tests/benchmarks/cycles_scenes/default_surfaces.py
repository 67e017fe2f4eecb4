"""What Cycles renders where a material says nothing or only half: default cubes, empty slots, outputs, volumes."""

from __future__ import annotations

from typing import Any

import bpy

from . import stage
from .case import case


def _small() -> None:
    stage.studio()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96


def _bare(name: str) -> Any:
    """A material with an empty node tree."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    made.node_tree.nodes.clear()
    return made


def _volume(name: str, kind: str, surface: Any = None, **inputs: Any) -> Any:
    made = _bare(name)
    linked = {"Volume": stage.node(made.node_tree, kind, inputs)}
    if surface is not None:
        linked["Surface"] = surface(made.node_tree)
    stage.node(made.node_tree, "ShaderNodeOutputMaterial", linked)
    return made


@case("Objects that never got a material: a cube, a sphere, a monkey and the floor")
def no_materials() -> None:
    """A first scene: meshes are added and rendered."""
    _small()
    bpy.data.objects["Floor"].data.materials.clear()
    stage.add("Cube", stage.cube("Cube", size=1.2), (-1.8, 0.2, 0.6), (0, 0, 0.4))
    stage.add("Sphere", stage.sphere("Sphere", radius=0.7), (0.0, 0.0, 0.7))
    stage.add("Suzanne", stage.monkey("Suzanne"), (1.9, 0.0, 0.8), (0, 0, 0.3), 0.8)


@case("Empty material slots, faces of slots that are empty, and slots linked to the object")
def empty_slots() -> None:
    """Slots that were added with + and never filled."""
    _small()
    red = stage.principled("Red", (0.8, 0.1, 0.1))
    one = stage.cube("One empty", size=1.1)
    one.materials.append(None)
    half = stage.cube("Half empty", red, size=1.1)
    half.materials.append(None)
    for k, face in enumerate(half.polygons):
        face.material_index = k % 2
    stage.add("One empty", one, (-1.7, 0.0, 0.55), (0, 0, 0.5))
    stage.add("Half empty", half, (0.0, 0.0, 0.55), (0, 0, 0.5))
    own = stage.add("Of object", stage.cube("Of object", red, size=1.1), (1.7, 0.0, 0.55), (0, 0, 0.5))
    own.material_slots[0].link = "OBJECT"  # and nothing is chosen there


@case("Several outputs in a tree, outputs for EEVEE only, outputs without a link, and no output")
def output_targets() -> None:
    """One ball each."""
    _small()

    def outputs(name: str, *targets: tuple[str, bool, Any]) -> Any:
        made = _bare(name)
        for target, active, color in targets:
            shader = stage.node(made.node_tree, "ShaderNodeBsdfDiffuse", {"Color": color})
            output = stage.node(made.node_tree, "ShaderNodeOutputMaterial", {"Surface": shader}, target=target)
            if active:
                output.is_active_output = True
        return made

    red, green = (0.8, 0.1, 0.1), (0.1, 0.7, 0.1)
    stage.row([outputs("Of all and Cycles", ("ALL", True, red), ("CYCLES", False, green)),
               outputs("Two of all", ("ALL", False, red), ("ALL", True, green)),
               outputs("EEVEE and all", ("EEVEE", True, red), ("ALL", False, green)),
               outputs("EEVEE", ("EEVEE", True, red))], y=-0.7)  # fmt: skip
    unlinked = _bare("Unlinked")
    unlinked.node_tree.nodes.new("ShaderNodeOutputMaterial")
    stage.row([unlinked, _bare("No output"), outputs("Plain", ("ALL", True, green))], y=0.7)


@case("Materials with only a thin volume, which is invisible but for it, beside a solid one")
def volume_only() -> None:
    """The surface around a volume is transparent."""
    _small()
    thin = {"Density": 0.002}
    fogs = [_volume("Absorbing", "ShaderNodeVolumeAbsorption", **thin),
            _volume("Mist", "ShaderNodeVolumeScatter", **thin),
            _volume("Principled", "ShaderNodeVolumePrincipled", **thin)]  # fmt: skip
    for k, fog in enumerate(fogs):
        stage.add(fog.name, stage.cube(fog.name, fog, size=1.3), (1.6 * (k - 1), 0.0, 0.7), (0, 0, 0.2 * k))
    stage.row([stage.diffuse("Behind", (0.7, 0.5, 0.1))], y=1.6)


@case("Ink: glass with an absorbing volume, and a cube of smoke", bounces=4, samples=64)
def volume_beside_surface() -> None:
    """Absorption alone, and a medium."""
    _small()
    ink = _volume("Ink", "ShaderNodeVolumeAbsorption",
                  lambda tree: stage.node(tree, "ShaderNodeBsdfGlass", {"IOR": 1.33, "Roughness": 0.0}),
                  Color=(0.2, 0.4, 0.9), Density=2.0)  # fmt: skip
    stage.row([ink], radius=0.7)
    smoke = _volume("Smoke", "ShaderNodeVolumePrincipled", Density=0.8)
    stage.add("Smoke", stage.cube("Smoke", smoke, size=1.2), (2.0, 0.0, 0.65))


@case("Films without transparent shadows: their shadows are black, though one sees through them", bounces=2)
def opaque_shadows() -> None:
    """Panes between a small lamp and the floor."""
    _small()
    for name in ("Key", "Rim"):
        bpy.data.objects.remove(bpy.data.objects[name])
    bpy.context.scene.world = None
    stage.lamp("POINT", "Bulb", 300.0, (0.0, -1.0, 4.0), shadow_soft_size=0.0)
    films = [stage.simple("Film", "ShaderNodeBsdfTransparent", {"Color": (0.9, 0.5, 0.4)}),
             stage.principled("Alpha", (0.2, 0.4, 0.8), Alpha=0.4),
             stage.material("Holes", lambda tree: stage.node(tree, "ShaderNodeMixShader", {
                 "Fac": 0.5, 1: stage.node(tree, "ShaderNodeBsdfDiffuse"),
                 2: stage.node(tree, "ShaderNodeBsdfTransparent")}))]  # fmt: skip
    for k, film in enumerate(films):
        film.use_transparent_shadow = False
        stage.add(film.name, stage.plane(film.name, film, size=1.2), (1.5 * (k - 1), 0.0, 1.0), (0.3, 0, 0.3))
