"""Estimated effect of what the export warns about: how much of the picture an object, material or light concerns.

Objects and materials: the share of the picture's pixels in which they are the first surface. Lights and worlds: the
share of the picture's light that is missing without them. Both are measured in small pictures of the exported scene.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.engine import engine_class

from .exported import Export
from .surroundings.settings import SEGMENTS_AROUND_BOUNCES

# Larger pictures and more samples cost more and are more precise; an estimate to a percent suffices.
PIXELS = 4096
LIGHT_PIXELS, LIGHT_SAMPLES, LIGHT_DEPTH = 768, 8, 4
# Share of the light below which a difference of the whole picture is not named.
LEAST_SHARE = 1e-3
# With more faces, building the BVH would take too long for a sentence in a warning.
MOST_FACES = 500_000
# Surfaces are told apart by two channels of their colour, relative to the third.
CODES = 1000


def append_effects(out: Export) -> None:
    """Append the estimated effect to each warning about an object, material, light or world that is exported."""
    subjects = set(out.report.subjects())
    if not subjects or not _is_measured(out):
        return
    effects: dict[tuple[str, str], str] = {}
    if any(kind in ("object", "material") for kind, _ in subjects):
        effects |= {subject: f"{_percent(share)} of the picture's pixels"
                    for subject, share in first_surfaces(out, subjects).items()}  # fmt: skip
    lit = [subject for subject in subjects if subject[0] in ("light", "world") and _paths(out, subject)]
    black = {subject for subject in lit if subject[0] == "light" and all(map(_is_black, _lights(out, subject[1])))}
    effects |= dict.fromkeys(black, "it is black here, so its part of the picture's light is unknown")
    lit = [subject for subject in lit if subject not in black]
    effects |= {subject: f"{_percent(share)} of the picture's light"
                for subject, share in _shares_of_light(out, lit).items()}  # fmt: skip
    out.report.append(effects)


def name_transparent_limit(scene: Any, out: Export) -> None:
    """Warn if light passes as many transparent surfaces as the limit allows, and reaches another surface.

    Cycles ends such paths there, and lights do not light that surface. The light of paths with so many passages is
    measured by the picture with a limit that is lower by one.
    """
    limit = out.settings.bounces.transparent
    clear = any(isinstance(one, edgegrad.Material) and (one.kind == "TRANSPARENT" or one.alpha < 1.0
                                                         or "alpha" in one.textures)
                for one in out.scene.materials.values())  # fmt: skip
    if not clear or not _is_measured(out):
        return
    depth = min(out.settings.max_depth, LIGHT_DEPTH)
    light, fewer = _light(out, out.scene.world, [(depth, replace(out.settings.bounces, transparent=most))
                                                 for most in (limit, max(limit - 1, 0))])  # fmt: skip
    share = abs(light - fewer) / light if light > 0.0 else 0.0
    if share > LEAST_SHARE:
        out.report.warn(f"scene '{scene.name}'", f"paths that pass {limit} transparent surfaces see the next surface, "
                        f"of which Cycles shows only the emission ({_percent(share)} of the picture's light); raise "
                        "the limit of transparent bounces")  # fmt: skip


def name_world_limit(scene: Any, limit: int, out: Export) -> None:
    """Warn if the world lights surfaces after more bounces than its limit, which is not read.

    The light after more bounces is the change of the world's light by the depth of paths.
    """
    depth, lower = out.settings.max_depth, limit + SEGMENTS_AROUND_BOUNCES
    if lower >= depth or not out.scene.world.color.any():
        return
    size = "of unknown size"
    if _is_measured(out):
        dark = replace(out.scene.world, color=np.zeros(3))
        both = [(most, out.settings.bounces) for most in (depth, lower)]
        (full, few), (others, few_others) = (_light(out, world, both) for world in (out.scene.world, dark))
        share = ((full - others) - (few - few_others)) / full if full > 0.0 else 0.0
        if share < LEAST_SHARE:
            return
        size = f"at most {_percent(share)} of the picture's light"
    out.report.warn(f"scene '{scene.name}'", "its world lights paths of any number of bounces; Cycles samples its "
                    f"light only up to {limit} ({size})")  # fmt: skip


def change_by_media(out: Export, names: Collection[str]) -> str:
    """How much of the picture's light changes if meshes hold no media: the mean change of parts of the picture."""
    if not _is_measured(out):
        return "of unknown size"
    keys = {key for name in names for slot in out.scene.meshes[name].used_materials for key in _parts(out.scene, slot)}
    hollow = {key: replace(one, medium=None) if key in keys and isinstance(one, edgegrad.Material) else one
              for key, one in out.scene.materials.items()}  # fmt: skip
    scene = replace(out.scene, camera=_small(out.scene.camera, LIGHT_PIXELS))
    filled, empty = (_parts_of_picture(out, one) for one in (scene, replace(scene, materials=hollow)))
    light = max(float(filled.sum()), float(empty.sum()))
    return f"at most {_percent(float(np.abs(filled - empty).sum()) / light if light > 0.0 else 0.0)} of its light"


