"""Surface materials: Blender's Principled BSDF, its simple shaders, and sums of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ._check import array, choice, number
from .expression import Expression, nodes_of

# PRINCIPLED is Blender's Principled BSDF (4.2 to 5.2); the rest are the shader nodes of that name. DISNEY is
# the BSDF of Burley 2012 as Mitsuba 3's `principled` has it, for comparisons.
KINDS = ("PRINCIPLED", "DIFFUSE", "GLOSSY", "GLASS", "REFRACTION", "TRANSPARENT", "TRANSLUCENT", "SHEEN", "DISNEY")

_COLORS = ("base_color", "specular_tint", "coat_tint", "sheen_tint")
_SHARES = ("metallic", "roughness", "diffuse_roughness", "transmission", "coat_weight", "coat_roughness",
           "sheen_weight", "sheen_roughness", "alpha", "subsurface_weight")


def _rgb(value: float) -> NDArray[np.float64]:
    return np.full(3, value)


@dataclass
class Material:
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
        One of `KINDS`; each reads the fields that its Blender node has (DIFFUSE: its roughness is
        `diffuse_roughness`).
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
        Field name to an expression that replaces the field's value at each point of a surface.
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

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the material and the wrong field."""
        where = f"material '{name}'"
        choice(where, "kind", self.kind, KINDS)
        for key in (*_COLORS, "emission", "normal"):
            setattr(self, key, array(where, key, getattr(self, key), (3,), np.float64, least=0.0))
        if self.base_color.max() > 1.0:
            raise ValueError(f"{where}: base_color must not be above 1, but contains {self.base_color.max():g}")
        for key in _SHARES:
            value = number(where, key, getattr(self, key), least=0.0)
            if value > 1.0:
                raise ValueError(f"{where}: {key} must not be above 1, but is {value:g}")
            setattr(self, key, value)
        for key in ("specular_ior_level", "normal_strength"):
            setattr(self, key, number(where, key, getattr(self, key), least=0.0))
        self.ior = number(where, "ior", self.ior, above=0.0)
        self.coat_ior = number(where, "coat_ior", self.coat_ior, least=1.0)
        self.anisotropy = number(where, "anisotropy", self.anisotropy, least=-1.0, below=1.0 + 1e-6)
        self.anisotropy_rotation = number(where, "anisotropy_rotation", self.anisotropy_rotation)
        for key, expression in self.textures.items():
            if key not in TEXTURED:
                raise ValueError(f"{where}: textures has '{key}', which is none of {', '.join(TEXTURED)}")
            _check_expression(where, key, expression)


def _check_expression(where: str, key: str, value: Expression) -> None:
    if not isinstance(value, Expression):
        raise ValueError(f"{where}: textures['{key}'] must be an edgegrad.expression, not {value!r}")
    try:
        nodes_of(value)
    except ValueError as error:
        raise ValueError(f"{where}: textures['{key}']: {error}") from None


# Fields that `Material.textures` may replace.
TEXTURED = (
    "base_color", "emission", *_SHARES, "specular_ior_level", "specular_tint", "ior", "anisotropy",
    "anisotropy_rotation", "coat_ior", "coat_tint", "sheen_tint", "normal", "normal_strength",
)


@dataclass
class Mixture:
    """A weighted sum of materials: Blender's Mix Shader (weights 1 - f and f) and Add Shader (1 and 1).

    Attributes
    ----------
    parts
        Names of materials in the scene, none of them a mixture itself.
    weights
        (k,) one for each part, >= 0.
    textures
        Position of a part ("0", "1", ...) to an expression that replaces its weight.
    """

    parts: tuple[str, ...]
    weights: NDArray[np.float64]
    textures: Mapping[str, Expression] = field(default_factory=dict)

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the material and the wrong field."""
        where = f"material '{name}'"
        self.parts = tuple(self.parts)
        if not self.parts:
            raise ValueError(f"{where}: parts is empty")
        self.weights = array(where, "weights", self.weights, (len(self.parts),), np.float64, least=0.0)
        for key, value in self.textures.items():
            if key not in [str(k) for k in range(len(self.parts))]:
                raise ValueError(f"{where}: textures has '{key}', which is no part's position")
            _check_expression(where, key, value)
