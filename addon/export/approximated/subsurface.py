"""Subsurface scattering in the limit of short paths: a diffuse surface whose albedo depends on the view.

Cycles walks randomly through the object (Chiang et al. 2016): the ray enters along a refracted or diffuse direction,
scatters isotropically with a single-scattering albedo that makes the albedo under diffuse light equal to the colour
(Wrenninge et al. 2017), and leaves diffusely. Where the mean free path is short beside the object, it
leaves where it entered, and the fraction that leaves is that of a half-space, 1 - sqrt(1 - alpha) H(mu) with
Chandrasekhar's H function of the cosine mu of the entry (Chandrasekhar 1960). Walks of more than `EVENTS` events are
lost, which matters for bright colours: as a power series in alpha, the fraction has the coefficients
H(mu) / (2 sqrt(pi)) n^(-3/2) at large n, with the H function of alpha = 1.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import expression as e
from edgegrad.expression import Expression, Operand

from ..nodes.expressions import rgb

F64 = NDArray[np.float64]

COLORS = np.linspace(0.0, 1.0, 65) ** 2  # denser where albedos change fast
COSINES = np.linspace(0.0, 1.0, 65)
ROWS = 257
EVENTS = 256  # at which Cycles ends a walk
SAMPLES = 16  # directions of microfacets per dimension
RADIUS_SCALE = 0.25 / np.pi  # from Cycles' radius to the mean free path
LEAST_RADIUS = 1e-8  # below which Cycles renders a channel of colour as diffuse
# Share of light that walks lose, as a function of the rounding of coordinates over the length of a step: a factor, and
# a power that flattens it where steps are the shorter ones; by comparison with Cycles.
LOST, FLATTENED = 0.24, 0.7


def rounded_share(color: Any, radius: Any, method: str, reach: float) -> float:
    """Estimate of the share of light that Cycles' walks lose where their steps are as short as coordinates are rounded.

    Parameters
    ----------
    reach
        Largest coordinate of the object, in the unit of the radius.
    """
    if method == "BURLEY":  # finds the exit without a walk
        return 0.0
    step = radius * RADIUS_SCALE
    if method == "RANDOM_WALK_SKIN":
        step = radius * np.sqrt(3.0 * (1.0 - np.minimum(single_scattering_albedo(color), 0.9995)))
    shortest = float(step[radius >= LEAST_RADIUS].min(initial=np.inf))
    rounded = reach * float(np.finfo(np.float32).eps) / shortest
    return min(LOST * rounded / (1.0 + rounded) ** FLATTENED, 1.0)


def single_scattering_albedo(color: Any) -> F64:
    """Albedo of one scattering event, for isotropic scattering, from the albedo of the surface."""
    a = np.clip(color, 0.0, 1.0)
    low = 1.8260523782 * np.arctan((4.98511194385 + 0.127355959438) * a) ** 1.09686102424
    high = 0.496310210422 * np.arctan((4.23190299701 + 0.00310603949088) * a) ** 2.40602999408
    return np.clip(low + a**0.25 * (high - low), 0.0, 0.999999)


def diffusion_length(color: Any, radius: Any, method: str) -> float:
    """Distance over which light spreads in the channel where it spreads most, in the unit of the radius."""
    color, radius = np.clip(color, 0.0, 1.0), np.maximum(radius, 0.0)
    if method == "RANDOM_WALK_SKIN":  # the radius is the diffusion length
        return float(np.max(radius))
    free_path = radius * RADIUS_SCALE
    if method == "BURLEY":
        return float(np.max(free_path))
    return float(np.max(free_path / np.sqrt(3.0 * (1.0 - np.minimum(single_scattering_albedo(color), 0.9995)))))


def seen_albedo(color: Operand, method: str, roughness: float, ior: float) -> Operand:
    """Albedo of a surface with this colour, which depends on the angle between the view and the normal.

    Parameters
    ----------
    method
        Cycles' method; that of Christensen and Burley does not depend on the view.
    roughness, ior
        Of the surface through which rays enter.
    """
    if method == "BURLEY":
        return color
    table = _albedos(method, round(float(np.clip(roughness, 0.0, 1.0)), 4), round(float(max(ior, 1.0)), 4))
    facing = e.VectorMath("DOT_PRODUCT", e.Coordinates("INCOMING"), e.Coordinates("NORMAL"))
    fixed = rgb(color)
    places = np.linspace(0.0, 1.0, ROWS)
    if fixed is not None:
        columns = [np.interp(places, COSINES, [np.interp(c, COLORS, row) for row in table])
                   for c in np.clip(fixed, 0.0, 1.0)]  # fmt: skip
        return e.Ramp(facing, tuple((float(r), float(g), float(b), 1.0) for r, g, b in np.stack(columns, axis=1)))
    # Three products of a function of the angle and one of the colour are enough.
    u, s, v = np.linalg.svd(table)
    terms: list[Expression] = []
    for k in range(3):
        of_angle = np.interp(places, COSINES, u[:, k] * s[k])
        of_color = np.interp(places, COLORS, v[k])
        ramp = e.Ramp(facing, tuple((float(x),) * 3 + (1.0,) for x in of_angle))
        curves = e.Curves(color, tuple((float(x),) * 3 for x in of_color), extrapolate=False)
        terms.append(e.VectorMath("MULTIPLY", ramp, curves))
    return e.VectorMath("ADD", e.VectorMath("ADD", terms[0], terms[1]), terms[2])


@cache
def _albedos(method: str, roughness: float, ior: float) -> F64:
    """(cosines, colours) albedo seen at each cosine."""
    half_space = _half_space()
    if method == "RANDOM_WALK_SKIN":  # half of the rays enter diffusely, half through facets of roughness 1
        diffuse = np.average(half_space, axis=0, weights=np.where(COSINES < 1.0, COSINES, 0.5))  # trapezoids
        return 0.5 * (diffuse + _refracted(half_space, 1.0, ior))
    return _refracted(half_space, roughness, ior)


@cache
def _half_space() -> F64:
    """(cosines, colours) albedo of a half-space by the cosine of the entry, with Cycles' limit of events."""
    h, alpha = h_functions()
    x, w = np.polynomial.legendre.leggauss(64)
    u, first = 0.5 * (x + 1.0), EVENTS + 0.5
    # The sum over n > EVENTS as an integral, with n = first / u^2.
    lost = (0.5 * w) @ (2.0 / np.sqrt(first) * alpha ** (first / u[:, None] ** 2))
    return np.maximum(1.0 - np.sqrt(1.0 - alpha) * h - h[:, -1:] / (2.0 * np.sqrt(np.pi)) * lost, 0.0)


