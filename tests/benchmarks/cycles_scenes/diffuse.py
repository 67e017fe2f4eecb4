"""Diffuse reflection: Lambert and Oren-Nayar."""

from __future__ import annotations

from . import stage
from .case import case

ROUGHNESSES = (0.0, 0.25, 0.5, 0.75, 1.0)


@case("Diffuse BSDF and Principled's diffuse roughness, 0 to 1")
def diffuse() -> None:
    """Front row: Diffuse nodes; back row: Principled without specular."""
    stage.studio()
    stage.row([stage.simple(f"Diffuse {r}", "ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.5, 0.3), "Roughness": r})
               for r in ROUGHNESSES], y=-0.8)  # fmt: skip
    stage.row([stage.principled(f"Principled {r}", (0.3, 0.6, 0.8), Specular_IOR_Level=0.0, Diffuse_Roughness=r)
               for r in ROUGHNESSES], y=0.8)  # fmt: skip
