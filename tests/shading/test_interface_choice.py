"""Derivatives of smooth glass near the critical angle, where the slope of its transmittance is unbounded."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support.block_statistics import check, mean_p_value, normal_p_value
from tests.support.distributions import chi_square_tail
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import camera, matte, rectangle, white_world

Floats = NDArray[np.float64]
IOR, SIZE = 1.5, 16
CRITICAL = np.arcsin(1.0 / IOR)
# The critical angle is in the middle of a column of pixels.
AIM = np.array([np.sin(CRITICAL - 0.008), 0.0, np.cos(CRITICAL - 0.008)])


def pane(angle: float = 0.0) -> edgegrad.Scene:
    """From inside of the glass the camera looks at its surface at the critical angle.

    Transmitted light comes from a white environment, reflected light from a black wall behind the camera.
    """
    glass = rectangle((0, 0, 0), (20 * np.cos(angle), 0, 20 * np.sin(angle)), (0, 20, 0), "glass")
    wall = rectangle((0, 0, -3), (200, 0, 0), (0, 200, 0), "black")
    clear = edgegrad.Material(np.ones(3), kind="GLASS", roughness=0.0, ior=IOR, multiscatter=False)
    return edgegrad.Scene(
        camera(-AIM, (0, 0, 0), SIZE, 0.25), {"pane": glass, "wall": wall}, {"glass": clear, "black": matte(0, 0, 0)},
        {}, white_world())


def turning() -> tuple[edgegrad.Scene, Mapping[str, Floats]]:
    """The pane turns about the axis that is across the picture."""
    vertices = np.asarray(pane().meshes["pane"].vertices, float)
    return pane(), {"meshes.pane.vertices": np.stack([-vertices[:, 2], 0 * vertices[:, 0], vertices[:, 0]], axis=1)}


def transmittance(cosine: Floats) -> tuple[Floats, Floats]:
    """Share that passes (Fresnel), and its slope by the cosine; zero beyond the critical angle."""
    eta = 1.0 / IOR
    g = np.sqrt(np.maximum(eta**2 - 1 + cosine**2, 1e-30))
    e = eta**2 * cosine
    s, p = (cosine - g) / (cosine + g), (e - g) / (e + g)
    steep = 2 * (g - cosine**2 / g)
    slope = steep * (s / (cosine + g) ** 2 + p * eta**2 / (e + g) ** 2)
    refracts = g > 1e-14
    return np.where(refracts, 1 - (s**2 + p**2) / 2, 0.0), np.where(refracts, -slope, 0.0)


def cosines(angle: float, across: int, along: int) -> Floats:
    """Of rays through a grid of so many places per pixel: (SIZE * along, SIZE * across)."""
    c = camera(-AIM, (0, 0, 0), SIZE, 0.25)
    x = (np.arange(SIZE * across) + 0.5) / across - SIZE / 2
    y = (np.arange(SIZE * along) + 0.5) / along - SIZE / 2
    focal = SIZE / 2 / np.tan(0.125)
    local = np.stack(np.broadcast_arrays(x / focal, -y[:, None] / focal, -1.0), axis=-1)
    d = local @ np.asarray(c.to_world)[:3, :3].T
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    return d @ np.array([-np.sin(angle), 0.0, np.cos(angle)])


def pixel_means(a: Floats, across: int, along: int) -> Floats:
    return a.reshape(SIZE, along, SIZE, across).mean((1, 3))


def test_slope_of_what_passes() -> None:
    """Mean, frequency and clipped second moment of single samples against closed forms of how they are picked."""
    need_every_table()
    seeds, across, along, h, most = 400, 2048, 2, 1e-4, 50.0

    def passed(angle: float) -> Floats:
        return pixel_means(transmittance(cosines(angle, across, along))[0], across, along)

    truth = (passed(h) - passed(-h)) / (2 * h)
    share, slope = transmittance(cosines(0.0, across, along))
    value = abs(slope * (cosines(h, across, along) - cosines(-h, across, along)) / (2 * h))

    def square(chance: Floats) -> float:
        """Of samples that pass with that chance, no larger than `most`."""
        chance = np.maximum(chance, 1e-30)
        return float((chance * np.minimum(value / chance, most) ** 2).mean())

    scene, tangent = turning()
    renderer = Renderer(scene, engine="native")
    samples = np.array([renderer.render_forward(tangent, spp=1, seed=s, terms=("interior",))[..., 0]
                        for s in range(seeds)], float)
    error = samples.std(0, ddof=1) / np.sqrt(seeds)
    lit = error > 0
    z = (samples.mean(0) - truth)[lit] / error[lit]
    check(chi_square_tail(float((z**2).sum()), int(lit.sum())))
    # The probability of transmission and the weights both differ from the picture's.
    more = np.minimum(0.2 * abs(slope), 0.25) * (share > 0)
    chance = (share + more) / (1 + 2 * more)
    often, picked = (samples != 0).mean(), pixel_means(chance, across, along)
    # Pixels without a sample that passes are those where hardly any is expected.
    check(float(np.exp(-seeds * picked[~lit]).min(initial=1.0)) * lit.size)
    spread = np.sqrt((picked * (1 - picked)).mean() / samples.size)
    check(normal_p_value((often - picked.mean()) / spread))
    assert abs(often - share.mean()) > 20 * spread
    clipped = np.minimum(abs(samples), most) ** 2
    check(mean_p_value(clipped.ravel(), square(chance)))
