"""The result of a fit."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .findings import Finding
from .uncertainty import Exchange, Uncertainty


@dataclass(frozen=True)
class FitResult:
    """Result of a fit.

    Attributes
    ----------
    values
        Maps a parameter path to the value that the scene has now. Keyed parameters of a film: to (frames, ...) values,
        in the order of `Film.times`; the scene keeps its own.
    losses
        Loss before each step and, unless the fit was cancelled, after the last step and each Newton step.
    best
        Index into `losses` of the best values: those with the smallest smoothed loss. Among values whose losses
        differ by less than the noise, the latest.
    seconds
        Duration of the whole fit.
    cancelled
        Whether the callback or the progress function stopped it.
    untouched
        Maps a parameter path to the fraction of its entries whose gradient was 0 in every iteration: no picture
        depended on these entries. The preconditioner may still have moved such vertices with their neighbours.
    notes
        Sentences that name terms of the derivative which were not computed although they may be non-zero
        (`Plan.missing`), and parameters of which a part has no gradient, with the reason.
    first_gradient
        Gradient of the loss by the driven variables at the start.
    gains
        (3,) factors of the channels by which each target is brighter than the scene: those that were given, or those
        that were found for the best values.
    findings
        Parameters about which the pictures say nothing, and those that a limit holds (`Finding`).
    uncertainty
        Standard errors of the values, if the fit was asked for them (`Uncertainty`).
    exchanges
        Numbers that the pictures determine only together (`Exchange`).
    """

    values: dict[str, Any]
    losses: list[float]
    best: int
    seconds: float
    cancelled: bool
    untouched: dict[str, float]
    notes: tuple[str, ...]
    first_gradient: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    gains: tuple[NDArray[np.float64], ...] = ()
    findings: tuple[Finding, ...] = ()
    uncertainty: tuple[Uncertainty, ...] = ()
    exchanges: tuple[Exchange, ...] = ()
