"""Losses between a rendered image and its target, with adjoint images in closed form.

A loss is a function ``loss(image, target, mask=None) -> (value, adjoint)``; ``adjoint`` is
d value / d image, the input of `edgegrad.render_backward`.

The image I is a noisy estimate. For a loss sum_p rho(I_p - T_p) with target T, the gradient is
sum_p rho'(I_p - T_p) dI_p. If the adjoint rho'(I - T) and the derivative dI came from the *same* samples, they would be
correlated and the product biased; for L2, the bias is the covariance of I and dI. Therefore derivatives use random
numbers that are independent of those of pictures, even for equal seeds. With these, the gradient of L2 is unbiased. The
gradient of L1 stays biased in pixels whose noise exceeds the difference, since the sign of the difference is then
random. `Huber` and `Charbonnier` have the same bias unless the width below which they are quadratic is well above the
noise of a pixel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._check import array, light_values, number, whole
from .._fields import Check, CheckedAtOnce, by, optional

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
Result = tuple[float, F32]


class Loss(Protocol):
    """Signature of the loss of `edgegrad.fit`."""

    def __call__(self, image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> Result:
        """Return (value, d value / d image)."""
        ...


def l1(image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> Result:
    """Mean absolute difference over pixels and channels, weighted by the mask.

    Parameters
    ----------
    image, target
        (H, W, 3) linear Rec.709.
    mask
        (H, W) weight of each pixel, >= 0; None: all 1.

    Returns
    -------
    The value and the adjoint (H, W, 3) float32. The derivative of |x| at 0 counts as 0.
    """
    difference, weight = _difference(image, target, mask)
    scale = 1.0 / (3.0 * weight.sum())
    value = scale * float((weight[..., None] * np.abs(difference)).sum())
    return value, (scale * weight[..., None] * np.sign(difference)).astype(np.float32)


def l2(image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> Result:
    """Mean squared difference over pixels and channels, weighted by the mask; parameters as for `l1`."""
    difference, weight = _difference(image, target, mask)
    scale = 1.0 / (3.0 * weight.sum())
    weighted = scale * weight[..., None] * difference
    return float((weighted * difference).sum()), (2.0 * weighted).astype(np.float32)


@dataclass(frozen=True)
class Pyramid(CheckedAtOnce):
    """Sum of a loss over an image pyramid. Coarse levels give a gradient even if an edge is many pixels off.

    Each level follows from the one before, beginning with mask * (I - T): a filter [1 2 1]/4 along both axes, then the
    mean over 2 x 2 pixels. This chain is linear, so the adjoint is the transposed chain. The value of a level is
    sum rho(d) / (3 sum mask_level), and the loss is the sum over the levels, weighted by `weights`.

    Attributes
    ----------
    levels
        Number of levels, including the full resolution; None: down to 8 pixels along the shorter side.
    power
        2: rho(d) = d²; 1: rho(d) = |d|.
    focus
        None: all levels have the same weight. Otherwise a position between the coarsest level (0) and the finest
        (1); the weight of a level halves with each level of distance from it.
    """

    levels: int | None = None
    power: int = 2
    focus: float | None = None

    checks: ClassVar[Mapping[str, Check]] = {
        "levels": optional(by(whole, 1, 16)),
        "power": by(whole, 1, 2),
        "focus": optional(by(number, least=0.0, greatest=1.0)),
    }

    def at(self, progress: float) -> Pyramid:
        """Return the loss at the progress in [0, 1] of a fit that goes from coarse to fine."""
        return replace(self, focus=min(max(number("Pyramid.at", "progress", progress), 0.0), 1.0))

    def weights(self, count: int) -> F64:
        """Return (count,) weights of the levels, from fine to coarse; their sum is 1."""
        if self.focus is None:
            return np.full(count, 1.0 / count)
        away = np.abs(np.arange(count) - (1.0 - self.focus) * (count - 1))
        weight = 0.5**away
        return weight / weight.sum()

    def __call__(self, image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> Result:
        difference, weight = _difference(image, target, mask)
        count = self.levels or _automatic_levels(weight.shape)
        level_weight = self.weights(count)
        rho, slope = _RHO[self.power]
        # Planes of the colours and of the weight: neighbours lie side by side in memory
        planes = np.stack([*np.moveaxis(difference, 2, 0) * weight, weight])
        total, slopes, shapes = 0.0, [], []
        for level in range(count):
            if level:
                shapes.append(planes.shape)
                planes = _halve(_halve(planes, 1), 2)
            scale = level_weight[level] / (3.0 * planes[3].sum())
            total += scale * float(rho(planes[:3]).sum())
            slopes.append(scale * slope(planes[:3]))
        adjoint = slopes.pop()
        while slopes:
            height, width = shapes.pop()[1:]
            adjoint = slopes.pop() + _double(_double(adjoint, 2, width), 1, height)
        return total, np.moveaxis(adjoint * weight, 0, 2).astype(np.float32, order="C")


@dataclass(frozen=True)
class Huber(CheckedAtOnce):
    """Mean of the Huber loss: like `l2` for small differences d, like `l1` for large ones, which may be outliers.

    The loss of a channel is d² for |d| <= delta, and delta (2 |d| - delta) beyond.

    Attributes
    ----------
    delta
        Difference from which the loss grows linearly; radiance, > 0. Differences that are to be explained should lie
        below, and outliers, such as a reflection that the scene does not have, above.
    """

    delta: float = 0.1

    checks: ClassVar[Mapping[str, Check]] = {"delta": by(number, above=0.0)}

    def __call__(self, image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> Result:
        difference, weight = _difference(image, target, mask)
        scale = weight[..., None] / (3.0 * weight.sum())
        size = np.abs(difference)
        value = np.where(size <= self.delta, size * size, self.delta * (2.0 * size - self.delta))
        slope = 2.0 * np.clip(difference, -self.delta, self.delta)
        return float((scale * value).sum()), (scale * slope).astype(np.float32)


@dataclass(frozen=True)
class Charbonnier(CheckedAtOnce):
    """Mean of sqrt(d² + epsilon²) - epsilon over the differences d: a smooth `l1`.

    Attributes
    ----------
    epsilon
        Difference below which the loss is about quadratic; radiance, > 0.
    """

    epsilon: float = 0.01

    checks: ClassVar[Mapping[str, Check]] = {"epsilon": by(number, above=0.0)}

    def __call__(self, image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> Result:
        difference, weight = _difference(image, target, mask)
        scale = weight[..., None] / (3.0 * weight.sum())
        value, slope = _charbonnier(difference, self.epsilon)
        return float((scale * value).sum()), (scale * slope).astype(np.float32)


@dataclass(frozen=True)
class Gradients(CheckedAtOnce):
    """Differences of neighbouring pixels, over an image pyramid: edges and texture count, smooth lighting hardly does.

    Each level has the difference D = I - T, averaged over 2 x 2 pixels of the level before with the mask as weights.
    The loss of a level is the mean of rho(D_a - D_b) over pairs of pixels a, b that are neighbours in a row or a
    column; the weight of a pair is the smaller of the two masks. An error that is constant over the picture costs
    nothing, and one that varies slowly costs little.

    Attributes
    ----------
    levels
        Number of levels, including the full resolution; None: down to 8 pixels along the shorter side.
    epsilon
        None: rho(d) = d², whose gradient is unbiased for noisy pictures. Otherwise rho(d) = sqrt(d² + epsilon²) -
        epsilon (`Charbonnier`), which bears edges that the scene does not have.
    """

    levels: int | None = None
    epsilon: float | None = None

    checks: ClassVar[Mapping[str, Check]] = {
        "levels": optional(by(whole, 1, 16)),
        "epsilon": optional(by(number, above=0.0)),
    }

    def __call__(self, image: ArrayLike, target: ArrayLike, mask: ArrayLike | None = None) -> Result:
        difference, weight = _difference(image, target, mask)
        count = self.levels or _automatic_levels(weight.shape)
        total, slopes, chain = 0.0, [], []
        for level in range(count):
            if level:
                chain.append((difference.shape, weight))
                difference, weight = _average(difference, weight)
            value, slope = self._level(difference, weight)
            total += value / count
            slopes.append(slope / count)
        adjoint = slopes.pop()
        while slopes:
            adjoint = slopes.pop() + _average_transposed(adjoint, *chain.pop())
        return total, adjoint.astype(np.float32)

    def _level(self, difference: F64, weight: F64) -> tuple[float, F64]:
        """Return the loss of one level and its derivative by the level's difference."""
        adjoint, total, pairs = np.zeros_like(difference), 0.0, 0.0
        parts = []
        for axis in (0, 1):
            ahead: tuple[Any, ...] = (slice(1, None),) if axis == 0 else (slice(None), slice(1, None))
            behind: tuple[Any, ...] = (slice(None, -1),) if axis == 0 else (slice(None), slice(None, -1))
            both = np.minimum(weight[ahead], weight[behind])
            pairs += 3.0 * float(both.sum())
            parts.append((ahead, behind, both[..., None]))
        if pairs == 0.0:  # one pixel, or pixels without neighbours
            return 0.0, adjoint
        for ahead, behind, both in parts:
            step = difference[ahead] - difference[behind]
            value, slope = (step * step, 2.0 * step) if self.epsilon is None else _charbonnier(step, self.epsilon)
            total += float((both * value).sum()) / pairs
            adjoint[ahead] += both * slope / pairs
            adjoint[behind] -= both * slope / pairs
        return total, adjoint


