"""Baking of worlds: Cycles renders the world to an equirectangular image, and the sun of a sky texture separately.

The sun is too small and too bright for an image of practical size. It becomes a sun light of the same irradiance.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

import edgegrad

from ...problem import Problem, Report
from ..bakes.bake import Temporary, temporary
from ..bakes.bake_scene import BakeScene, own_groups, show_to
from ..bakes.cache import keep, kept
from ..bakes.content import UnknownContent, content_of
from ..nodes.images import Images
from ..nodes.links import by_identifier, feed
from ..nodes.ray_kinds import LIGHT_PATHS
from .view_coordinates import pixels_per_texel, reads_camera, replace_coordinates, rotation_of
from .world import WorldReading

# Pixels along each side of the picture of the sun's disc, and size of this picture relative to the disc.
DISC_PIXELS = 64
AROUND_DISC = 1.25
SUN_NAME = "(sky) sun"
# Types of sky textures that have a sun.
WITH_SUN = ("NISHITA", "SINGLE_SCATTERING", "MULTIPLE_SCATTERING")

# Widths of the images by which a smooth world is recognised, and the largest difference of the larger one from the
# interpolated smaller one, relative to the pixel, or to the mean if that is larger. Between the pixels of the larger
# one, the difference is about half of that at kinks, such as that of a sky at its sun, and a quarter elsewhere.
COARSE, FINE, SMOOTH = 128, 256, 0.03

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class _Baked:
    """A baked world: its image, the suns of its skies as lights, and what has to be said about them."""

    picture: F32
    lights: dict[str, edgegrad.SunLight]
    warnings: tuple[str, ...] = ()

    def arrays(self) -> Iterable[F32]:
        """Return the pixels of the image."""
        return [self.picture]


def bake_world(world: WorldReading, images: Images, resolution: int, report: Report, view: edgegrad.Camera,
               suns: bool = True, widths: dict[str, int] | None = None) -> None:  # fmt: skip
    """Render the nodes of the world to an image; if `suns` is set, the sun of a sky texture becomes a light.

    Parameters
    ----------
    resolution
        Width of the image, unless the world is so smooth that fewer pixels give the same.
    view
        The camera, on which nodes may depend.
    widths
        Widths of the images of earlier exports by their names, which are kept; new ones are added.
    """
    name = world.world.name
    where = f"world '{name}'"
    if resolution <= 0:
        report.warn(where, "its nodes can't be read and are not baked; it is black")
        return
    image = f"{name} (baked)" if suns else f"{name} (baked for {world.seen_by} rays)"
    width = None if widths is None else widths.get(image)
    seen = view if reads_camera(world.world.node_tree) else None
    key = _key(world, seen, resolution, width, suns)
    # A fit exports the scene many times, and most of its properties leave the world as it is.
    baked = kept(key, _Baked)
    if baked is None:
        try:
            baked = _bake(world, seen, resolution, width, suns)
        except Problem:
            raise
        except (RuntimeError, OSError, ValueError) as error:
            report.warn(where, f"its nodes can be neither read nor baked ({str(error).strip()}); it is black")
            return
        keep(key, baked)
        if widths is not None and width is None:  # later exports ask for this width
            keep(_key(world, seen, resolution, baked.picture.shape[1], suns), baked)
    for sentence in baked.warnings:
        report.warn(where, sentence)
    lights = {light: replace(sun, visible_to=world.value.visible_to) for light, sun in baked.lights.items()}
    images.found[image] = edgegrad.Image(baked.picture)
    world.value.image, world.value.color = image, np.ones(3)
    if seen is not None:
        world.value.rotation = rotation_of(seen)
    world.suns |= lights
    height, width = baked.picture.shape[:2]
    if widths is not None:
        widths[image] = width
    if seen is not None and pixels_per_texel(seen, width) > 1.5:
        report.warn(where, "its nodes depend on the camera and are baked, which blurs them over about "
                    f"{pixels_per_texel(seen, width):.0f} pixels")  # fmt: skip
    report.tell(where, f"baked to an image of {width} x {height}"
                + (f", its sun exported as {len(lights)} light" if lights else ""))  # fmt: skip


def _key(world: WorldReading, seen: edgegrad.Camera | None, *settings: object) -> bytes | None:
    """Hash of all that decides a bake; None if something may change unnoticed."""
    try:
        content = content_of(world.world)
    except UnknownContent:
        return None
    camera = None if seen is None else (seen.to_world.tolist(), seen.kind, seen.focal, seen.shift.tolist(), seen.width,
                                        seen.height, seen.pixel_aspect, seen.fisheye_polynomial.tolist())  # fmt: skip
    rest = (content, world.seen_by, bpy.context.scene.frame_current_final, camera, *settings)
    return hashlib.sha256(repr(rest).encode()).digest()


def _bake(world: WorldReading, seen: edgegrad.Camera | None, resolution: int, width: int | None,
          suns: bool) -> _Baked:  # fmt: skip
    with temporary() as keep:
        baker = _WorldBaker(keep, world)
        warnings: list[str] = []
        if seen is not None:
            baker.pose = Matrix(seen.to_world.tolist())
            warnings += replace_coordinates(baker.world.node_tree, seen)
        found = [node for node in _skies(baker.world.node_tree) if node.sun_type in WITH_SUN] if suns else []
        if not all(sun.plain for sun in found):
            warnings.append("its sky is rotated by nodes, so the sun stays in the baked image")
            return _baked(baker.panorama(resolution), {}, warnings)
        for sun in found:
            sun.disc(False)
        picture = baker.smooth_panorama(resolution) if width is None else baker.panorama(width)
        lights: dict[str, edgegrad.SunLight] = {}
        for sun in found:
            light = baker.sun(sun)
            if light is not None:
                lights[SUN_NAME if not lights else f"{SUN_NAME} {len(lights) + 1}"] = light
        return _baked(picture, lights, warnings)


def _baked(picture: F32, lights: dict[str, edgegrad.SunLight], warnings: list[str]) -> _Baked:
    """A bake without negative light, which is told if it is more than rounding."""
    if picture.min(initial=0.0) < -1e-6 * picture.max(initial=0.0):
        warnings.append("negative light is treated as zero")
    return _Baked(np.maximum(picture, 0.0), lights, tuple(warnings))


def _is_smooth(coarse: F32, fine: F32) -> bool:
    """Whether the interpolation of an environment image gives one with twice as many pixels along each side."""
    wide = np.concatenate([coarse[:, -1:], coarse, coarse[:, :1]], axis=1)
    tall = np.concatenate([wide[:1], wide, wide[-1:]], axis=0)
    for axis in (0, 1):
        before, here, after = (np.take(tall, range(k, tall.shape[axis] - 2 + k), axis) for k in range(3))
        pair = np.stack([0.25 * before + 0.75 * here, 0.75 * here + 0.25 * after], axis=axis + 1)
        shape = list(here.shape)
        shape[axis] *= 2
        tall = pair.reshape(shape)
    size = np.maximum(np.abs(fine).max(axis=2), np.abs(fine).mean())
    return bool((np.abs(tall - fine).max(axis=2) <= SMOOTH * size).all())


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

    def smooth_panorama(self, width: int) -> F32:
        """Render the whole sphere, with fewer pixels than `width` if they give the same."""
        if width <= FINE:
            return self.panorama(width)
        coarse, fine = self.panorama(COARSE), self.panorama(FINE)
        return fine if _is_smooth(coarse, fine) else self.panorama(width)

    def sun(self, sky: _Sky) -> edgegrad.SunLight | None:
        """Make the sun light of a sky texture; its light is that with the disc minus that without it.

        A low sun is brighter on its upper side. Its light comes from its bright part, so that surfaces receive what
        they do in Cycles.
        """
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
        across, up = np.meshgrid(half * places, -half * places)
        rays = np.stack([across, up, -np.ones_like(up)], axis=-1)
        length = np.linalg.norm(rays, axis=-1, keepdims=True)
        solid = (2.0 * half / DISC_PIXELS) ** 2 / length**3
        # What a surface receives is the product of its normal and this vector, of each channel.
        vectors = np.einsum("hwc,hwk->ck", (pictures[1] - pictures[0]) * solid, rays / length)
        if not vectors.any():
            return None  # below the horizon
        axes = np.array(self.camera.rotation_euler.to_matrix(), np.float64)
        direction = axes @ vectors.sum(axis=0)
        direction /= np.linalg.norm(direction)
        irradiance = vectors @ axes.T @ direction
        strength = float(irradiance.max())
        return edgegrad.SunLight(-direction, strength, angle, color=np.maximum(irradiance, 0.0) / strength)
