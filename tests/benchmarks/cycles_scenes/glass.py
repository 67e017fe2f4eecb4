"""Transmission: Glass and Refraction nodes, the Principled BSDF's transmission."""

from __future__ import annotations

from . import stage
from .case import case


@case("Smooth glass: Glass node, Principled transmission, IOR, colour", bounces=8, samples=72)
def glass() -> None:
    """Solid balls, a pane and a cube."""
    stage.studio()
    stage.row([
        stage.simple("Glass", "ShaderNodeBsdfGlass", {"IOR": 1.45, "Roughness": 0.0}),
        stage.simple("Green glass", "ShaderNodeBsdfGlass", {"Color": (0.5, 0.9, 0.6), "IOR": 1.6, "Roughness": 0.0}),
        stage.principled("Principled glass", (1, 1, 1), Transmission_Weight=1.0, Roughness=0.0),
        stage.principled("Tinted glass", (0.9, 0.6, 0.4), Transmission_Weight=1.0, Roughness=0.0, IOR=1.33),
        stage.principled("Half glass", (0.4, 0.6, 0.9), Transmission_Weight=0.5, Roughness=0.0),
    ], y=-0.8)  # fmt: skip
    clear = stage.simple("Clear", "ShaderNodeBsdfGlass", {"IOR": 1.5, "Roughness": 0.0})
    stage.add("Block", stage.cube("Block", clear, size=1.0), (-1.6, 0.9, 0.55), (0, 0, 0.5))
    stage.add("Red", stage.cube("Red", stage.diffuse("Red", (0.8, 0.1, 0.1)), size=1.0), (0.2, 1.4, 0.5))
    stage.add("Pane", stage.plane("Pane", clear, size=1.5), (1.8, 0.9, 0.7), (1.4, 0, 0.2))


@case("Rough glass: Glass, Refraction and Principled, roughness 0.1 to 0.8", bounces=8, samples=72, differs=(
    "Cycles adds light that microfacets facing away from the viewer refract, which it never samples; it matters above "
    "a roughness of 0.6, which the export says",))
def rough_glass() -> None:
    """Front row: Glass nodes and Principled; back row: Refraction and grey glass."""
    stage.studio()
    stage.row([stage.simple(f"Glass {r}", "ShaderNodeBsdfGlass", {"IOR": 1.45, "Roughness": r},
                            distribution="MULTI_GGX")
               for r in (0.1, 0.3, 0.8)]
              + [stage.principled(f"Principled {r}", (0.9, 0.95, 1.0), Transmission_Weight=1.0, Roughness=r)
                 for r in (0.2, 0.5)], y=-0.8)  # fmt: skip
    stage.row([
        stage.simple("GGX", "ShaderNodeBsdfGlass", {"Color": (0.9, 0.8, 0.6), "IOR": 1.5, "Roughness": 0.4},
                     distribution="GGX"),
        stage.simple("Refraction", "ShaderNodeBsdfRefraction", {"IOR": 1.3, "Roughness": 0.2}, distribution="GGX"),
        stage.principled("Half", (0.3, 0.5, 0.9), Transmission_Weight=0.5, Roughness=0.3),
    ], y=0.8)  # fmt: skip
