"""Opaque dielectrics: the Principled BSDF's specular layer and its coat."""

from __future__ import annotations

from . import stage
from .case import case

RED = (0.6, 0.1, 0.1)


@case("Principled dielectric: specular level and tint, IOR, roughness")
def specular() -> None:
    """Front row: specular level; back row: IOR, tint, roughness."""
    stage.studio()
    stage.row([stage.principled(f"Level {level}", RED, Roughness=0.2, Specular_IOR_Level=level)
               for level in (0.0, 0.25, 0.5, 0.75, 1.0)], y=-0.8)  # fmt: skip
    stage.row([
        stage.principled("IOR 1.2", RED, Roughness=0.3, IOR=1.2),
        stage.principled("IOR 2.0", RED, Roughness=0.3, IOR=2.0),
        stage.principled("Tint", RED, Roughness=0.1, Specular_Tint=(0.2, 0.9, 0.3)),
        stage.principled("Smooth", RED, Roughness=0.0),
        stage.principled("Rough", RED, Roughness=1.0),
    ], y=0.8)  # fmt: skip


@case("Principled coat: weight, roughness, IOR, tint, over a diffuse base and a metal")
def coat() -> None:
    """Front row: weight and roughness; back row: IOR, tint and a metal below."""
    stage.studio()
    stage.row([stage.principled(f"Coat {w} {r}", RED, Roughness=0.6, Coat_Weight=w, Coat_Roughness=r)
               for w, r in ((0.25, 0.03), (0.5, 0.03), (1.0, 0.03), (1.0, 0.2), (1.0, 0.6))], y=-0.8)  # fmt: skip
    stage.row([
        stage.principled("Coat IOR", RED, Roughness=0.6, Coat_Weight=1.0, Coat_IOR=2.0),
        stage.principled("Coat tint", (0.8, 0.8, 0.8), Roughness=0.6, Coat_Weight=1.0, Coat_Tint=(0.9, 0.5, 0.1)),
        stage.principled("Half tint", (0.8, 0.8, 0.8), Roughness=0.6, Coat_Weight=0.5, Coat_Tint=(0.1, 0.5, 0.9)),
        stage.principled("Over metal", (0.9, 0.65, 0.25), Metallic=1.0, Roughness=0.4, Coat_Weight=1.0),
        stage.simple("Over light", "ShaderNodeBsdfPrincipled", {
            "Base Color": RED, "Coat Weight": 1.0, "Coat Tint": (0.3, 0.6, 0.9), "Emission Color": (1.0, 0.6, 0.3),
            "Emission Strength": 0.8}),
    ], y=0.8)  # fmt: skip
