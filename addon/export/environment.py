"""Baking of worlds: Cycles renders the world to an equirectangular image, and the sun of a sky texture separately.

The sun is too small and too bright for an image of practical size. It becomes a sun light of the same irradiance.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

import edgegrad
from edgegrad.images import read_image

from ..problem import Problem, Report
from .bake import Temporary, temporary
from .images import Images
from .nodes import by_identifier, feed, reached
from .ray_kinds import LIGHT_PATHS
from .world import WorldReading

SAMPLES = 16
# Pixels along each side of the picture of the sun's disc, and size of this picture relative to the disc.
DISC_PIXELS = 64
AROUND_DISC = 1.25
SUN_NAME = "(sky) sun"
# Types of sky textures that have a sun.
WITH_SUN = ("NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING")

F32 = NDArray[np.float32]


def bake_world(world: WorldReading, images: Images, resolution: int, report: Report) -> None:
    """Render the nodes of the world to an image; the sun of a sky texture becomes a light."""
    name = world.world.name
    where = f"world '{name}'"
    if resolution <= 0:
        report.warn(where, "its nodes can't be read and are not baked; it is black")
        return
    try:
        with temporary() as keep:
            baker = _WorldBaker(keep, world)
            suns = [node for node in _skies(baker.world.node_tree) if node.sun_type in WITH_SUN]
            for sun in suns:
                sun.disc(False)
            picture = baker.panorama(resolution)
            lights: dict[str, edgegrad.SunLight] = {}
            for sun in suns if all(sun.plain for sun in suns) else ():
                light = baker.sun(sun)
                if light is not None:
                    # Unlike other suns, the disc of a sky texture is visible to the camera.
                    light.visible_to = world.value.visible_to
                    lights[SUN_NAME if not lights else f"{SUN_NAME} {len(lights) + 1}"] = light
            if suns and not all(sun.plain for sun in suns):
                for sun in suns:
                    sun.disc(True)
                picture = baker.panorama(resolution)
                report.warn(where, "its sky is rotated by nodes, so the sun stays in the baked image")
    except Problem:
        raise
    except (RuntimeError, OSError, ValueError) as error:
        report.warn(where, f"its nodes can be neither read nor baked ({str(error).strip()}); it is black")
        return
    key = f"{name} (baked)"
    images.found[key] = edgegrad.Image(np.maximum(picture, 0.0))
    world.value.image, world.value.color = key, np.ones(3)
    world.suns |= lights
    report.tell(where, f"baked to an image of {resolution} x {resolution // 2}"
                + (f", its sun exported as {len(lights)} light" if lights else ""))  # fmt: skip


class _Sky:
    """A Sky Texture with a sun."""

    def __init__(self, node: Any, outermost: bool) -> None:
        self.node = node
        self.sun_type = node.sky_type if node.sun_disc else ""
        # If nodes transform the direction of the ray, the direction of the sun is unknown.
        vector = by_identifier(node.inputs, "Vector")
        self.plain = outermost and (vector is None or not vector.enabled or feed(vector).output is None)

    def disc(self, shown: bool) -> None:
        """Show or hide the disc of the sun."""
        self.node.sun_disc = shown


def _skies(tree: Any, outermost: bool = True) -> Iterator[_Sky]:
    for node in tree.nodes:
        if node.type == "TEX_SKY" and not node.mute:
            yield _Sky(node, outermost)
        elif node.type == "GROUP" and node.node_tree is not None:
            yield from _skies(node.node_tree, outermost=False)


class _WorldBaker:
    """An empty scene with a copy of a world and a camera."""

    def __init__(self, keep: Temporary, world: WorldReading) -> None:
        scene = self._scene = keep(bpy.data.scenes.new("Edgegrad bake"))
        self._name = world.world.name
        self.world = keep(world.world.copy())
        _own_groups(self.world.node_tree, keep)
        _show_to(self.world.node_tree, LIGHT_PATHS[world.seen_by])
        scene.world = self.world
        scene.render.engine = "CYCLES"
        scene.render.resolution_percentage = 100
        scene.render.use_compositing = scene.render.use_sequencer = False
        cycles = scene.cycles
        cycles.device, cycles.samples, cycles.pixel_filter_type = "CPU", SAMPLES, "BOX"
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        settings = scene.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
        # Blender creates this image at the first render.
        if "Render Result" not in bpy.data.images:
            keep.later(lambda: bpy.data.images.get("Render Result"))
        self._lens = keep(bpy.data.cameras.new("Edgegrad bake"))
        self._camera = keep(bpy.data.objects.new("Edgegrad bake", self._lens))
        scene.collection.objects.link(self._camera)
        scene.camera = self._camera
        visibility = getattr(self.world, "cycles_visibility", None)
        if visibility is not None:
            visibility.camera = True

    def panorama(self, resolution: int) -> F32:
        """Render the whole sphere to (resolution / 2, resolution, 3), with +X in the middle."""
        self._lens.type = "PANO"
        panorama = self._lens if hasattr(self._lens, "panorama_type") else self._lens.cycles
        panorama.panorama_type = "EQUIRECTANGULAR"
        self._camera.rotation_euler = (0.5 * np.pi, 0.0, -0.5 * np.pi)
        return self._render(resolution, resolution // 2)

    def sun(self, sky: _Sky) -> edgegrad.SunLight | None:
        """Make the sun light of a sky texture; its irradiance is that with the disc minus that without it."""
        node = sky.node
        angle = float(node.sun_size)
        elevation, turn = float(node.sun_elevation), float(node.sun_rotation)
        # Rotation 0 is +Y; the sun rotates clockwise, seen from above.
        to_sun = np.array([np.sin(turn) * np.cos(elevation), np.cos(turn) * np.cos(elevation), np.sin(elevation)])
        self._lens.type = "PERSP"
        self._lens.sensor_fit, self._lens.sensor_width, self._lens.lens_unit = "HORIZONTAL", 36.0, "MILLIMETERS"
        half = np.tan(0.5 * AROUND_DISC * angle)
        self._lens.lens = min(18.0 / half, 1e5)
        self._camera.rotation_euler = Vector(-to_sun).to_track_quat("Z", "Y").to_euler()
        pictures = []
        for shown in (False, True):
            sky.disc(shown)
            pictures.append(self._render(DISC_PIXELS, DISC_PIXELS).astype(np.float64))
        sky.disc(False)
        places = (np.arange(DISC_PIXELS) + 0.5) / DISC_PIXELS * 2.0 - 1.0
        r2 = (half * places[:, None]) ** 2 + (half * places[None]) ** 2
        solid = (2.0 * half / DISC_PIXELS) ** 2 / (1.0 + r2) ** 1.5
        irradiance = ((pictures[1] - pictures[0]) * (solid / np.sqrt(1.0 + r2))[..., None]).sum(axis=(0, 1))
        strength = float(irradiance.max())
        if not strength > 0.0:
            return None  # below the horizon
        return edgegrad.SunLight(-to_sun, strength, angle, color=np.maximum(irradiance, 0.0) / strength)

    def _render(self, width: int, height: int) -> F32:
        render = self._scene.render
        render.resolution_x, render.resolution_y = width, height
        try:
            with tempfile.TemporaryDirectory() as folder:
                render.filepath = str(Path(folder) / "world.exr")
                bpy.ops.render.render(write_still=True, scene=self._scene.name)
                return np.asarray(read_image(render.filepath)[..., :3], np.float32)
        except (OSError, ValueError) as error:
            # This is an error of the disk, not of the world: a fit with a black world instead would be useless.
            raise Problem(f"world '{self._name}': its picture can't be kept in the temporary folder "
                          f"'{tempfile.gettempdir()}' ({error}); make space, or set TMPDIR") from None  # fmt: skip


def _show_to(tree: Any, path: Mapping[str, float]) -> None:
    """Replace the outputs of Light Path nodes by constants, since only camera rays render the world."""
    for node in [node for node in reached(tree) if node.type == "LIGHT_PATH"]:
        inside = node.id_data
        for output in node.outputs:
            targets = [link.to_socket for link in output.links]
            if targets:
                value = inside.nodes.new("ShaderNodeValue")
                value.outputs[0].default_value = path.get(output.identifier, 0.0)
                for socket in targets:
                    inside.links.new(value.outputs[0], socket)


def _own_groups(tree: Any, keep: Temporary) -> None:
    """Replace the groups of a tree by copies, so that their nodes can be changed."""
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree is not None:
            node.node_tree = keep(node.node_tree.copy())
            _own_groups(node.node_tree, keep)
