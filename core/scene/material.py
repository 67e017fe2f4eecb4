"""Surface materials: Blender's Principled BSDF, its simple shaders, and sums of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .._check import array, choice, flag, instance, mapping, names, number, shown, text
from .._fields import Check, Checked, by, near, optional
from ..expression import Expression, nodes_of
from .medium import Medium

# PRINCIPLED is Blender's Principled BSDF (4.2 to 5.2); most others are Blender's shader nodes of the same name.
# DISNEY is the BSDF of Burley 2012 as in Mitsuba 3's `principled`, for comparisons with Mitsuba.
KINDS = ("PRINCIPLED", "DIFFUSE", "GLOSSY", "GLASS", "REFRACTION", "TRANSPARENT", "TRANSLUCENT", "SHEEN", "DISNEY",
         "VELVET")  # fmt: skip

# Distributions of microfacet normals, and the kinds whose microfacets have one.
DISTRIBUTIONS = ("GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY")
SHAPED = ("PRINCIPLED", "GLOSSY", "GLASS", "REFRACTION")

NORMAL_SPACES = ("TANGENT", "WORLD")

_FRACTIONS = ("metallic", "roughness", "diffuse_roughness", "transmission", "coat_weight", "coat_roughness",
           "sheen_weight", "sheen_roughness", "alpha", "subsurface_weight")


# Fields that `Material.textures` may replace.
TEXTURED = (
    "base_color", "emission", *_FRACTIONS, "specular_ior_level", "specular_tint", "ior", "anisotropy",
    "anisotropy_rotation", "coat_ior", "coat_tint", "sheen_tint", "thin_film_thickness", "thin_film_ior", "normal",
    "normal_strength",
)
# A key of `Material.textures` that is no field.
SMOOTH_NORMAL = "smooth_normal"


def _rgb(value: float) -> NDArray[np.float64]:
    return np.full(3, value)


def _expression(where: str, name: str, value: Any) -> Expression:
    if not isinstance(value, Expression):
        raise ValueError(f"{where}: {name} must be an edgegrad.expression, not {shown(value)}")
    try:
        nodes_of(value)
    except ValueError as error:  # the expression has a cycle
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
    """One shader, which scatters on both sides of a surface. The defaults describe a diffuse surface.

    Attributes
    ----------
    base_color
        (3,) linear Rec.709, in [0, 1]: the colour of all kinds of shader.
    emission
        (3,) emitted radiance, W/(m² sr) per channel, >= 0, for all kinds of shader (PRINCIPLED: below coat and
        sheen).
    emission_two_sided
        Whether the back emits too, as Blender's Emission does; False: only the front
        (counter-clockwise) side.
    kind
        ``"PRINCIPLED"`` (Blender 4.2 to 5.2), ``"DIFFUSE"``, ``"GLOSSY"``, ``"GLASS"``, ``"REFRACTION"``,
        ``"TRANSPARENT"``, ``"TRANSLUCENT"`` or ``"SHEEN"``, the Blender nodes of these names, ``"VELVET"``, Blender's
        Sheen with the distribution Ashikhmin, or ``"DISNEY"``, the BSDF of Burley 2012. Each reads the fields that
        its node has (DIFFUSE: its roughness is `diffuse_roughness`).
    metallic, roughness, diffuse_roughness, specular_ior_level, specular_tint, ior, anisotropy,
    anisotropy_rotation, transmission, coat_weight, coat_roughness, coat_ior, coat_tint, sheen_weight,
    sheen_roughness, sheen_tint, alpha, subsurface_weight
        As in Blender: weights and roughnesses in [0, 1] (microfacet alpha is the roughness squared),
        anisotropy in [-1, 1], rotation in turns, tints linear Rec.709. Subsurface scattering is
        approximated by its diffuse limit.
    thin_film_thickness, thin_film_ior
        Of a film on metal, gloss and glass of PRINCIPLED, and on GLASS: nm, >= 0, and its index of refraction. Light
        interferes in it (Belcour and Barla 2017), in RGB as in Cycles. Films up to 0.1 nm do not count.
    multiscatter
        Whether rough reflection and refraction preserve the energy of multiple scattering between microfacets
        (Blender's "Multiscatter GGX"). Only for the distribution GGX.
    distribution
        Distribution of the microfacets of PRINCIPLED, GLOSSY, GLASS and REFRACTION: ``"GGX"``, ``"BECKMANN"``, or for
        GLOSSY alone ``"ASHIKHMIN_SHIRLEY"``, the anisotropic Phong reflection. A Principled coat is always GGX.
    normal
        (3,) colour of the normal map; (0.5, 0.5, 1) is the unperturbed normal. Used only if `textures` has
        "normal".
    normal_strength
        Strength of the normal map, >= 0; 0: the smooth shading normal.
    normal_space
        What "normal" in `textures` is. ``"TANGENT"``: the colour of a normal map. ``"WORLD"``: the shading normal
        itself, a vector in world space on the viewer's side of the surface (`expression.Bump`), which
        `normal_strength` does not change.
    normal_uv
        Name of the UV map that defines the tangents for the normal map and for anisotropy. If the mesh has the
        attribute "NAME.tangent" (m, 3, 4), tangent and sign, it replaces the computed tangents.
    absorption
        (3,) 1/m, >= 0, for all kinds of shader: of the light within a closed mesh (Beer's law), as Blender's Volume
        Absorption gives it. It acts on paths that arrive at the back of the surface. The parts of a mixture must have
        the same.
    medium
        What fills closed meshes, and scatters and absorbs light within them; None: nothing. All surfaces of such a mesh
        have this material or one with the same medium. The surface itself is that of `kind`: TRANSPARENT for smoke.
        The parts of a mixture must have the same.
    textures
        Maps a field name to an expression that replaces the field's value at each surface point. Values outside
        the field's range are clamped, and a clamped value has no derivative. As in Cycles, textured
        `coat_weight`, `sheen_weight`, `specular_ior_level` and colours have no upper limit. "smooth_normal" is no
        field: its expression, a vector in world space on the viewer's side, replaces the smooth normal that all other
        shading starts from, as where a surface's displacement is rendered as bump. Mixtures use that of their first
        part.
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
    thin_film_thickness: float = 0.0
    thin_film_ior: float = 1.33
    multiscatter: bool = True
    distribution: str = "GGX"
    normal: NDArray[np.float64] = field(default_factory=lambda: np.array([0.5, 0.5, 1.0]))
    normal_strength: float = 1.0
    normal_space: str = "TANGENT"
    normal_uv: str = "UVMap"
    absorption: NDArray[np.float64] = field(default_factory=lambda: _rgb(0.0))
    medium: Medium | None = None
    textures: Mapping[str, Expression] = field(default_factory=dict)

    checks: ClassVar[Mapping[str, Check]] = {
        "kind": by(choice, KINDS),
        "distribution": by(choice, DISTRIBUTIONS),
        "base_color": _color,
        **dict.fromkeys(("emission", "absorption", "specular_tint", "coat_tint", "sheen_tint", "normal"), _tint),
        **dict.fromkeys(_FRACTIONS, by(number, least=0.0, greatest=1.0)),
        **dict.fromkeys(("specular_ior_level", "normal_strength"), by(number, least=0.0)),
        "ior": by(number, above=0.0),
        "thin_film_thickness": by(number, least=0.0),
        "thin_film_ior": by(number, above=0.0),
        "coat_ior": by(number, least=1.0),
        "anisotropy": by(number, least=-1.0, below=1.0 + 1e-6),
        "anisotropy_rotation": number,
        **dict.fromkeys(("emission_two_sided", "multiscatter"), flag),
        "normal_space": by(choice, NORMAL_SPACES),
        "medium": optional(by(instance, Medium)),
        "normal_uv": text,
        "textures": by(mapping, _expression),
    }

    @property
    def emits(self) -> bool:
        """Whether the surface may give light; a texture of the emission may be black."""
        return "emission" in self.textures or any(x > 0.0 for x in self.emission.tolist())

    def as_surface(self) -> Material:
        """Return the material without the absorption and the medium behind its surface."""
        return replace(self, absorption=_rgb(0.0), medium=None)

    def validate(self, name: str) -> None:
        """Raise ``ValueError`` with one sentence that names the material and the wrong field."""
        where = f"material '{name}'"
        self.check_fields(where)
        if self.distribution == "ASHIKHMIN_SHIRLEY" and self.kind in SHAPED and self.kind != "GLOSSY":
            raise ValueError(f"{where}: distribution 'ASHIKHMIN_SHIRLEY' is only for kind 'GLOSSY', not for "
                             f"'{self.kind}'; use 'BECKMANN' or 'GGX'")
        if self.medium is not None:
            self.medium.check_fields(f"{where}: medium")
            if np.any(self.absorption > 0.0):
                raise ValueError(f"{where}: has both absorption and a medium; put the absorption into the medium")
        for key in self.textures:
            known = (*TEXTURED, SMOOTH_NORMAL)
            if key not in known:
                raise ValueError(f"{where}: textures has '{key}', but must name one of {', '.join(known)}"
                                 f"{near(key, known)}")


@dataclass
class Mixture(Checked):
    """A weighted sum of materials: Blender's Mix Shader (weights 1 - f and f) and Add Shader (1 and 1).

    Attributes
    ----------
    parts
        Names of materials in the scene; a mixture cannot be part of a mixture.
    weights
        (k,) weight of each part, >= 0.
    textures
        Maps the position of a part ("0", "1", ...) to an expression that replaces its weight; negative values
        are clamped to 0.
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
            raise ValueError(f"{where}: parts is empty; name at least one material")
        if len(self.weights) != len(self.parts):
            raise ValueError(f"{where}: weights must have the shape ({len(self.parts)},), one for each part, not "
                             f"{self.weights.shape}")
        for key in self.textures:
            if key not in [str(k) for k in range(len(self.parts))]:
                raise ValueError(f"{where}: textures has '{key}', which is not the position of a part; use '0' to "
                                 f"'{len(self.parts) - 1}'")
