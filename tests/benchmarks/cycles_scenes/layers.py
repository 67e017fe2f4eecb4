"""Sheen, translucency, transparency and subsurface scattering."""

from __future__ import annotations

from typing import Any

from . import stage
from .case import case

BLUE = (0.15, 0.25, 0.6)


@case("Principled sheen and Sheen BSDF: weight, roughness, tint")
def sheen() -> None:
    """Front row: Principled; back row: Sheen nodes."""
    stage.studio()
    stage.row([stage.principled(f"Sheen {w} {r}", BLUE, Roughness=0.8, Sheen_Weight=w, Sheen_Roughness=r)
               for w, r in ((0.5, 0.5), (1.0, 0.2), (1.0, 0.5), (1.0, 0.9))], y=-0.8)  # fmt: skip
    stage.row([
        stage.principled("Tinted sheen", BLUE, Sheen_Weight=1.0, Sheen_Tint=(1.0, 0.4, 0.2)),
        stage.simple("Sheen node", "ShaderNodeBsdfSheen", {"Color": (0.8, 0.8, 0.8), "Roughness": 0.5}),
        stage.simple("Smooth sheen node", "ShaderNodeBsdfSheen", {"Color": (0.8, 0.5, 0.3), "Roughness": 0.15}),
    ], y=0.8)  # fmt: skip


@case("Translucent, Transparent, and Principled alpha, with their shadows", bounces=4)
def transparency() -> None:
    """Leaves and panes one behind the other."""
    stage.studio()

    def leaf(tree: Any) -> Any:
        back = stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": (0.5, 0.8, 0.2)})
        front = stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.2, 0.5, 0.1)})
        return stage.node(tree, "ShaderNodeMixShader", {"Fac": 0.5, 1: front, 2: back})

    sheets = [
        stage.simple("Translucent", "ShaderNodeBsdfTranslucent", {"Color": (0.8, 0.6, 0.3)}),
        stage.material("Leaf", leaf),
        stage.simple("Coloured film", "ShaderNodeBsdfTransparent", {"Color": (0.9, 0.4, 0.3)}),
        stage.principled("Alpha 0.3", (0.2, 0.4, 0.8), Alpha=0.3),
        stage.principled("Alpha 0.8", (0.8, 0.2, 0.2), Alpha=0.8, Roughness=0.2),
    ]
    for k, one in enumerate(sheets):
        stage.add(one.name, stage.plane(one.name, one, size=1.1), (1.25 * (k - 2), -0.6, 0.6), (1.2, 0, 0.3))
        stage.add(
            f"{one.name} behind", stage.plane(one.name, one, size=0.9), (1.25 * (k - 2), 0.9, 0.9), (1.5, 0, -0.4)
        )
    stage.add("Ball", stage.sphere("Ball", stage.diffuse("Ball"), radius=0.4), (0.6, 0.3, 0.4))


@case("Principled subsurface", bounces=4)
def subsurface() -> None:
    """From a mean free path far below the object's size to one that shines through."""
    stage.studio()
    stage.row([stage.principled(f"Scale {s}", (0.8, 0.5, 0.4), Subsurface_Weight=1.0, Subsurface_Scale=s,
                                Specular_IOR_Level=0.0)
               for s in (0.001, 0.01, 0.05, 0.2)])  # fmt: skip
