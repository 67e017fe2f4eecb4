"""Baking of worlds: Cycles renders the world to an equirectangular image, and the sun of a sky texture separately.

The sun is too small and too bright for an image of practical size. It becomes a sun light of the same irradiance.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

import edgegrad

from ...problem import Problem, Report
from ..bakes.bake import Temporary, temporary
from ..bakes.bake_scene import BakeScene, own_groups, show_to
from ..nodes.images import Images
from ..nodes.links import by_identifier, feed
from ..nodes.ray_kinds import LIGHT_PATHS
from .world import WorldReading

# Pixels along each side of the picture of the sun's disc, and size of this picture relative to the disc.
DISC_PIXELS = 64
AROUND_DISC = 1.25
SUN_NAME = "(sky) sun"
# Types of sky textures that have a sun.
WITH_SUN = ("NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING")

F32 = NDArray[np.float32]


def bake_world(world: WorldReading, images: Images, resolution: int, report: Report, suns: bool = True) -> None:
    """Render the nodes of the world to an image; if `suns` is set, the sun of a sky texture becomes a light."""
    name = world.world.name
    where = f"world '{name}'"
    if resolution <= 0:
        report.warn(where, "its nodes can't be read and are not baked; it is black")
        return
    try:
        with temporary() as keep:
            baker = _WorldBaker(keep, world)
            found = [node for node in _skies(baker.world.node_tree) if node.sun_type in WITH_SUN] if suns else []
            for sun in found:
                sun.disc(False)
            picture = baker.panorama(resolution)
            lights: dict[str, edgegrad.SunLight] = {}
            for sun in found if all(sun.plain for sun in found) else ():
                light = baker.sun(sun)
                if light is not None:
                    # Unlike other suns, the disc of a sky texture is visible to the camera.
                    light.visible_to = world.value.visible_to
                    lights[SUN_NAME if not lights else f"{SUN_NAME} {len(lights) + 1}"] = light
            if not all(sun.plain for sun in found):
                for sun in found:
                    sun.disc(True)
                picture = baker.panorama(resolution)
                report.warn(where, "its sky is rotated by nodes, so the sun stays in the baked image")
    except Problem:
        raise
    except (RuntimeError, OSError, ValueError) as error:
        report.warn(where, f"its nodes can be neither read nor baked ({str(error).strip()}); it is black")
        return
    key = f"{name} (baked)" if suns else f"{name} (baked for {world.seen_by} rays)"
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


class _WorldBaker(BakeScene):
    """An empty scene with a copy of a world and a camera."""

    def __init__(self, keep: Temporary, world: WorldReading) -> None:
        super().__init__(keep, f"world '{world.world.name}'")
        self.world = self.scene.world = keep(world.world.copy())
        own_groups(self.world.node_tree, keep)
        show_to(self.world.node_tree, LIGHT_PATHS[world.seen_by])
        visibility = getattr(self.world, "cycles_visibility", None)
        if visibility is not None:
            visibility.camera = True

    def sun(self, sky: _Sky) -> edgegrad.SunLight | None:
        """Make the sun light of a sky texture; its irradiance is that with the disc minus that without it."""
        node = sky.node
        angle = float(node.sun_size)
        elevation, turn = float(node.sun_elevation), float(node.sun_rotation)
        # Rotation 0 is +Y; the sun rotates clockwise, seen from above.
        to_sun = np.array([np.sin(turn) * np.cos(elevation), np.cos(turn) * np.cos(elevation), np.sin(elevation)])
        self.lens.type = "PERSP"
        self.lens.sensor_fit, self.lens.sensor_width, self.lens.lens_unit = "HORIZONTAL", 36.0, "MILLIMETERS"
        half = np.tan(0.5 * AROUND_DISC * angle)
        self.lens.lens = min(18.0 / half, 1e5)
        self.camera.rotation_euler = Vector(-to_sun).to_track_quat("Z", "Y").to_euler()
        pictures = []
        for shown in (False, True):
            sky.disc(shown)
            pictures.append(self.picture(DISC_PIXELS, DISC_PIXELS).astype(np.float64))
        sky.disc(False)
        places = (np.arange(DISC_PIXELS) + 0.5) / DISC_PIXELS * 2.0 - 1.0
        r2 = (half * places[:, None]) ** 2 + (half * places[None]) ** 2
        solid = (2.0 * half / DISC_PIXELS) ** 2 / (1.0 + r2) ** 1.5
        irradiance = ((pictures[1] - pictures[0]) * (solid / np.sqrt(1.0 + r2))[..., None]).sum(axis=(0, 1))
        strength = float(irradiance.max())
        if not strength > 0.0:
            return None  # below the horizon
        return edgegrad.SunLight(-to_sun, strength, angle, color=np.maximum(irradiance, 0.0) / strength)
