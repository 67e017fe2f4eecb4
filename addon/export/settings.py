"""Light path limits from Blender's render settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..problem import Report

# Cycles counts scattering events between surfaces. A path has two more segments: to the camera and to the light.
SEGMENTS_AROUND_BOUNCES = 2


@dataclass(frozen=True)
class RenderSettings:
    """Limits of light paths.

    Attributes
    ----------
    max_depth
        Largest number of path segments (`edgegrad.render`).
    bounces
        Bounce limits by kind of scattering event.
    clamp_direct, clamp_indirect
        Cycles' limits of the brightness of a sample; 0: none. Edgegrad does not clamp, since that makes pictures too
        dark.
    """

    max_depth: int = 2
    bounces: edgegrad.Bounces = field(default_factory=edgegrad.Bounces)
    clamp_direct: float = 0.0
    clamp_indirect: float = 0.0


def render_export(scene: edgegrad.Scene, settings: RenderSettings, samples: int, seed: int = 0,
                  progress: Callable[[float], None] | None = None) -> NDArray[np.float32]:  # fmt: skip
    """Render an exported scene with its light path limits.

    Returns
    -------
    (H, W, 3) float32, as from `edgegrad.render`.
    """
    return edgegrad.Renderer(scene).render(spp=samples, seed=seed, max_depth=settings.max_depth,
                                           bounces=settings.bounces, progress=progress)  # fmt: skip


def read_settings(scene: Any, report: Report) -> RenderSettings:
    """Read the light path limits of Blender's scene; Blender's defaults if it has no settings of Cycles."""
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
            report.tell(f"scene '{scene.name}'", f"{kind} light is not clamped; Cycles clamps it to {value:g}")
    return settings
