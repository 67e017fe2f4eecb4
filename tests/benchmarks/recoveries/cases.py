"""Scenes of which Cycles renders the truth, what is changed in them, and what is fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from tests.support.animated import scenes as zoo
from tests.support.scenes import blender_scenes as bs


@dataclass(frozen=True)
class Case:
    """One recovery.

    Attributes
    ----------
    title
        What is found, from what.
    build
        Makes the scene; returns the full paths of what is lost, and by how much it is changed (degrees of freedom in
        the order of the paths). The name of an object stands for the vertices of its mesh, that of an image for its
        pixels.
    iterations
        Of the fit.
    cameras
        That give a target each.
    options
        Of the command line.
    saved
        "": as EXR, with many samples. "exr" or "agx": as Cycles renders by default, denoised, and of an exposure that
        the fit does not know; as EXR, or as an 8-bit PNG with the view transform AgX.
    """

    title: str
    build: Callable[[int], tuple[Sequence[str], Any]]
    iterations: int = 80
    cameras: tuple[str, ...] = ("Camera",)
    options: tuple[str, ...] = ()
    saved: str = ""


def bones(size: int) -> tuple[Sequence[str], Any]:
    """A long box, bent by a chain of eight bones."""
    return zoo.bent_arm(size)


def face(size: int) -> tuple[Sequence[str], Any]:
    """A rounded head whose mouth, brow and cheek are shape keys."""
    ob = zoo.stage(size)
    for k, move in ((7, (0.7, 0.0, 0.3)), (3, (-0.5, 0.0, 0.5)), (4, (0.4, -0.6, 0.0))):
        zoo.shape_key(ob, f"Key {k}", k, move).value = 0.5
    zoo.subdivided(ob, 2)
    return [f'{zoo.KEYS}.key_blocks["Key {k}"].value' for k in (7, 3, 4)], [0.4, -0.4, 0.4]


def room(size: int) -> tuple[Sequence[str], Any]:
    """Some furniture, seen by a camera that stood elsewhere and had another lens."""
    zoo.stage(size)
    bs.add("Post", bs.cube("Post", bs.material("Blue", (0.1, 0.2, 0.7))), (-1.6, 1.5, 0), scale=(0.3, 0.3, 1.2))
    bs.add("Box", bs.cube("Box", bs.material("Green", (0.1, 0.6, 0.2))), (1.7, -0.9, -0.7), scale=(0.35, 0.35, 0.35))
    paths = ['objects["Camera"].location', 'objects["Camera"].rotation_euler', 'cameras["Camera"].lens']
    return paths, [0.2, -0.2, 0.15, 0.02, 0.03, -0.03, 3.0]


def sun(size: int) -> tuple[Sequence[str], Any]:
    """A cube in the sun under a hazy sky, of which the camera sees the floor with the shadow."""
    zoo.stage(size)
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    bs.light("SUN", "Sun", (0.0, 0.0, 6.0), (0.7, 0.3, 0.0), energy=2.5, angle=0.05)
    tree = bpy.context.scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.name, sky.sky_type, sky.turbidity, sky.sun_direction = "Sky", "PREETHAM", 3.0, (0.3, -0.6, 0.74)
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.1
    world = bpy.context.scene.world.name
    paths = ['objects["Sun"].rotation_euler[0]', 'objects["Sun"].rotation_euler[1]',
             f'worlds["{world}"].node_tree.nodes["Sky"].turbidity']  # fmt: skip
    return paths, [0.25, -0.35, 3.0]


def cage(size: int) -> tuple[Sequence[str], Any]:
    """A cube under a Subdivision modifier, whose eight vertices were pulled."""
    ob = zoo.stage(size)
    zoo.subdivided(ob, 2)
    bs.camera((4.5, -3.5, 2.2), (1.2, 0.0, 0.9), "Side")
    return ["Cube"], 0.35 * np.random.default_rng(3).uniform(-1.0, 1.0, (8, 3)).ravel()


def nodes(size: int) -> tuple[Sequence[str], Any]:
    """A cube that a geometry node group stretches, and its colour."""
    zoo.geometry_nodes(zoo.stage(size), 0.2)
    return [f'{zoo.CUBE}.modifiers["Nodes"]["Lift"]',
            f'{zoo.CLAY}.nodes["Diffuse BSDF"].inputs["Color"].default_value'], [0.3, -0.2, 0.2, 0.2, 0.0]


def _picture(name: str, pixels: Any, codes: bool) -> Any:
    made = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], float_buffer=not codes)
    made.colorspace_settings.name = "sRGB" if codes else "Linear Rec.709"
    opaque = np.concatenate([pixels, np.ones((*pixels.shape[:2], 1))], axis=2)
    made.pixels.foreach_set(opaque.astype(np.float32).ravel())
    made.pack()
    return made


def _textured_floor(size: int, side: int = 64, codes: bool = False) -> None:
    """A floor with smooth coloured waves, in whose texture coordinates the world's metres are.

    `side`: pixels along a side of its image. `codes`: it has 8-bit sRGB codes.
    """
    zoo.stage(size)
    y, x = np.mgrid[0:side, 0:side] / side * 2.0 * np.pi
    waves = 0.5 + 0.4 * np.stack([np.sin(6 * x), np.sin(6 * y), np.sin(5 * (x + y))], axis=-1)
    material = bpy.data.materials["Grey"]
    tree = material.node_tree
    image, where = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexCoord")
    image.image = _picture("Waves", waves, codes)
    scaled = tree.nodes.new("ShaderNodeMapping")
    scaled.inputs["Scale"].default_value = (0.15, 0.15, 0.15)
    tree.links.new(where.outputs["Object"], scaled.inputs["Vector"])
    tree.links.new(scaled.outputs[0], image.inputs["Vector"])
    tree.links.new(image.outputs["Color"], bs.shader(material).inputs["Color"])


def glass(size: int) -> tuple[Sequence[str], Any]:
    """A slanted pane of glass over a floor of waves, which are shifted the more the thicker it is."""
    _textured_floor(size)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.data.objects.remove(bpy.data.objects["Lamp"])  # its light through the pane would be a caustic
    cycles = bpy.context.scene.cycles
    cycles.max_bounces = cycles.transmission_bounces = cycles.glossy_bounces = 6
    pane = bs.material("Glass", (1.0, 1.0, 1.0), "ShaderNodeBsdfGlass", Roughness=0.0, IOR=1.5)
    bs.add("Pane", bs.cube("Pane", pane), (0.0, -1.0, 0.6), (0.3, 0.0, 0.0), (1.3, 1.0, 0.25))
    return ['objects["Pane"].scale[2]'], [0.2]


def texture(size: int) -> tuple[Sequence[str], Any]:
    """The pixels of the floor's 8-bit image, which becomes grey."""
    _textured_floor(size, 48, codes=True)
    bs.camera((4.5, -3.5, 3.2), (1.0, 0.0, 0.9), "Side")
    pixels = np.array(bpy.data.images["Waves"].pixels, np.float64).reshape(-1, 4)[:, :3]
    return ["Waves"], (0.5 - pixels).ravel()


CASES = {
    "bones": Case("rotations of eight bones of a chain", bones, 100, ("Camera", "Front")),
    "face": Case("three shape keys", face, 60),
    "room": Case("place, rotation and focal length of a camera", room, 150),
    "sun": Case("direction of the sun from a shadow, turbidity of the sky from its light", sun, 30),
    "cage": Case("eight vertices under a Subdivision modifier", cage, 100, ("Camera", "Side")),
    "nodes": Case("an input of geometry nodes, and a colour", nodes, 100),
    "exr": Case("the same from an EXR by Cycles' defaults, of unknown exposure", nodes, 100,
                options=("--exposure", "fit"), saved="exr"),
    "agx": Case("the same render as an 8-bit AgX PNG", nodes, 100, options=("--exposure", "fit"), saved="agx"),
    "texture": Case("48 x 48 pixels of an 8-bit image on a floor, from two cameras", texture, 100, ("Camera", "Side")),
    "glass": Case("thickness of a pane of glass from its refraction", glass, 60),
}
