"""View transforms: how linear light became the code values of a picture, and back.

A target with a view transform could be compared with a render in two ways: the transform T is applied to the render, or
it is undone in the target. It is undone here, for two reasons. Renders of a fit are noisy, and the mean of T(render) is
not T(mean): the gradient of |T(I) - P|² is biased at the truth, by half the curvature of T times the variance of I. The
difference I - T⁻¹(P) is linear in I, and hence unbiased. And a target is undone only once per fit.

An inverse magnifies the noise of rounding where T is flat, in bright and in very saturated colours. Its standard
deviation follows from the derivative of T, and from the distance of other lights with the same code where the tables of
T are not monotonic. It becomes a weight per pixel (`targets`). A pixel with a channel at its largest value tells only
that the light was at least as bright; it gets no weight.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import number, numeric, shown
from .._fields import Check, CheckedAtOnce, by
from .color_config import processor
from .srgb import linear_to_srgb, srgb_to_linear

F64 = NDArray[np.float64]

STANDARD = "Standard"
NO_LOOK = "None"

# Newton's method: number of steps, the longest step and the difference step, both in stops; the error of a code at
# which it ends.
STEPS, LONGEST, DIFFERENCE, ENOUGH = 12, 2.0, 0.01, 1e-6
# The unknown is log2(light + DARK), since curves such as AgX are nearly logarithmic.
DARK = 1e-4
BRIGHTEST = 2.0**12
# The derivative of T for the noise is a difference over this step, about the width of a code value in the dark.
NOISE_STEP = (2e-3, 0.02)
# Codes that no light yields differ by more than this number of code widths from those of the found light.
MOST_WIDTHS_OFF = 1.5
# Several lights have the same code only where a channel is below this fraction of the largest. The search for others
# starts where channels are darker by so many stops: each start finds lights that the others miss.
SATURATED, DARKER = 0.3, (8.0, 3.0, -3.0)
# Another light counts if its code differs by less than so many code widths: a rounded code itself is up to half a width
# off, and Newton's method does not always come to the nearest one.
OTHER_WIDTHS = 0.75
# Smallest width of a code: the accuracy of tables of colors, whose kinks Newton's method does not resolve.
LEAST_WIDTH = 5e-4


def _text(where: str, name: str, value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError(f"{where}: {name} must be a name, not {shown(value)}")
    return value


def _config(where: str, name: str, value: Any) -> str | None:
    return None if value is None else _text(where, name, os.fspath(value))


@dataclass(frozen=True)
class ViewTransform(CheckedAtOnce):
    """The view transform of a picture, with the names and settings of Blender's color management.

    Attributes
    ----------
    view, look
        Names in the configuration: "Standard" is sRGB; "AgX", "Filmic" … need `config`.
    exposure
        Stops by which the light is multiplied before the view; Blender's *Exposure* in *Color Management*.
    gamma
        Exponent 1 / gamma of the code values, after the view.
    display
        The screen; its code values are those of the file.
    config
        Path of an OpenColorIO configuration, such as Blender's ``datafiles/colormanagement/config.ocio``; None: that
        of the environment variable ``OCIO``.
    """

    view: str = STANDARD
    look: str = NO_LOOK
    exposure: float = 0.0
    gamma: float = 1.0
    display: str = "sRGB"
    config: str | None = None

    checks: ClassVar[Mapping[str, Check]] = {
        "view": _text,
        "look": _text,
        "exposure": by(number, least=-32.0, greatest=32.0),
        "gamma": by(number, least=0.01, greatest=10.0),
        "display": _text,
        "config": _config,
    }

    @property
    def plain(self) -> bool:
        """Whether it is the curve of sRGB, which needs no configuration."""
        return self.view == STANDARD and self.look == NO_LOOK and self.display == "sRGB"

    def encode(self, light: ArrayLike) -> F64:
        """Convert (..., 3) linear Rec.709 to code values in [0, 1].

        Raises
        ------
        ValueError
            If the configuration has no such view, look or display.
        ImportError
            If the view needs OpenColorIO, which is not installed.
        """
        x = np.asarray(numeric("ViewTransform", "light", light), np.float64)
        return self._forward()(x.reshape(-1, 3)).reshape(x.shape)

    def decode(self, codes: ArrayLike, levels: int = 255) -> tuple[F64, F64]:
        """Convert code values to linear light.

        Parameters
        ----------
        codes
            (..., 3) in [0, 1].
        levels
            Largest whole number of the file's channels.

        Returns
        -------
        light
            (..., 3) linear Rec.709, >= 0.
        noise
            (...) standard deviation of the light of a pixel, over all channels, by the rounding of codes; infinite
            for a pixel with a channel at its largest value, and for colours that the view transform does not yield.
        """
        given = np.asarray(numeric("ViewTransform", "codes", codes), np.float64)
        flat = given.reshape(-1, 3)
        # Both whole codes of 8 and those of 16 bits are multiples of 1 / 65535
        whole = np.round(flat * 0xFFFF).astype(np.int64) @ [1 << 32, 1 << 16, 1]
        unique, where = np.unique(whole, return_inverse=True)
        code = np.stack([unique >> 32, (unique >> 16) & 0xFFFF, unique & 0xFFFF], axis=1) / 0xFFFF
        forward = self._forward()
        with np.errstate(all="ignore"):
            light = self._closed(code) if self.plain else _solve(forward, code, self._start(code))[0]
            light[(code == 0.0).all(axis=1)] = 0.0  # curves such as AgX map all light below a limit to black
            width = max(1.0 / levels, LEAST_WIDTH)
            noise = _noise(forward, light, width)
            if not self.plain:
                noise = np.hypot(noise, _ambiguity(forward, code, light, width))
            off = np.abs(forward(light) - code).max(axis=1)
        noise[(code >= 1.0 - 0.5 / levels).any(axis=1) | ~(off <= MOST_WIDTHS_OFF * width)] = np.inf
        where = where.reshape(-1)
        return light[where].reshape(given.shape), noise[where].reshape(given.shape[:-1])

    def _forward(self) -> Callable[[F64], F64]:
        if self.plain:
            scale = 2.0**self.exposure
            return lambda x: np.clip(linear_to_srgb(scale * x), 0.0, 1.0) ** (1.0 / self.gamma)
        apply = processor(self.config, self.display, self.view, self.look, self.exposure, self.gamma)
        assert apply is not None  # only an inverse may be missing
        return lambda x: np.clip(apply(x), 0.0, 1.0)

    def _closed(self, code: F64) -> F64:
        return srgb_to_linear(code**self.gamma) / 2.0**self.exposure

    def _start(self, code: F64) -> F64:
        """Light of the configuration's own, approximate inverse."""
        inverse = processor(self.config, self.display, self.view, self.look, self.exposure, self.gamma, inverse=True)
        light = self._closed(code) if inverse is None else inverse(code)
        return np.clip(np.nan_to_num(light), 0.0, BRIGHTEST)


