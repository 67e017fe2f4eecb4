"""What Blender's render settings say about light paths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..problem import Report

# Cycles counts scatterings; a path has a segment more at either end, to the camera and to the light.
SEGMENTS_AROUND_BOUNCES = 2


@dataclass(frozen=True)
class RenderSettings:
    """Limits of light paths.

    Attributes
    ----------
    max_depth
        Path segments (`edgegrad.render`).
    bounces
        Most scatterings of each kind.
    clamp_direct, clamp_indirect
        Cycles' limits of a sample's brightness, 0: none. Pictures here aren't clamped, which would darken them.
    """

    max_depth: int = 2
    bounces: edgegrad.Bounces = field(default_factory=edgegrad.Bounces)
    clamp_direct: float = 0.0
    clamp_indirect: float = 0.0


def render_export(scene: edgegrad.Scene, settings: RenderSettings, samples: int, seed: int = 0,
                  progress: Callable[[float], None] | None = None) -> NDArray[np.float32]:  # fmt: skip
    """The picture of an exported scene, with the scene's limits of light paths.

    Returns (H, W, 3) float32 as `edgegrad.render`.
    """
    return edgegrad.Renderer(scene).render(spp=samples, seed=seed, max_depth=settings.max_depth,
                                           bounces=settings.bounces, progress=progress)  # fmt: skip


def read_settings(scene: Any, report: Report) -> RenderSettings:
    """Light path limits of Blender's scene; those of a scene without Cycles' settings are Blender's defaults."""
    cycles = getattr(scene, "cycles", None)

    def limit(name: str, default: int) -> int:
        return min(int(getattr(cycles, name, default)), 255)

    settings = RenderSettings(
        max_depth=limit("max_bounces", 12) + SEGMENTS_AROUND_BOUNCES,
        bounces=edgegrad.Bounces(
            diffuse=limit("diffuse_bounces", 4),
            glossy=limit("glossy_bounces", 4),
            transmission=limit("transmission_bounces", 12),
            transparent=limit("transparent_max_bounces", 8),
        ),
        clamp_direct=float(getattr(cycles, "sample_clamp_direct", 0.0)),
        clamp_indirect=float(getattr(cycles, "sample_clamp_indirect", 0.0)),
    )
    for kind, value in (("direct", settings.clamp_direct), ("indirect", settings.clamp_indirect)):
        if value > 0.0:
            report.tell(f"scene '{scene.name}'", f"{kind} light isn't clamped here; Cycles clamps it to {value:g}")
    return settings
