"""Each of Blender's shader nodes as an `edgegrad.Material`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import edgegrad
from edgegrad import expression as e

from .expressions import number, rgb
from .nodes import by_identifier, feed
from .shaders import Leaf

PRINCIPLED = {
    "base_color": "Base Color", "metallic": "Metallic", "roughness": "Roughness", "ior": "IOR", "alpha": "Alpha",
    "diffuse_roughness": "Diffuse Roughness", "subsurface_weight": "Subsurface Weight",
    "specular_ior_level": "Specular IOR Level", "specular_tint": "Specular Tint", "anisotropy": "Anisotropic",
    "anisotropy_rotation": "Anisotropic Rotation", "transmission": "Transmission Weight",
    "coat_weight": "Coat Weight", "coat_roughness": "Coat Roughness", "coat_ior": "Coat IOR", "coat_tint": "Coat Tint",
    "sheen_weight": "Sheen Weight", "sheen_roughness": "Sheen Roughness", "sheen_tint": "Sheen Tint",
}  # fmt: skip

SHADERS: dict[str, Callable[[Leaf], None]] = {}


def shader(*types: str) -> Callable[[Callable[[Leaf], None]], Callable[[Leaf], None]]:
    """Registers the decorated function as what reads shader nodes of these types."""

    def register(function: Callable[[Leaf], None]) -> Callable[[Leaf], None]:
        for one in types:
            SHADERS[one] = function
        return function

    return register


def read_shader(leaf: Leaf) -> edgegrad.Material:
    """Fill the leaf's material from its node; black, with a note, for nodes that are no surfaces."""
    leaf.material.specular_ior_level = 0.0
    read = SHADERS.get(leaf.node.type)
    if read is None:
        leaf.note(f"{leaf.node.bl_label or leaf.node.type} is no surface shader that can be rendered; it is black")
        leaf.material.kind = "DIFFUSE"
        leaf.material.base_color = np.zeros(3)
    else:
        read(leaf)
    return leaf.material


def _is_set(leaf: Leaf, name: str, rest: float = 0.0) -> bool:
    return leaf.has(name) and number(leaf.read(name)) != rest


def _microfacets(leaf: Leaf) -> None:
    distribution = leaf.node.distribution
    leaf.material.multiscatter = distribution == "MULTI_GGX"
    if distribution in ("BECKMANN", "ASHIKHMIN_SHIRLEY"):
        rough = leaf.material.roughness > 0.0 or "roughness" in leaf.material.textures
        if rough:
            leaf.note(f"its distribution {distribution.replace('_', ' ').title()} is approximated by GGX")


@shader("BSDF_PRINCIPLED")
def _principled(leaf: Leaf) -> None:
    leaf.material.kind = "PRINCIPLED"
    leaf.set_all(PRINCIPLED)
    leaf.emission("Emission Color", "Emission Strength")
    leaf.normal()
    leaf.tangent()
    _microfacets(leaf)
    if leaf.material.subsurface_weight > 0.0 or "subsurface_weight" in leaf.material.textures:
        leaf.note("subsurface scattering is approximated by a diffuse surface")
    if _is_set(leaf, "Thin Film Thickness"):
        leaf.note("its thin film is left out")
    coat = by_identifier(leaf.node.inputs, "Coat Normal")
    if coat is not None and feed(coat, leaf.groups).output is not None and _is_set(leaf, "Coat Weight"):
        leaf.note("its coat has the normal of the base")
    if _is_set(leaf, "Thin Wall"):
        leaf.note("it isn't thin-walled here")


@shader("BSDF_DIFFUSE")
def _diffuse(leaf: Leaf) -> None:
    leaf.material.kind = "DIFFUSE"
    leaf.set_all({"base_color": "Color", "diffuse_roughness": "Roughness"})
    leaf.normal()


@shader("BSDF_GLOSSY", "BSDF_ANISOTROPIC")
def _glossy(leaf: Leaf) -> None:
    leaf.material.kind = "GLOSSY"
    leaf.set_all({"base_color": "Color", "roughness": "Roughness", "anisotropy": "Anisotropy",
                  "anisotropy_rotation": "Rotation"})  # fmt: skip
    leaf.normal()
    leaf.tangent()
    _microfacets(leaf)


@shader("BSDF_GLASS", "BSDF_REFRACTION")
def _glass(leaf: Leaf) -> None:
    leaf.material.kind = "GLASS" if leaf.node.type == "BSDF_GLASS" else "REFRACTION"
    leaf.set_all({"base_color": "Color", "roughness": "Roughness", "ior": "IOR"})
    leaf.normal()
    _microfacets(leaf)
    if _is_set(leaf, "Thin Film Thickness"):
        leaf.note("its thin film is left out")


@shader("BSDF_METALLIC")
def _metallic(leaf: Leaf) -> None:
    """Principled's metal has the same Fresnel curve: F82-tint (Kutz, Hašan and Edmondson 2021)."""
    leaf.material.kind = "PRINCIPLED"
    leaf.material.metallic = 1.0
    leaf.set_all({"roughness": "Roughness", "anisotropy": "Anisotropy", "anisotropy_rotation": "Rotation"})
    if leaf.node.fresnel_type == "F82":
        leaf.set_all({"base_color": "Base Color", "specular_tint": "Edge Tint"})
    else:
        n, k = (rgb(leaf.read(name)) for name in ("IOR", "Extinction"))
        if n is None or k is None:
            leaf.note("its complex IOR must not vary; it is that of the sockets")
            n, k = (rgb(leaf.own(name)) for name in ("IOR", "Extinction"))
        assert n is not None and k is not None
        leaf.material.base_color, leaf.material.specular_tint = _f82(n, k)
        leaf.note("its complex IOR is approximated by reflectances at 0 and 82 degrees")
    leaf.normal()
    leaf.tangent()
    _microfacets(leaf)


