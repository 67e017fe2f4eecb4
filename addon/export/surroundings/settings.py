"""Light path limits and film exposure from Blender's render settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import expression as e
from edgegrad.scene.placement import placed_meshes

from ...preferences import threads
from ...problem import Report

# Cycles counts scattering events between surfaces. A path has two more segments: to the camera and to the light.
SEGMENTS_AROUND_BOUNCES = 2


@dataclass(frozen=True)
class RenderSettings:
    """Limits of light paths, and the film exposure.

    Attributes
    ----------
    max_depth
        Largest number of path segments (`edgegrad.render`).
    bounces
        Bounce limits by kind of scattering event, and Filter Glossy.
    exposure
        Factor of the picture (Blender's film exposure), by which all light of the exported scene is multiplied.
    reflective_caustics, refractive_caustics
        Cycles' switches of caustics, which the exported materials contain.
    """

    max_depth: int = 2
    bounces: edgegrad.Bounces = field(default_factory=edgegrad.Bounces)
    exposure: float = 1.0
    reflective_caustics: bool = True
    refractive_caustics: bool = True


def render_export(scene: edgegrad.Scene, settings: RenderSettings, samples: int, seed: int = 0,
                  progress: Callable[[float], None] | None = None) -> NDArray[np.float32]:  # fmt: skip
    """Render an exported scene with its light path limits.

    Returns
    -------
    (H, W, 3) float32, as from `edgegrad.render`.
    """
    renderer = edgegrad.Renderer(scene, threads=threads())
    return renderer.render(spp=samples, seed=seed, max_depth=settings.max_depth, bounces=settings.bounces,
                           progress=progress)  # fmt: skip


def read_settings(scene: Any) -> RenderSettings:
    """Read the render settings of Blender's scene; Blender's defaults if it has no settings of Cycles."""
    cycles = getattr(scene, "cycles", None)

    def limit(name: str, default: int) -> int:
        return min(int(getattr(cycles, name, default)), 255)

    return RenderSettings(
        max_depth=limit("max_bounces", 12) + SEGMENTS_AROUND_BOUNCES,
        bounces=edgegrad.Bounces(
            diffuse=limit("diffuse_bounces", 4),
            glossy=limit("glossy_bounces", 4),
            transmission=limit("transmission_bounces", 12),
            transparent=max(limit("transparent_max_bounces", 8), 1),  # Cycles' paths always pass one surface
            medium=limit("volume_bounces", 0),
            ambient=_ambient_limit(cycles),
            filter_glossy=max(float(getattr(cycles, "blur_glossy", 1.0)), 0.0),
        ),
        exposure=max(float(getattr(cycles, "film_exposure", 1.0)), 0.0),
        reflective_caustics=bool(getattr(cycles, "caustics_reflective", True)),
        refractive_caustics=bool(getattr(cycles, "caustics_refractive", True)),
    )


def _ambient_limit(cycles: Any) -> int:
    """Number of bounces after which Fast GI Approximation replaces indirect light by that of the world."""
    if not getattr(cycles, "use_fast_gi", False) or cycles.fast_gi_method != "REPLACE":
        return edgegrad.Bounces().ambient
    return int(cycles.ao_bounces_render) or edgegrad.Bounces().ambient


def name_fast_gi(blender: Any, scene: edgegrad.Scene, report: Report) -> None:
    """Warn of what is not read of Fast GI Approximation: Blender's scene, and the exported one."""
    cycles, world = getattr(blender, "cycles", None), blender.world
    if cycles is None or not getattr(cycles, "use_fast_gi", False):
        return
    where = f"scene '{blender.name}'"
    if cycles.fast_gi_method != "REPLACE":
        report.warn(where, "indirect light is computed; fast global illumination with the method Add, which "
                           "approximates it, is not used")  # fmt: skip
    elif world is not None and cycles.ao_bounces_render:
        corners = [placed.vertices for placed in placed_meshes(scene) if len(placed.vertices)]
        size = np.linalg.norm(np.ptp(np.concatenate(corners), axis=0)) if corners else 0.0
        settings = world.light_settings
        if settings.ao_factor != 1.0:
            report.warn(where, "fast global illumination takes all light of the world, not its part "
                               f"{settings.ao_factor:g}")  # fmt: skip
        if settings.distance < size:
            report.warn(where, "fast global illumination finds surfaces at any distance; Cycles finds none beyond "
                               f"{settings.distance:g} m")  # fmt: skip


def expose(scene: edgegrad.Scene, exposure: float) -> None:
    """Multiply all light of a scene by the film exposure, which multiplies its picture."""
    if exposure == 1.0:
        return
    scene.world.strength *= exposure
    for light in scene.lights.values():
        if isinstance(light, edgegrad.SunLight):
            light.strength *= exposure
        else:
            light.power *= exposure
    for material in scene.materials.values():
        if isinstance(material, edgegrad.Material):
            material.emission = material.emission * exposure
            emitted = material.textures.get("emission")
            if emitted is not None:
                brighter = e.VectorMath("MULTIPLY", emitted, (exposure,) * 3)
                material.textures = {**material.textures, "emission": brighter}
