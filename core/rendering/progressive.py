"""A picture that is rendered in several calls, each of which adds samples to those before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._check import whole
from ..scene.bounces import Bounces
from ..scene.camera import Camera
from .options import MOST_SAMPLES, Progress, checked_options
from .renderer import Renderer


class Progressive:
    """The picture of a renderer's scene, which becomes less noisy with each call of `add`.

    The samples of all calls together are those of one render, so that the last picture has the bits of
    ``renderer.render(spp=samples)``, however the samples are divided.

    Parameters
    ----------
    renderer
        Its scene must not change between the calls.
    max_depth, seed, bounces, camera
        As for `Renderer.render`.

    Attributes
    ----------
    samples
        Samples per pixel so far.
    """

    def __init__(self, renderer: Renderer, *, max_depth: int = 2, seed: int = 0, bounces: Bounces | None = None,
                 camera: Camera | None = None) -> None:  # fmt: skip
        self._options = checked_options(1, max_depth, seed, bounces)
        self._renderer, self._camera = renderer, camera
        height, width = (renderer.scene.camera if camera is None else camera).size
        self._sums = np.zeros((height, width, 3))
        self._failed = False
        self.samples = 0

    def add(self, spp: int, progress: Progress | None = None) -> NDArray[np.float32]:
        """Render `spp` further samples per pixel.

        Returns
        -------
        (height, width, 3) float32: the mean of all samples so far, as from `edgegrad.render`.

        Raises
        ------
        RuntimeError
            After a call that was cancelled or failed, of which some pixels have samples and others have not.
        """
        spp = whole("progressive", "spp", spp, 1, MOST_SAMPLES - self.samples)
        if self._failed:
            raise RuntimeError("progressive: a call was cancelled or failed before; begin a new picture")
        self._failed = True  # until the samples of all pixels are there
        picture = self._renderer.add_samples(self._sums, self.samples, spp, self._options, self._camera, progress)
        self.samples += spp
        self._failed = False
        return picture
