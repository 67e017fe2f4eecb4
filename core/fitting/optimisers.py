"""First-order optimisers. Each object holds the state of one parameter; `update` makes one step."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .checkpoints.resumable import Resumable

F64 = NDArray[np.float64]

# `AdamMatrix` makes full steps along a direction if the squared mean gradient is this many times the value expected
# from noise alone. A larger value suppresses more noise, and slows directions with a weak gradient.
CERTAIN = 4.0


@dataclass
class Adam(Resumable):
    """Adam (Kingma & Ba 2015). Every entry has its own step size, which suits colours and powers.

    Attributes
    ----------
    step
        Change of an entry per update, in the unit of the parameter, as long as its gradient keeps its sign.
    beta1, beta2
        Decay rates of the running mean of the gradient and of its square, in [0, 1).
    """

    step: float
    beta1: float = 0.9
    beta2: float = 0.999
    count: int = field(default=0, init=False)
    mean: F64 = field(default_factory=lambda: np.zeros(()), init=False)
    square: F64 = field(default_factory=lambda: np.zeros(()), init=False)

    changing: ClassVar[tuple[str, ...]] = ("count", "mean", "square")

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0.0):
            raise ValueError(f"{type(self).__name__}: step must be finite and above 0, not {self.step!r}")
        if not (0.0 <= self.beta1 < 1.0 and 0.0 <= self.beta2 < 1.0):
            raise ValueError(f"{type(self).__name__}: beta1 and beta2 must be in [0, 1), not {self.beta1!r} "
                             f"and {self.beta2!r}")

    def update(self, value: F64, gradient: F64, factor: float = 1.0) -> F64:
        """Return the next value. `factor` scales the step, for schedules. Entries without a gradient so far stay."""
        self.count += 1
        self.mean = self.beta1 * self.mean + (1.0 - self.beta1) * gradient
        self.square = self.beta2 * self.square + (1.0 - self.beta2) * gradient**2
        mean = self.mean / (1.0 - self.beta1**self.count)
        root = np.sqrt(self.square / (1.0 - self.beta2**self.count))
        return value - factor * self.step * self._direction(mean, root)

    def _direction(self, mean: F64, root: F64) -> F64:
        # No epsilon: it would make the result depend on the unit of the loss. If root is 0, mean is 0 too.
        return mean / np.where(root > 0.0, root, 1.0)


@dataclass
class AdamUniform(Adam):
    """Adam with one step size for all entries (Nicolet, Jacobson & Jakob 2021, "Large Steps").

    The mean gradient is divided by the *largest* sqrt(v) of all entries, instead of each entry by its own. This keeps
    the direction of the gradient: a smooth preconditioned gradient stays smooth, and a rotation of the scene rotates
    the step. `step` is the change of the largest entry per update.
    """

    def _direction(self, mean: F64, root: F64) -> F64:
        largest = float(root.max(initial=0.0))
        return mean / largest if largest > 0.0 else np.zeros_like(mean)


@dataclass
class AdamMatrix(Adam):
    """Adam with the whole matrix of second moments of each row's few entries (Duchi et al. 2011, "full-matrix").

    The step is V^(-1/2) m, with the mean gradient m and the running mean V of g g^T. Directions with a large and with a
    small gradient then advance equally, in any coordinate system. An example of the latter is a camera that moves
    sideways while it turns back. For beta1 = beta2 and each eigenvector q_i of V with the eigenvalue w_i, c_i = q_i.m
    obeys c_i^2 <= w_i by Cauchy-Schwarz, so no direction exceeds `step`.

    Both means remember fewer gradients than Adam's. An object that is off sideways is also pulled in depth, by a
    gradient that ends once it is in place. m and V^(1/2) forget this pull equally fast, so a longer memory would carry
    the object on in depth at nearly full steps.

    Without a further rule, a direction that does not change the picture (the rotation of a ball) would follow its
    noise. If the gradients are pure noise, the expectation of c_i^2 is rho w_i, with rho given by beta1 and the number
    of steps (Balles & Hennig 2018). Hence directions with c_i^2 < rho w_i do not move, and directions with
    c_i^2 > `CERTAIN` rho w_i make full steps.
    """

    beta1: float = 0.8
    beta2: float = 0.8

    def update(self, value: F64, gradient: F64, factor: float = 1.0) -> F64:
        self.count += 1
        self.mean = self.beta1 * self.mean + (1.0 - self.beta1) * gradient
        self.square = self.beta2 * self.square + (1.0 - self.beta2) * gradient[..., :, None] * gradient[..., None, :]
        size, axes = np.linalg.eigh(self.square / (1.0 - self.beta2**self.count))
        kept = size > 1e-12 * size[..., -1:]
        projected = np.einsum("...i,...ij->...j", self.mean / (1.0 - self.beta1**self.count), axes)
        projected = np.where(kept, projected / np.sqrt(np.where(kept, size, 1.0)), 0.0)
        if self.count > 1:
            left = self.beta1**self.count
            noise = (1.0 - self.beta1) * (1.0 + left) / ((1.0 + self.beta1) * (1.0 - left))
            projected *= np.clip((projected**2 / noise - 1.0) / (CERTAIN - 1.0), 0.0, 1.0)
        return np.asarray(value - factor * self.step * np.einsum("...j,...ij->...i", projected, axes))