_Elementwise = Callable[[F64], F64]


def _square(d: F64) -> F64:
    return d * d


def _twice(d: F64) -> F64:
    return 2.0 * d


_RHO: dict[int, tuple[_Elementwise, _Elementwise]] = {1: (np.abs, np.sign), 2: (_square, _twice)}


def _automatic_levels(shape: tuple[int, ...]) -> int:
    return max(1, 1 + int(np.log2(max(min(shape), 1) / 8.0))) if min(shape) >= 8 else 1


def _halve(planes: F64, axis: int) -> F64:
    """Filter by [1 2 1]/4 along an axis, with zeros outside, then average pairs; a zero completes an odd axis."""
    x = np.moveaxis(planes, axis, 0)
    if odd := len(x) % 2:
        x = np.concatenate([x, np.zeros_like(x[:1])])
    out = 3.0 * (x[0::2] + x[1::2])
    out[1:] += x[1:-1:2]
    out[:-1] += x[2::2]
    if odd:
        out[-1] -= x[-2]
    return np.moveaxis(0.125 * out, 0, axis)


def _double(halved: F64, axis: int, length: int) -> F64:
    """Transpose of `_halve`."""
    y = 0.125 * np.moveaxis(halved, axis, 0)
    out = np.empty((2 * len(y), *y.shape[1:]))
    out[0::2] = out[1::2] = 3.0 * y
    out[2::2] += y[:-1]
    out[1:-1:2] += y[1:]
    if length % 2:
        out[-2] -= y[-1]
    return np.moveaxis(out[:length], 0, axis)


