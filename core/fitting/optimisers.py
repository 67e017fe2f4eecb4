"""First-order optimisers. Each holds the state of one parameter; `update` makes one step."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

# A direction whose mean gradient's square is so many times what noise alone would make of it is told by the picture.
CERTAIN = 4.0


@dataclass
class Adam:
    """Adam (Kingma & Ba 2015): every entry has its own step, so it suits colours and powers.

    Attributes
    ----------
    step
        Change of an entry per update, in the parameter's unit, while its gradient keeps its sign.
    beta1, beta2
        Memory of the gradient's mean and of its square, in [0, 1).
    """

    step: float
    beta1: float = 0.9
    beta2: float = 0.999
    count: int = field(default=0, init=False)
    mean: F64 = field(default_factory=lambda: np.zeros(()), init=False)
    square: F64 = field(default_factory=lambda: np.zeros(()), init=False)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0.0):
            raise ValueError(f"{type(self).__name__}: step must be finite and above 0, not {self.step!r}")
        if not (0.0 <= self.beta1 < 1.0 and 0.0 <= self.beta2 < 1.0):
            raise ValueError(f"{type(self).__name__}: beta1 and beta2 must be in [0, 1)")

    def update(self, value: F64, gradient: F64, factor: float = 1.0) -> F64:
        """The next value; `factor` scales the step (a schedule's). A zero gradient history moves nothing."""
        self.count += 1
        self.mean = self.beta1 * self.mean + (1.0 - self.beta1) * gradient
        self.square = self.beta2 * self.square + (1.0 - self.beta2) * gradient**2
        mean = self.mean / (1.0 - self.beta1**self.count)
        root = np.sqrt(self.square / (1.0 - self.beta2**self.count))
        return value - factor * self.step * self._direction(mean, root)

    def _direction(self, mean: F64, root: F64) -> F64:
        # No epsilon, which would tie the result to the loss's unit: where root is 0, mean is 0 too.
        return mean / np.where(root > 0.0, root, 1.0)


@dataclass
class AdamUniform(Adam):
    """Adam with one step size for all entries (Nicolet, Jacobson & Jakob 2021, "Large Steps").

    The mean gradient is divided by the *largest* sqrt(v) of all entries instead of each by its own:
    directions are kept, so that a smooth preconditioned gradient stays smooth and turning the world
    turns the step. `step` is then the largest entry's change per update.
    """

    def _direction(self, mean: F64, root: F64) -> F64:
        largest = float(root.max(initial=0.0))
        return mean / largest if largest > 0.0 else np.zeros_like(mean)


@dataclass
class AdamMatrix(Adam):
    """Adam with the whole matrix of second moments of each row's few entries (Duchi et al. 2011, "full-matrix").

    The mean gradient m becomes V^(-1/2) m with V the running mean of g g^T. What pulls hard, and what pulls weakly but
    is told by the picture too (a camera that moves aside while it turns back), so advance alike, whichever axes they
    are written in. With beta1 = beta2, c_i = q_i.m obeys c_i^2 <= w_i for each eigenvector q_i of V with the
    eigenvalue w_i (Cauchy-Schwarz), so no direction steps further than `step`.

    Made equal, a direction that the picture doesn't tell of (the turn of a ball) would wander by its noise. The mean
    of independent gradients has the share rho of their second moment (Balles & Hennig 2018): directions with
    c_i^2 < rho w_i stay, those beyond `CERTAIN` times that step in full.
    """

    beta2: float = 0.9

    def update(self, value: F64, gradient: F64, factor: float = 1.0) -> F64:
        self.count += 1
        self.mean = self.beta1 * self.mean + (1.0 - self.beta1) * gradient
        self.square = self.beta2 * self.square + (1.0 - self.beta2) * gradient[..., :, None] * gradient[..., None, :]
        size, axes = np.linalg.eigh(self.square / (1.0 - self.beta2**self.count))
        kept = size > 1e-12 * size[..., -1:]
        along = np.einsum("...i,...ij->...j", self.mean / (1.0 - self.beta1**self.count), axes)
        along = np.where(kept, along / np.sqrt(np.where(kept, size, 1.0)), 0.0)
        if self.count > 1:
            left = self.beta1**self.count
            noise = (1.0 - self.beta1) * (1.0 + left) / ((1.0 + self.beta1) * (1.0 - left))
            along *= np.clip((along**2 / noise - 1.0) / (CERTAIN - 1.0), 0.0, 1.0)
        return np.asarray(value - factor * self.step * np.einsum("...j,...ij->...i", along, axes))
