"""Camera samples and the picture: a pixel is the integral of the radiance over its unit square."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .film import Film
from .light import Lighting, Points
from .sampling import LIGHT_DIMENSIONS, sequence
from .surfaces import Floats, Ints

Progress = Callable[[float], None]

# Camera samples per array operation. More samples amortise the overhead of numpy, but need more memory.
CHUNK = 1 << 16


@dataclass
class CameraSamples:
    """A chunk of pixel samples: pixel (n,), direction (n, 3), hit face (n,; -1: none), random numbers for the light.

    `fraction` is the fraction of all samples that are done after this chunk.
    """

    pixel: Ints
    direction: Floats
    face: Ints
    xi: Floats
    fraction: float


def camera_samples(film: Film, lighting: Lighting, spp: int, seed: int, stream: int) -> Iterator[CameraSamples]:
    """Yield all samples of the picture in chunks; equal seed and stream give equal samples."""
    per_pixel = min(spp, CHUNK)
    block = max(1, CHUNK // per_pixel)
    for start in range(0, film.pixels, block):
        pixels = np.arange(start, min(start + block, film.pixels))
        for first in range(0, spp, per_pixel):
            count = min(per_pixel, spp - first)
            # Each block of pixels has its own generator, so a second chunk of the same pixels continues their sequence.
            generator = np.random.default_rng([seed, stream, start])
            xi = sequence(generator, len(pixels), first, count, 2 + LIGHT_DIMENSIONS).reshape(-1, 2 + LIGHT_DIMENSIONS)
            pixel = np.repeat(pixels, count)
            corner = np.stack([pixel % film.width, pixel // film.width], axis=1)
            direction = film.directions(corner + xi[:, :2])
            near, far = film.limits(direction)
            origin = np.broadcast_to(film.centre, direction.shape)
            face, _ = lighting.rays.closest(origin, direction, near, far)
            done = (start + len(pixels) * (first + count) / spp) / film.pixels
            yield CameraSamples(pixel, direction, face, xi[:, 2:], done)


def hits(film: Film, lighting: Lighting, samples: CameraSamples) -> tuple[Ints, Points, Floats]:
    """Rows of the samples that hit a surface, the hit points, and their barycentrics."""
    row = np.flatnonzero(samples.face >= 0)
    face, direction = samples.face[row], samples.direction[row]
    t, beta = lighting.surfaces.meet(face, np.broadcast_to(film.centre, direction.shape), direction)
    fine = np.isfinite(t)
    row, face, direction, t, beta = row[fine], face[fine], direction[fine], t[fine], beta[fine]
    x = film.centre + t[:, None] * direction
    return row, Points.inside(lighting.surfaces, x, face, direction), beta


def render(
    film: Film, lighting: Lighting, *, spp: int, seed: int, max_depth: int, progress: Progress | None
) -> Floats:
    """Render the picture (height, width, 3)."""
    image = np.zeros((film.pixels, 3))
    for samples in camera_samples(film, lighting, spp, seed, stream=0):
        row, points, _ = hits(film, lighting, samples)
        colour = np.where(samples.face[:, None] < 0, lighting.surfaces.environment, 0.0)
        colour[row] = lighting.radiance(points, samples.xi[row], max_depth)
        image += film.splat(samples.pixel, colour)
        if progress is not None:
            progress(samples.fraction)
    return image.reshape(film.height, film.width, 3) / spp