def _charbonnier(difference: F64, epsilon: float) -> tuple[F64, F64]:
    """Return sqrt(d² + epsilon²) - epsilon and its derivative."""
    root = np.sqrt(difference * difference + epsilon * epsilon)
    return difference * difference / (root + epsilon), difference / root


def _blocks(x: F64) -> F64:
    """Sum 2 x 2 pixels; zeros complete an odd row or column."""
    if x.shape[0] % 2 or x.shape[1] % 2:
        x = np.pad(x, [(0, x.shape[0] % 2), (0, x.shape[1] % 2), (0, 0)])
    return np.asarray(x[0::2, 0::2] + x[1::2, 0::2] + x[0::2, 1::2] + x[1::2, 1::2])


def _average(difference: F64, weight: F64) -> tuple[F64, F64]:
    """Return the weighted mean of 2 x 2 pixels, 0 without any weight, and their mean weight."""
    total = _blocks(weight[..., None])
    mean = _blocks(weight[..., None] * difference) / np.where(total > 0.0, total, 1.0)
    return mean, 0.25 * total[..., 0]


def _average_transposed(adjoint: F64, shape: tuple[int, ...], weight: F64) -> F64:
    """Transpose of the mean of `_average`, for a difference of this shape and these weights."""
    total = _blocks(weight[..., None])
    spread = np.repeat(np.repeat(adjoint / np.where(total > 0.0, total, 1.0), 2, axis=0), 2, axis=1)
    return np.asarray(weight[..., None] * spread[: shape[0], : shape[1]])


def _difference(image: ArrayLike, target: ArrayLike, mask: ArrayLike | None) -> tuple[F64, F64]:
    a = light_values("loss", "image", image, (None, None, 3), np.float64)
    b = light_values("loss", "target", target, (None, None, 3), np.float64)
    if not a.size:
        raise ValueError(f"loss: image must have the shape (H, W, 3), not {a.shape}")
    if b.shape != a.shape:
        raise ValueError(f"loss: target must have the shape of the image, {a.shape}, not {b.shape}")
    return a - b, _weights(mask, a.shape[:2])


def named(name: str) -> Loss:
    """Return the loss of this name with its default settings.

    Raises
    ------
    ValueError
        If there is none; lists the names.
    """
    if name not in NAMED:
        raise ValueError(f"loss: there is no loss '{name}' (known: {', '.join(NAMED)})")
    return NAMED[name]


def _weights(mask: ArrayLike | None, shape: tuple[int, ...]) -> F64:
    if mask is None:
        return np.ones(shape)
    weight: F64 = array("loss", "mask", mask, shape, np.float64, least=0.0, booleans=True)
    if not weight.any():
        raise ValueError("loss: mask must be above 0 somewhere")
    return weight


NAMED: dict[str, Loss] = {
    "pyramid": Pyramid(),
    "l2": l2,
    "l1": l1,
    "huber": Huber(),
    "charbonnier": Charbonnier(),
    "gradients": Gradients(),
}
