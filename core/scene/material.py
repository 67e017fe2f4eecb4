"""Surface materials: Blender's Principled BSDF, its simple shaders, and sums of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import array, choice, flag, mapping, names, number, shown, text
from .._fields import Check, Checked, by, near
from ..expression.nodes import Expression, nodes_of

# PRINCIPLED is Blender's Principled BSDF (4.2 to 5.2); the rest are the shader nodes of that name. DISNEY is
# the BSDF of Burley 2012 as Mitsuba 3's `principled` has it, for comparisons.
KINDS = ("PRINCIPLED", "DIFFUSE", "GLOSSY", "GLASS", "REFRACTION", "TRANSPARENT", "TRANSLUCENT", "SHEEN", "DISNEY")

_SHARES = ("metallic", "roughness", "diffuse_roughness", "transmission", "coat_weight", "coat_roughness",
           "sheen_weight", "sheen_roughness", "alpha", "subsurface_weight")


# Fields that `Material.textures` may replace.
TEXTURED = (
    "base_color", "emission", *_SHARES, "specular_ior_level", "specular_tint", "ior", "anisotropy",
    "anisotropy_rotation", "coat_ior", "coat_tint", "sheen_tint", "normal", "normal_strength",
)


def _rgb(value: float) -> NDArray[np.float64]:
    return np.full(3, value)


def _expression(where: str, name: str, value: Any) -> Expression:
    if not isinstance(value, Expression):
        raise ValueError(f"{where}: {name} must be an edgegrad.expression, not {shown(value)}")
    try:
        nodes_of(value)
    except ValueError as error:  # of nodes that depend on themselves
        raise ValueError(f"{where}: {name}: {error}") from None
    return value


def _color(where: str, name: str, value: Any) -> NDArray[np.float64]:
    out = array(where, name, value, (3,), np.float64, least=0.0)
    if out.max() > 1.0:
        raise ValueError(f"{where}: {name} must not be above 1, but contains {out.max():g}")
    return out


_tint: Check = by(array, (3,), np.float64, least=0.0)


@dataclass
class Material(Checked):
    """One shader. The defaults are a diffuse surface; it scatters on both sides.

    Attributes
    ----------
    base_color
        (3,) linear Rec.709, in [0, 1]: the colour of every kind.
    emission
        (3,) emitted radiance, W/(m² sr) per channel, >= 0, of any kind (PRINCIPLED: below coat and sheen).
    emission_two_sided
        Whether the back emits too, as Blender's Emission does; False: only the front
        (counter-clockwise) side.
    kind
        ``"PRINCIPLED"`` (Blender 4.2 to 5.2), ``"DIFFUSE"``, ``"GLOSSY"``, ``"GLASS"``, ``"REFRACTION"``,
        ``"TRANSPARENT"``, ``"TRANSLUCENT"`` or ``"SHEEN"``, the Blender nodes of these names, or ``"DISNEY"``, the
        BSDF of Burley 2012. Each reads the fields that its node has (DIFFUSE: its roughness is `diffuse_roughness`).
    metallic, roughness, diffuse_roughness, specular_ior_level, specular_tint, ior, anisotropy,
    anisotropy_rotation, transmission, coat_weight, coat_roughness, coat_ior, coat_tint, sheen_weight,
    sheen_roughness, sheen_tint, alpha, subsurface_weight
        As in Blender: shares and roughnesses in [0, 1] (microfacet alpha is the roughness squared),
        anisotropy in [-1, 1], rotation in turns, tints linear Rec.709. Subsurface scattering is
        approximated by its diffuse limit.
    multiscatter
        Whether rough reflection and refraction keep the energy of light that is scattered between
        microfacets (Blender's "Multiscatter GGX").
    normal
        (3,) normal map's colour, (0.5, 0.5, 1) for none; it counts if `textures` has it.
    normal_strength
        >= 0; 0: the smooth normal.
    normal_uv
        Name of the UV map whose tangents the normal map is relative to; anisotropy turns about them too.
        The mesh's attribute "NAME.tangent" (m, 3, 4), tangent and sign, is used where there is one.
    textures
        Field name to an expression that replaces the field's value at each point of a surface. Values outside of
        the field's range count as its nearest end, and have no derivative. As in Cycles `coat_weight`,
        `sheen_weight`, `specular_ior_level` and colours have no upper end then.
    """

    base_color: NDArray[np.float64] = field(default_factory=lambda: _rgb(0.8))
    emission: NDArray[np.float64] = field(default_factory=lambda: _rgb(0.0))
    emission_two_sided: bool = True
    kind: str = "PRINCIPLED"
    metallic: float = 0.0
    roughness: float = 0.5
    diffuse_roughness: float = 0.0
    specular_ior_level: float = 0.0
    specular_tint: NDArray[np.float64] = field(default_factory=lambda: _rgb(1.0))
    ior: float = 1.5
    anisotropy: float = 0.0
    anisotropy_rotation: float = 0.0
    transmission: float = 0.0
    coat_weight: float = 0.0
    coat_roughness: float = 0.03
    coat_ior: float = 1.5
    coat_tint: NDArray[np.float64] = field(default_factory=lambda: _rgb(1.0))
    sheen_weight: float = 0.0
    sheen_roughness: float = 0.5
    sheen_tint: NDArray[np.float64] = field(default_factory=lambda: _rgb(1.0))
    alpha: float = 1.0
    subsurface_weight: float = 0.0
    multiscatter: bool = True
    normal: NDArray[np.float64] = field(default_factory=lambda: np.array([0.5, 0.5, 1.0]))
    normal_strength: float = 1.0
    normal_uv: str = "UVMap"
    textures: Mapping[str, Expression] = field(default_factory=dict)

    checks: ClassVar[Mapping[str, Check]] = {
        "kind": by(choice, KINDS),
        "base_color": _color,
        **dict.fromkeys(("emission", "specular_tint", "coat_tint", "sheen_tint", "normal"), _tint),
        **dict.fromkeys(_SHARES, by(number, least=0.0, greatest=1.0)),
        **dict.fromkeys(("specular_ior_level", "normal_strength"), by(number, least=0.0)),
        "ior": by(number, above=0.0),
        "coat_ior": by(number, least=1.0),
        "anisotropy": by(number, least=-1.0, below=1.0 + 1e-6),
        "anisotropy_rotation": number,
        **dict.fromkeys(("emission_two_sided", "multiscatter"), flag),
        "normal_uv": text,
        "textures": by(mapping, _expression),
    }

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the material and the wrong field."""
        where = f"material '{name}'"
        self.check_fields(where)
        for key in self.textures:
            if key not in TEXTURED:
                raise ValueError(f"{where}: textures has '{key}', which is none of {', '.join(TEXTURED)}"
                                 f"{near(key, TEXTURED)}")


@dataclass
class Mixture(Checked):
    """A weighted sum of materials: Blender's Mix Shader (weights 1 - f and f) and Add Shader (1 and 1).

    Attributes
    ----------
    parts
        Names of materials in the scene, none of them a mixture itself.
    weights
        (k,) one for each part, >= 0.
    textures
        Position of a part ("0", "1", ...) to an expression that replaces its weight; below 0 it counts as 0.
    """

    parts: tuple[str, ...]
    weights: NDArray[np.float64]
    textures: Mapping[str, Expression] = field(default_factory=dict)

    checks: ClassVar[Mapping[str, Check]] = {
        "parts": by(names, "names of materials"),
        "weights": by(array, (None,), np.float64, least=0.0),
        "textures": by(mapping, _expression),
    }

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the material and the wrong field."""
        where = f"material '{name}'"
        self.check_fields(where)
        if not self.parts:
            raise ValueError(f"{where}: parts is empty")
        if len(self.weights) != len(self.parts):
            raise ValueError(f"{where}: weights must have the shape ({len(self.parts)},), one for each part, not "
                             f"{self.weights.shape}")
        for key in self.textures:
            if key not in [str(k) for k in range(len(self.parts))]:
                raise ValueError(f"{where}: textures has '{key}', which is no part's position")
