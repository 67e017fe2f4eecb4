"""Metals: roughness, anisotropy, the tint at grazing angles."""

from __future__ import annotations

from . import stage
from .case import case

GOLD = (0.9, 0.65, 0.25)


@case("Metallic Principled and Glossy BSDF: roughness, F82 tint, partly metallic")
def metals() -> None:
    """Front row: Principled; back row: Glossy nodes and tinted edges."""
    stage.studio()
    stage.row([stage.principled(f"Gold {r}", GOLD, Metallic=1.0, Roughness=r) for r in (0.05, 0.2, 0.5, 1.0)]
              + [stage.principled("Half metal", GOLD, Metallic=0.5, Roughness=0.3)], y=-0.8)  # fmt: skip
    stage.row([
        stage.simple("Mirror", "ShaderNodeBsdfGlossy", {"Color": (0.8, 0.8, 0.8), "Roughness": 0.0},
                     distribution="GGX"),
        stage.simple("GGX", "ShaderNodeBsdfGlossy", {"Color": (0.8, 0.3, 0.3), "Roughness": 0.4}, distribution="GGX"),
        stage.simple("Multiscatter", "ShaderNodeBsdfGlossy", {"Color": (0.8, 0.3, 0.3), "Roughness": 0.8},
                     distribution="MULTI_GGX"),
        stage.principled("Tinted edge", (0.7, 0.7, 0.7), Metallic=1.0, Roughness=0.3, Specular_Tint=(0.2, 0.5, 1.0)),
        stage.principled("Red edge", GOLD, Metallic=1.0, Roughness=0.1, Specular_Tint=(1.0, 0.1, 0.1)),
    ], y=0.8)  # fmt: skip


@case("Anisotropic metals: strength, rotation, tangent of a UV map")
def anisotropy() -> None:
    """Front row: around the object's axis; back row: Glossy nodes, and along a UV map."""
    stage.studio()
    stage.row([stage.principled(f"Brushed {a} {r}", (0.8, 0.8, 0.8), Metallic=1.0, Roughness=0.35, Anisotropic=a,
                                Anisotropic_Rotation=r)
               for a, r in ((0.0, 0.0), (0.5, 0.0), (0.9, 0.0), (0.9, 0.125), (0.9, 0.25))], y=-0.8)  # fmt: skip

    def along_uv(tree: object) -> object:
        tangent = stage.node(tree, "ShaderNodeTangent", direction_type="UV_MAP", uv_map="UVMap")
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {
            "Base Color": GOLD, "Metallic": 1.0, "Roughness": 0.35, "Anisotropic": 0.9, "Tangent": tangent,
        })  # fmt: skip

    stage.row([
        stage.simple("Glossy along", "ShaderNodeBsdfGlossy",
                     {"Color": (0.8, 0.8, 0.8), "Roughness": 0.35, "Anisotropy": 0.8}, distribution="GGX"),
        stage.simple("Glossy across", "ShaderNodeBsdfGlossy",
                     {"Color": (0.8, 0.8, 0.8), "Roughness": 0.35, "Anisotropy": -0.8}, distribution="MULTI_GGX"),
        stage.material("Along the UV map", along_uv),
    ], y=0.8)  # fmt: skip
