"""Translation of Blender's shader nodes to `edgegrad.Material`s."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Operand

from ..approximated.sizes import farthest, thinnest
from ..approximated.subsurface import LEAST_RADIUS, diffusion_length, rounded_share, seen_albedo
from ..inventory.naming import node_sentences
from ..nodes.expressions import number, rgb
from ..nodes.links import by_identifier, feed
from .shaders import Closure

PRINCIPLED = {
    "base_color": "Base Color", "metallic": "Metallic", "roughness": "Roughness", "ior": "IOR", "alpha": "Alpha",
    "diffuse_roughness": "Diffuse Roughness", "subsurface_weight": "Subsurface Weight",
    "specular_ior_level": "Specular IOR Level", "specular_tint": "Specular Tint", "anisotropy": "Anisotropic",
    "anisotropy_rotation": "Anisotropic Rotation", "transmission": "Transmission Weight",
    "coat_weight": "Coat Weight", "coat_roughness": "Coat Roughness", "coat_ior": "Coat IOR", "coat_tint": "Coat Tint",
    "sheen_weight": "Sheen Weight", "sheen_roughness": "Sheen Roughness", "sheen_tint": "Sheen Tint",
}  # fmt: skip

# Share of an object's size over which light may spread below its surface and still look as if it did not.
SPREAD_UNSEEN = 0.003
# Share of light that Cycles loses by rounding, from which it is noted.
LOSS_UNSEEN = 0.01

# Roughness of refraction above which microfacets that face away from the viewer are a visible share.
ROUGH_REFRACTION = 0.6

# Cycles drops the emission of a Principled BSDF whose colour or strength is a constant of no more than this.
LEAST_EMISSION = 1e-5
# Shaders of volumes and of EEVEE.
BLACK_IN_CYCLES = ("PRINCIPLED_VOLUME", "VOLUME_ABSORPTION", "VOLUME_SCATTER", "VOLUME_COEFFICIENTS", "EEVEE_SPECULAR")

SHADERS: dict[str, Callable[[Closure], None]] = {}


def shader(*types: str) -> Callable[[Callable[[Closure], None]], Callable[[Closure], None]]:
    """Register the decorated function as the translation of these types of shader nodes."""

    def register(function: Callable[[Closure], None]) -> Callable[[Closure], None]:
        for one in types:
            SHADERS[one] = function
        return function

    return register


def read_shader(closure: Closure) -> edgegrad.Material:
    """Fill the material of the closure from its node; black, with a note, if the node is not a surface shader."""
    closure.material.specular_ior_level = 0.0
    for sentence in node_sentences(closure.node):
        closure.note(sentence)
    read = SHADERS.get(closure.node.type)
    if closure.output is not None and closure.output.type != "SHADER":
        closure.emit(closure.output)
    elif read is None:
        name = closure.node.bl_label or closure.node.type
        known = closure.node.type in BLACK_IN_CYCLES
        closure.note(f"{name} is no surface shader of Cycles; it is black, as there" if known else
                     f"{name} can't be rendered; it is black")  # fmt: skip
        closure.material.kind = "DIFFUSE"
        closure.material.base_color = np.zeros(3)
    else:
        read(closure)
    return closure.material


def _is_set(closure: Closure, name: str, rest: float = 0.0) -> bool:
    return closure.has(name) and number(closure.read(name)) != rest


def _note_rough_refraction(closure: Closure) -> None:
    """Note where Cycles evaluates refraction by microfacets that face away from the viewer, which it never samples."""
    if "roughness" not in closure.material.textures and closure.material.roughness > ROUGH_REFRACTION:
        closure.note("light refracted by microfacets that face away from the viewer is left out, which Cycles adds to "
                     "rough glass")  # fmt: skip


def _thin_film(closure: Closure) -> None:
    if _is_set(closure, "Thin Film Thickness"):
        closure.set_all({"thin_film_thickness": "Thin Film Thickness", "thin_film_ior": "Thin Film IOR"})


def _microfacets(closure: Closure) -> None:
    closure.material.multiscatter = closure.node.distribution == "MULTI_GGX"
    closure.material.distribution = closure.node.distribution.removeprefix("MULTI_")


@shader("BSDF_PRINCIPLED")
def _principled(closure: Closure) -> None:
    closure.material.kind = "PRINCIPLED"
    closure.set_all(PRINCIPLED)
    closure.emission("Emission Color", "Emission Strength", LEAST_EMISSION)
    closure.normal()
    closure.tangent()
    _microfacets(closure)
    if closure.material.transmission > 0.0 or "transmission" in closure.material.textures:
        _note_rough_refraction(closure)
    if closure.material.subsurface_weight > 0.0 or "subsurface_weight" in closure.material.textures:
        _principled_subsurface(closure)
    _thin_film(closure)
    if _is_set(closure, "Thin Wall"):
        closure.note("its thin wall is left out")


@shader("BSDF_DIFFUSE")
def _diffuse(closure: Closure) -> None:
    closure.material.kind = "DIFFUSE"
    closure.set_all({"base_color": "Color", "diffuse_roughness": "Roughness"})
    closure.normal()


@shader("BSDF_GLOSSY", "BSDF_ANISOTROPIC")
def _glossy(closure: Closure) -> None:
    closure.material.kind = "GLOSSY"
    closure.set_all({"base_color": "Color", "roughness": "Roughness", "anisotropy": "Anisotropy",
                     "anisotropy_rotation": "Rotation"})  # fmt: skip
    closure.normal()
    closure.tangent()
    _microfacets(closure)


@shader("BSDF_GLASS", "BSDF_REFRACTION")
def _glass(closure: Closure) -> None:
    closure.material.kind = "GLASS" if closure.node.type == "BSDF_GLASS" else "REFRACTION"
    closure.set_all({"base_color": "Color", "roughness": "Roughness", "ior": "IOR"})
    closure.normal()
    _microfacets(closure)
    _note_rough_refraction(closure)
    _thin_film(closure)


@shader("BSDF_METALLIC")
def _metallic(closure: Closure) -> None:
    """Translate to a metallic Principled BSDF, which has the same F82-tint Fresnel curve (Kutz et al. 2021)."""
    closure.material.kind = "PRINCIPLED"
    closure.material.metallic = 1.0
    closure.set_all({"roughness": "Roughness", "anisotropy": "Anisotropy", "anisotropy_rotation": "Rotation"})
    if closure.node.fresnel_type == "F82":
        closure.set_all({"base_color": "Base Color", "specular_tint": "Edge Tint"})
    else:
        n, k = (rgb(closure.read(name)) for name in ("IOR", "Extinction"))
        if n is None or k is None:
            closure.note("its complex IOR must not vary; the values of its sockets are used")
            n, k = (rgb(closure.own(name)) for name in ("IOR", "Extinction"))
        assert n is not None and k is not None
        closure.material.base_color, closure.material.specular_tint = _f82(n, k)
        closure.note("its complex IOR is approximated by reflectances at 0 and 82 degrees")
    closure.normal()
    closure.tangent()
    _microfacets(closure)
    _thin_film(closure)


def _f82(n: np.ndarray, k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reflectance at normal incidence, and tint of Schlick's curve at cos = 1/7, for a complex IOR n + i k."""
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
def _transparent(closure: Closure) -> None:
    closure.material.kind = "TRANSPARENT"
    closure.set("base_color", "Color")
    if closure.node.type == "BSDF_RAY_PORTAL":
        moved = [feed(by_identifier(closure.node.inputs, name), closure.groups) for name in ("Position", "Direction")]
        if any(found.output is not None for found in moved):  # else rays go straight on
            closure.note("a ray portal is approximated by a transparent surface")