def _solve(forward: Callable[[F64], F64], code: F64, start: F64) -> tuple[F64, F64]:
    """Solve forward(light) = code by Newton's method; return the light and the largest difference of its code."""
    x = _unknown(start)
    best, least = x.copy(), np.full(len(x), np.inf)
    rows = np.arange(len(x))  # those that are not solved yet
    for step in range(STEPS + 1):
        residual = forward(_light(x)) - code[rows]
        error = np.abs(residual).max(axis=1)
        better = error < least[rows]
        best[rows[better]], least[rows[better]] = x[better], error[better]
        going = least[rows] > ENOUGH
        rows, x, residual = rows[going], x[going], residual[going]
        if step == STEPS or not len(rows):
            break
        # Columns: derivative with respect to each channel.
        here = code[rows] + residual
        slope = np.stack([(forward(_light(x + DIFFERENCE * e)) - here) / DIFFERENCE for e in np.eye(3)], axis=2)
        transposed = slope.transpose(0, 2, 1)
        normal = transposed @ slope + 1e-9 * np.eye(3)
        change = -(_inverses(normal) @ transposed @ residual[..., None])[..., 0]
        x = np.clip(x + np.clip(change, -LONGEST, LONGEST), np.log2(DARK), np.log2(BRIGHTEST))
    return _light(best), least


def _inverses(matrices: F64) -> F64:
    """Return the inverses of (n, 3, 3) matrices.

    Those of numpy share each single matrix among OpenBLAS's threads, which wait in a loop: beside other processes this
    takes minutes.
    """
    a, b, c = matrices[:, 0], matrices[:, 1], matrices[:, 2]
    columns = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    return np.asarray(columns / (a * columns[:, :, 0]).sum(axis=1)[:, None, None])


def _unknown(light: F64) -> F64:
    return np.log2(light + DARK)


def _light(x: F64) -> F64:
    return np.maximum(2.0**x - DARK, 0.0)


def _ambiguity(forward: Callable[[F64], F64], code: F64, light: F64, width: float) -> F64:
    """Standard deviation of the light if another light of the same code is as likely.

    The tables of AgX map dark channels of saturated colours to codes that rise and fall again. Other lights are
    searched from those whose darkest channel, middle channel or both are darker or brighter.
    """
    out = np.zeros(len(light))
    which = np.flatnonzero(light.min(axis=1) < SATURATED * light.max(axis=1))
    here, rank = light[which], light[which].argsort(axis=1).argsort(axis=1)
    for stops, channels in itertools.product(DARKER, (rank == 0, rank == 1, rank <= 1)):
        other, error = _solve(forward, code[which], np.where(channels, 2.0**-stops * here, here))
        distance = np.linalg.norm(other - here, axis=1) / np.sqrt(2.0)
        out[which] = np.maximum(out[which], np.where(error < OTHER_WIDTHS * width, distance, 0.0))
    return out


def _noise(forward: Callable[[F64], F64], light: F64, width: float) -> F64:
    """Standard deviation of the light if each code has a uniform error of this width."""
    start = forward(light)
    columns = []
    for k in range(3):
        moved = light.copy()
        moved[:, k] += NOISE_STEP[0] + NOISE_STEP[1] * light[:, k]
        columns.append((forward(moved) - start) / (moved - light)[:, k : k + 1])
    slope = np.stack(columns, axis=2)
    inverse = _inverses(slope.transpose(0, 2, 1) @ slope + 1e-12 * np.eye(3))
    return np.sqrt(np.trace(inverse, axis1=1, axis2=2) * width**2 / 12.0)
