"""Materials of every kind, with every field at the ends of its range, textured or not, and mixtures."""

from __future__ import annotations

from typing import Any

import numpy as np

from edgegrad import Material, Mixture
from edgegrad import expression as e
from edgegrad.scene.material import KINDS, TEXTURED
from tests.torture.drawing.draw import Draw
from tests.torture.drawing.textures import LAYERS, expression

COLORS = ("base_color", "specular_tint", "coat_tint", "sheen_tint")
SHARES = ("metallic", "roughness", "diffuse_roughness", "transmission", "coat_weight", "coat_roughness",
          "sheen_weight", "sheen_roughness", "alpha", "subsurface_weight")  # fmt: skip
IORS = (1.0, 1.0 + 1e-6, 1.33, 1.5, 2.4, 0.7, 0.1, 20.0)


def material(draw: Draw) -> Material:
    """Any material; each field is drawn whether its kind reads it or not."""
    made: dict[str, Any] = {"kind": draw.one(KINDS), "emission": emission(draw) if draw.chance(0.2) else np.zeros(3)}
    # A material with every lobe is rare in a scene; most fields keep their defaults.
    some = draw.one((0.15, 0.5, 1.0))
    made |= {name: draw.color() for name in COLORS if draw.chance(some)}
    made |= {name: draw.share() for name in SHARES if draw.chance(some)}
    if draw.chance(some):
        made |= {"ior": draw.one(IORS), "coat_ior": draw.one((1.0, 1.5, 4.0))}
    if draw.chance(0.3 * some):
        made |= {"anisotropy": draw.one((-1.0, -0.5, 1e-6, 0.5, 1.0)), "anisotropy_rotation": draw.uniform(-2.0, 2.0)}
    made |= {
        "specular_ior_level": draw.one((0.0, 0.5, 1.0, 4.0)), "multiscatter": draw.chance(0.5),
        "emission_two_sided": draw.chance(0.5), "normal_strength": draw.one((0.0, 1.0, 0.3, 5.0)),
        "normal_uv": draw.one(("UVMap", "UVMap", "absent")),
        "textures": _textures(draw) if draw.chance(0.4) else {},
    }  # fmt: skip
    if draw.chance(0.2):
        made |= {"thin_film_thickness": draw.one((0.05, 0.2, 1.0, 300.0, 2e4)), "thin_film_ior": draw.one(IORS)}
    if draw.chance(0.15):
        made["absorption"] = draw.log(1e-3, 1e3) / draw.scale * draw.color()
    if draw.chance(0.3):
        made["distribution"] = "ASHIKHMIN_SHIRLEY" if made["kind"] == "GLOSSY" and draw.chance(0.5) else "BECKMANN"
    return Material(**made)


def emission(draw: Draw) -> np.ndarray:
    return draw.log(1e-6, 1e6) * draw.color()


def _textures(draw: Draw) -> dict[str, e.Expression]:
    found = {draw.one(TEXTURED): expression(draw, draw.whole(1, 3)) for _ in range(draw.whole(1, 3))}
    if draw.chance(0.2):
        found["normal"] = e.ImageTexture("colors", e.Attribute("UVMap", required=False))
    return found


def materials(draw: Draw) -> dict[str, Material | Mixture]:
    """Materials of a scene, mixtures among them."""
    out: dict[str, Material | Mixture] = {f"m{k}": material(draw) for k in range(draw.whole(1, 3))}
    names = tuple(out)
    if draw.chance(0.25):
        count = draw.whole(1, 4)
        parts = tuple(draw.one(names) for _ in range(count))
        textures: dict[str, e.Expression] = {}
        if draw.chance(0.4):
            textures = {str(draw.whole(0, count - 1)): e.Attribute(draw.one(tuple(LAYERS)), required=False)}
        out["mix"] = Mixture(parts, np.array([draw.share() for _ in range(count)]), textures)
    return out