@shader("BSDF_TRANSLUCENT")
def _translucent(closure: Closure) -> None:
    closure.material.kind = "TRANSLUCENT"
    closure.set("base_color", "Color")
    closure.normal()


@shader("BSDF_SHEEN")
def _sheen(closure: Closure) -> None:
    closure.material.kind = "SHEEN" if closure.node.distribution == "MICROFIBER" else "VELVET"
    closure.set_all({"base_color": "Color", "roughness": "Roughness", "sheen_roughness": "Roughness"})
    closure.normal()


@shader("EMISSION", "BACKGROUND")
def _emission(closure: Closure) -> None:
    closure.material.kind = "DIFFUSE"
    closure.material.base_color = np.zeros(3)
    closure.emission("Color", "Strength")


@shader("SUBSURFACE_SCATTERING")
def _subsurface(closure: Closure) -> None:
    closure.material.kind = "DIFFUSE"
    closure.reader.scatters = True
    method = closure.node.falloff
    roughness, ior = (closure.constant(name, rest) for name, rest in (("Roughness", 1.0), ("IOR", 1.4)))
    color = closure.read("Color")
    scattered = _scattered(closure, "Radius", "Scale")
    albedo = seen_albedo(color, method, roughness, ior) if any(scattered) else color
    closure.put("base_color", _by_channel(scattered, color, albedo), closure.own("Color"))
    closure.normal()
    _note_spread(closure, "Color", "Radius", "Scale", method)