def _f82(n: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reflectance at normal incidence, and the tint that Schlick's curve has at cos = 1/7, of a complex IOR."""
    n, k = np.maximum(n, 1e-3), np.maximum(k, 0.0)
    f0 = ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)
    cos = 1.0 / 7.0
    sin2 = 1.0 - cos**2
    root = np.sqrt((n + 1j * k) ** 2 - sin2)
    s = np.abs((cos - root) / (cos + root)) ** 2
    p = np.abs(((n + 1j * k) ** 2 * cos - root) / ((n + 1j * k) ** 2 * cos + root)) ** 2
    schlick = f0 + (1.0 - f0) * (1.0 - cos) ** 5
    return np.clip(f0, 0.0, 1.0), np.clip(0.5 * (s + p) / schlick, 0.0, 1.0)


@shader("BSDF_TRANSPARENT", "BSDF_RAY_PORTAL")
def _transparent(leaf: Leaf) -> None:
    leaf.material.kind = "TRANSPARENT"
    leaf.set("base_color", "Color")
    if leaf.node.type == "BSDF_RAY_PORTAL":
        leaf.note("a ray portal is approximated by a transparent surface")


@shader("BSDF_TRANSLUCENT")
def _translucent(leaf: Leaf) -> None:
    leaf.material.kind = "TRANSLUCENT"
    leaf.set("base_color", "Color")
    leaf.normal()


@shader("BSDF_SHEEN", "BSDF_VELVET")
def _sheen(leaf: Leaf) -> None:
    leaf.material.kind = "SHEEN"
    leaf.set_all({"base_color": "Color", "roughness": "Roughness", "sheen_roughness": "Roughness"})
    leaf.normal()
    if leaf.node.type == "BSDF_VELVET" or leaf.node.distribution != "MICROFIBER":
        leaf.note("its distribution is approximated by microfibres")


@shader("EMISSION", "BACKGROUND")
def _emission(leaf: Leaf) -> None:
    leaf.material.kind = "DIFFUSE"
    leaf.material.base_color = np.zeros(3)
    leaf.emission("Color", "Strength")


@shader("SUBSURFACE_SCATTERING")
def _subsurface(leaf: Leaf) -> None:
    leaf.material.kind = "DIFFUSE"
    leaf.set("base_color", "Color")
    leaf.normal()
    leaf.note("subsurface scattering is approximated by a diffuse surface")


@shader("BSDF_TOON")
def _toon(leaf: Leaf) -> None:
    leaf.material.kind = "DIFFUSE" if leaf.node.component == "DIFFUSE" else "GLOSSY"
    leaf.set("base_color", "Color")
    if leaf.material.kind == "GLOSSY":
        leaf.set("roughness", "Size")
    leaf.normal()
    leaf.note(f"a toon shader is approximated by a {leaf.material.kind.lower()} one")


@shader("BSDF_HAIR")
def _hair(leaf: Leaf) -> None:
    leaf.material.kind = "GLOSSY" if leaf.node.component == "Reflection" else "TRANSLUCENT"
    leaf.set("base_color", "Color")
    if leaf.material.kind == "GLOSSY":
        leaf.set("roughness", "RoughnessU")
    leaf.note(f"a hair shader is approximated by a {leaf.material.kind.lower()} one")


@shader("BSDF_HAIR_PRINCIPLED")
def _principled_hair(leaf: Leaf) -> None:
    leaf.material.kind = "DIFFUSE"
    leaf.set("base_color", "Color")
    leaf.note("a hair shader is approximated by a diffuse one")


@shader("EEVEE_SPECULAR")
def _specular(leaf: Leaf) -> None:
    """EEVEE's Specular BSDF: a diffuse base under a reflection of a given colour, which Cycles doesn't have."""
    leaf.material.kind = "PRINCIPLED"
    leaf.set_all({"base_color": "Base Color", "roughness": "Roughness", "coat_weight": "Clear Coat",
                  "coat_roughness": "Clear Coat Roughness"})  # fmt: skip
    # At IOR 1.5 the reflectance at normal incidence is 0.08 times the level.
    value = rgb(leaf.read("Specular"))
    leaf.material.specular_ior_level = 0.5 if value is None else float(np.mean(value)) / 0.08
    transparency = leaf.read("Transparency")
    leaf.put("alpha", e.Math("SUBTRACT", 1.0, transparency) if isinstance(transparency, e.Expression)
             else 1.0 - (number(transparency) or 0.0), 1.0)  # fmt: skip
    leaf.put("emission", leaf.read("Emissive Color"), leaf.own("Emissive Color"))
    leaf.normal()
    leaf.note("EEVEE's specular shader is approximated by a principled one")


@shader("HOLDOUT")
def _holdout(leaf: Leaf) -> None:
    leaf.material.kind = "DIFFUSE"
    leaf.material.base_color = np.zeros(3)
    leaf.note("a holdout is rendered black")