@cache
def h_functions() -> tuple[F64, F64]:
    """(cosines, colours) Chandrasekhar's H function, and the albedos of one event (colours,)."""
    x, w = np.polynomial.legendre.leggauss(32)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    alpha = single_scattering_albedo(COLORS)
    rest = np.sqrt(1.0 - alpha)

    def step(mu: F64, h: F64) -> F64:
        kernel = (w * x) / (mu[:, None] + x)
        return np.asarray(1.0 / (rest + 0.5 * alpha * (kernel @ h)))

    h = np.ones((len(x), len(alpha)))
    for _ in range(300):
        h = 0.5 * (h + step(x, h))
    return step(COSINES, h), alpha


def _refracted(half_space: F64, roughness: float, ior: float) -> F64:
    """Average a table by the cosine of the entry over facets (GGX, those that are visible; Heitz 2018)."""
    u = (np.arange(SAMPLES) + 0.5) / SAMPLES
    u1, u2 = (x.ravel() for x in np.meshgrid(u, u))
    size = max(roughness**2, 1e-4)
    out = np.empty_like(half_space)
    for k, mu in enumerate(np.maximum(COSINES, 1e-3)):
        view = np.array([np.sqrt(max(1.0 - mu * mu, 0.0)), 0.0, mu])
        stretched = view * (size, size, 1.0)
        stretched /= np.linalg.norm(stretched)
        across = np.array([0.0, 1.0, 0.0])
        along = np.cross(stretched, across)
        along /= np.linalg.norm(along)
        r, phi = np.sqrt(u1), 2.0 * np.pi * u2
        t1, t2 = r * np.cos(phi), r * np.sin(phi)
        blend = 0.5 * (1.0 + stretched[2])
        t1 = (1.0 - blend) * np.sqrt(1.0 - t2 * t2) + blend * t1
        t3 = np.sqrt(np.maximum(1.0 - t1 * t1 - t2 * t2, 0.0))
        h = (np.outer(t2, across) + np.outer(t1, along) + np.outer(t3, stretched)) * (size, size, 1.0)
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        cos_in = h @ view
        cos_out = np.sqrt(1.0 - (1.0 - cos_in**2) / ior**2)
        inside = cos_out * h[:, 2] - (cos_in * h[:, 2] - mu) / ior
        entered = inside[inside > 0.0]
        out[k] = _lookup(half_space, entered if len(entered) else np.zeros(1))
    return out


def _lookup(table: F64, cosines: F64) -> F64:
    """(colours,) mean of the rows at these cosines."""
    place = np.clip(cosines, 0.0, 1.0) * (len(COSINES) - 1)
    low = np.minimum(place.astype(int), len(COSINES) - 2)
    part = (place - low)[:, None]
    return np.asarray(((1.0 - part) * table[low] + part * table[low + 1]).mean(axis=0))