def _parts(scene: edgegrad.Scene, name: str) -> set[str]:
    """Names of a material and of the materials that it mixes."""
    parts = getattr(scene.materials[name], "parts", ())
    return {name}.union(*(_parts(scene, part) for part in parts))


def _parts_of_picture(out: Export, scene: edgegrad.Scene) -> NDArray[np.float64]:
    """Mean colours of 6 x 6 parts of a small picture."""
    depth = min(out.settings.max_depth, LIGHT_DEPTH)
    picture = edgegrad.Renderer(scene).render(spp=LIGHT_SAMPLES, max_depth=depth, bounces=out.settings.bounces)
    rows = (row for row in np.array_split(picture.astype(np.float64), 6) if row.size)
    parts = (part for row in rows for part in np.array_split(row, 6, axis=1) if part.size)
    return np.array([part.mean(axis=(0, 1)) * part.shape[0] * part.shape[1] for part in parts])


def _is_measured(out: Export) -> bool:
    """Whether small pictures of the exported scene are cheap."""
    faces = sum(len(mesh.faces) for mesh in out.scene.meshes.values())
    return faces <= MOST_FACES and not engine_class("auto").narrow


def _light(out: Export, world: edgegrad.World, limits: Sequence[tuple[int, edgegrad.Bounces]]) -> list[float]:
    """Means of small pictures of the exported scene with another world, one for each depth and limits of bounces."""
    scene = replace(out.scene, camera=_small(out.scene.camera, LIGHT_PIXELS), world=world)
    if not scene.lights and not scene.emitters and not world.color.any():
        return [0.0] * len(limits)
    renderer = edgegrad.Renderer(scene)
    return [float(renderer.render(spp=LIGHT_SAMPLES, max_depth=depth, bounces=bounces).mean(dtype=np.float64))
            for depth, bounces in limits]  # fmt: skip


def _percent(share: float) -> str:
    return f"{share:.0%}".replace("%", " %") if share >= 0.01 or share == 0.0 else "under 1 %"