def _principled_subsurface(closure: Closure) -> None:
    """Mix the albedo of subsurface scattering into the base colour."""
    material, method = closure.material, closure.node.subsurface_method
    closure.reader.scatters = True
    scattered = _scattered(closure, "Subsurface Radius", "Subsurface Scale")
    if not any(scattered):
        return
    if any(getattr(material, field) != 0.0 or field in material.textures for field in ("metallic", "transmission")):
        closure.note("its subsurface scattering has the albedo of a diffuse surface, since it is partly metal or glass")
    else:
        ior, level = closure.constant("IOR", 1.5), closure.constant("Specular IOR Level", 0.5)
        # Cycles refracts by the index that has the reflectance which the level scales.
        root = np.sqrt(min(2.0 * level * ((ior - 1.0) / (ior + 1.0)) ** 2, 0.99))
        if method == "RANDOM_WALK_SKIN":
            refracted = closure.constant("Subsurface IOR", 1.4)
        else:
            refracted = float((1.0 + root) / (1.0 - root))
        color = closure.read("Base Color")
        albedo = seen_albedo(color, method, closure.constant("Roughness", 0.5), refracted)
        weight = material.textures.get("subsurface_weight", material.subsurface_weight)
        if albedo is not color:
            seen = e.Mix(weight, color, _by_channel(scattered, color, albedo))
            closure.put("base_color", seen, closure.own("Base Color"))
    _note_spread(closure, "Base Color", "Subsurface Radius", "Subsurface Scale", method)


def _scattered(closure: Closure, radius: str, scale: str) -> tuple[bool, ...]:
    """Channels of colour in which light enters the surface; without a radius, Cycles renders one as diffuse."""
    found, factor = rgb(closure.read(radius)), number(closure.read(scale))
    if factor is None:
        return (True,) * 3 if found is None else tuple(found > 0.0)
    if found is None:
        return (factor > 0.0,) * 3
    return tuple(found * factor >= LEAST_RADIUS)


def _by_channel(scattered: tuple[bool, ...], plain: Operand, seen: Operand) -> Operand:
    """The colour `seen` in the channels that scatter, the plain one in others."""
    if all(scattered) or seen is plain:
        return seen
    return e.Combine(*(e.Channel(seen if one else plain, k) for k, one in enumerate(scattered)))


def _note_spread(closure: Closure, color: str, radius: str, scale: str, method: str) -> None:
    """Note how far light spreads below the surface, unless that is far less than the size of the objects."""
    for name in ("Subsurface Anisotropy", "Anisotropy"):
        if closure.has(name) and _is_set(closure, name):
            closure.note(f"its '{name}' is left out; light scatters equally in all directions below its surface")
    name, size = thinnest(closure.reader.owner)
    color_, radius_, scale_ = (rgb(closure.own(one)) for one in (color, radius, scale))
    assert color_ is not None and radius_ is not None and scale_ is not None
    length = diffusion_length(color_, radius_ * scale_[0], method)
    lost = rounded_share(color_, radius_ * scale_[0], method, farthest(closure.reader.owner))
    if lost > LOSS_UNSEEN:
        closure.note(f"light that scatters below its surface moves by steps as short as coordinates are rounded, so "
                     f"Cycles itself loses about {lost:.0%} of it")  # fmt: skip
    if name and length < SPREAD_UNSEEN * size:
        return
    of = f", {length / size:.1%} of the {size:.3g} m of object '{name}'," if name else ""
    closure.note(f"its subsurface scattering does not spread light, which Cycles spreads over {length:.2g} m{of} "
                 "so shadows are sharper and thin parts darker")  # fmt: skip


@shader("BSDF_TOON")
def _toon(closure: Closure) -> None:
    closure.material.kind = "DIFFUSE" if closure.node.component == "DIFFUSE" else "GLOSSY"
    closure.set("base_color", "Color")
    if closure.material.kind == "GLOSSY":
        closure.set("roughness", "Size")
    closure.normal()
    closure.note(f"a toon shader is approximated by a {closure.material.kind.lower()} one")


@shader("BSDF_HAIR")
def _hair(closure: Closure) -> None:
    closure.material.kind = "GLOSSY" if closure.node.component == "Reflection" else "TRANSLUCENT"
    closure.set("base_color", "Color")
    if closure.material.kind == "GLOSSY":
        closure.set("roughness", "RoughnessU")
    closure.note(f"a hair shader is approximated by a {closure.material.kind.lower()} one")


@shader("BSDF_HAIR_PRINCIPLED")
def _principled_hair(closure: Closure) -> None:
    closure.material.kind = "DIFFUSE"
    closure.set("base_color", "Color")
    closure.note("a hair shader is approximated by a diffuse one")


@shader("HOLDOUT")
def _holdout(closure: Closure) -> None:
    closure.material.kind = "DIFFUSE"
    closure.material.base_color = np.zeros(3)
    closure.note("a holdout is rendered black")