def first_surfaces(out: Export, subjects: Collection[tuple[str, str]]) -> dict[tuple[str, str], float]:
    """Share of pixels in which each of these exported objects and materials is the first surface."""
    scene = out.scene
    about: list[set[tuple[str, str]]] = [set()]  # what each code stands for; the first one: nothing of interest
    meshes = {}
    for name, mesh in scene.meshes.items():
        objects = {("object", one) for one in out.meshes[name].objects}.intersection(subjects)
        found = [objects | _material(out, slot).intersection(subjects) for slot in mesh.materials]
        keys = tuple(str(len(about) + k) if one else "0" for k, one in enumerate(found))
        about += found
        meshes[name] = replace(mesh, materials=keys, smoothing=None, normals=None, attributes={})
    if len(meshes) == 0 or not any(about):
        return {}
    materials = {str(k): edgegrad.Material(np.array([k % CODES + 1, k // CODES + 1, CODES]) / CODES, kind="DIFFUSE")
                 for k, one in enumerate(about) if one or k == 0}  # fmt: skip
    camera = _small(scene.camera, PIXELS)
    # A lamp at the camera, whose light nothing blocks, lights each surface that the camera sees.
    position, view = camera.to_world[:3, 3], -camera.to_world[:3, 2]
    lamp = (edgegrad.SunLight(view, casts_shadow=False) if camera.kind == "ORTHOGRAPHIC"
            else edgegrad.PointLight(position, power=1e3, casts_shadow=False))  # fmt: skip
    picture = edgegrad.Renderer(edgegrad.Scene(camera, meshes, materials, {"lamp": lamp})).render(spp=1, max_depth=2)
    codes = picture.reshape(-1, 3).astype(np.float64)
    hit = codes[codes[:, 2] > 0.0]
    low, high = np.rint(CODES * hit[:, :2] / hit[:, 2:]).astype(int).T - 1
    counts: Counter[tuple[str, str]] = Counter()
    for code, count in zip(*np.unique(high * CODES + low, return_counts=True), strict=True):
        counts.update(dict.fromkeys(about[int(code)], int(count)))
    return {subject: counts[subject] / len(codes) for subject in set().union(*about)}


def _material(out: Export, slot: str) -> set[tuple[str, str]]:
    """Return the subject of a material of the exported scene, if it is one of Blender's."""
    reading = out.materials.get(slot)
    return set() if reading is None or reading.material is None else {("material", reading.material)}


def _shares_of_light(out: Export, subjects: list[tuple[str, str]]) -> dict[tuple[str, str], float]:
    """Share of the picture's light that is missing without each light or world."""
    if not subjects:
        return {}
    scene = replace(out.scene, camera=_small(out.scene.camera, LIGHT_PIXELS),
                    lights={name: replace(light) for name, light in out.scene.lights.items()},
                    world=replace(out.scene.world))  # fmt: skip
    renderer = edgegrad.Renderer(scene)

    def light() -> float:
        depth = min(out.settings.max_depth, LIGHT_DEPTH)
        picture = renderer.render(spp=LIGHT_SAMPLES, max_depth=depth, bounces=out.settings.bounces)
        return float(picture.mean(dtype=np.float64))

    whole = light()
    shares = {}
    for subject in subjects if whole > 0.0 else ():
        if subject[0] == "world" and not scene.lights and not scene.emitters:
            shares[subject] = 1.0
            continue
        paths = _paths(out, subject)
        parts = [scene.world if path == "world.color" else scene.lights[path.split(".", 1)[1].rpartition(".")[0]]
                 for path in paths]  # fmt: skip
        colors = [part.color for part in parts]
        for part in parts:
            part.color = np.zeros(3)
        renderer.update(paths)
        shares[subject] = min(max(1.0 - light() / whole, 0.0), 1.0)
        for part, color in zip(parts, colors, strict=True):
            part.color = color
        renderer.update(paths)
    return shares


def _paths(out: Export, subject: tuple[str, str]) -> list[str]:
    """Colours of the exported lights, or of the world, that a subject names."""
    kind, name = subject
    if kind == "world":
        return ["world.color"]
    return [f"lights.{key}.color" for key, source in out.lights.items() if source.object == name]


def _lights(out: Export, name: str) -> list[Any]:
    """The exported lights of Blender's light of a name."""
    return [out.scene.lights[key] for key, source in out.lights.items() if source.object == name]


def _is_black(light: Any) -> bool:
    """Whether a light gives nothing."""
    return not np.any(light.color) or (light.strength if isinstance(light, edgegrad.SunLight) else light.power) == 0.0


def _small(camera: edgegrad.Camera, pixels: int) -> edgegrad.Camera:
    """Return a pinhole camera of the same view with about this number of pixels."""
    height, width = camera.size
    factor = min(np.sqrt(pixels / (width * height)), 1.0)
    crop = camera.crop
    if crop is not None:
        x0, y0, x1, y1 = (round(c * factor) for c in crop)
        crop = (x0, y0, max(x1, x0 + 1), max(y1, y0 + 1))
    least = (1, 1) if crop is None else crop[2:]
    size = (max(round(side * factor), small) for side, small in zip((camera.width, camera.height), least, strict=True))
    out = replace(camera, crop=crop, aperture_radius=0.0, filter="BOX", filter_width=1.0)
    out.width, out.height = size
    return out
