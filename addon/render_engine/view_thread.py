"""The thread that renders a view. It does not access Blender's data, and Blender does not wait for it."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..export import RenderSettings
from ..operators._common import EXPECTED
from .passes import alpha_scene, has_alpha
from .view_camera import Seen, smaller
from .yielding import rest

F32 = NDArray[np.float32]

# Seconds for one sample of one pixel, before any was measured.
GUESSED = 1e-6
# The first picture of a request has a pixel for so many of the view's, squared.
DIVISORS = (1, 2, 4, 8, 16)
# Passes double their samples until one takes so long, seconds.
PASS_SECONDS = 0.2
# How often a view that rests looks whether it still has to, seconds.
LOOK_SECONDS = 0.1


@dataclass(frozen=True)
class Request:
    """What a view shows.

    Attributes
    ----------
    scene
        Not changed any more.
    seen
        Camera of the picture, in full resolution, and the picture's place in the view.
    film_transparent
        Whether the world is transparent for the camera.
    samples
        Samples per pixel at which the picture is complete.
    threads
        Of the renderer; 0: one per core.
    first_seconds
        A view whose pixels take longer is first rendered with fewer of them.
    """

    scene: edgegrad.Scene
    settings: RenderSettings
    seen: Seen
    film_transparent: bool
    samples: int
    seed: int
    threads: int = 0
    first_seconds: float = 0.02


@dataclass(frozen=True)
class Shown:
    """A picture of a request.

    Attributes
    ----------
    pixels
        (height, width, 4) linear, premultiplied alpha, row 0 at the bottom.
    samples
        Samples per pixel; 0: of fewer pixels than the view has.
    """

    request: Request
    pixels: F32
    samples: int


class ViewThread:
    """Renders the last request, first with few pixels, then with ever more samples."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._request: Request | None = None
        self._served: Request | None = None
        self._shown: Shown | None = None
        self._error: str | None = None
        self._stopped = False
        self._seconds = GUESSED
        self._renderer: edgegrad.Renderer | None = None
        self._threads = 0  # of the renderer
        self._of_alpha: tuple[edgegrad.Scene, int, edgegrad.Renderer] | None = None  # with its threads
        self._thread = threading.Thread(target=self._run, name="edgegrad.view", daemon=True)
        self._thread.start()

    def post(self, request: Request) -> None:
        """Render this request from now on."""
        with self._changed:
            self._request = request
            self._changed.notify_all()

    @property
    def shown(self) -> Shown | None:
        """The last picture, which may be of an earlier request."""
        return self._shown

    @property
    def error(self) -> str | None:
        """Why the last request can't be rendered."""
        return self._error

    def wait(self, request: Request, seconds: float) -> None:
        """Wait until there is a picture of a request, or an error, but not longer than so many seconds."""
        with self._changed:
            self._changed.wait_for(lambda: self._error is not None or (self._shown is not None
                                   and self._shown.request is request), seconds)  # fmt: skip

    def stop(self, seconds: float = 5.0) -> None:
        """End the thread."""
        with self._changed:
            self._stopped = True
            self._changed.notify_all()
        self._thread.join(seconds)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopped or self._request is not self._served)
                if self._stopped:
                    return
                request = self._request
            assert request is not None
            try:
                self._serve(request)
                error = None
            except edgegrad.Cancelled:
                continue
            except (*EXPECTED, RuntimeError, MemoryError) as failure:
                self._renderer = None
                error = str(failure)
            with self._changed:
                self._served, self._error = request, error
                self._changed.notify_all()

    def _serve(self, request: Request) -> None:
        renderer = self._following(request.scene, request.threads)
        if self._error is not None:
            self._error = None
        of_alpha = self._alpha_renderer(request)
        divisor = self._divisor(request)
        # Newer requests do not cancel the first picture, so that there are pictures while the view moves.
        if divisor > 1:
            self._render(request, renderer, of_alpha, divisor, least=1)
        if self._request is request:
            self._render(request, renderer, of_alpha, 1, least=0 if divisor > 1 else 1)

    def _render(self, request: Request, renderer: edgegrad.Renderer, of_alpha: edgegrad.Renderer | None,
                divisor: int, least: int) -> None:  # fmt: skip
        """Render a picture with fewer pixels, or all samples; newer requests cancel it after `least` samples."""
        camera = smaller(request.seen.camera, divisor)
        settings = request.settings
        color = edgegrad.Progressive(renderer, max_depth=settings.max_depth, bounces=settings.bounces,
                                     seed=request.seed, camera=camera)  # fmt: skip
        clear = None
        if of_alpha is not None:
            clear = edgegrad.Progressive(of_alpha, max_depth=1, bounces=settings.bounces, seed=request.seed,
                                         camera=camera)  # fmt: skip

        def check(_: float) -> None:
            if self._stopped or (self._request is not request and color.samples >= least):
                raise edgegrad.Cancelled

        spp = 1
        while color.samples < (request.samples if divisor == 1 else 1):
            spp = min(spp, request.samples - color.samples)
            check(0.0)
            start = time.monotonic()
            pixels = np.empty((*camera.size, 4), np.float32)
            pixels[..., :3] = color.add(spp, check)[::-1]
            pixels[..., 3] = 1.0 if clear is None else 1.0 - clear.add(spp, check)[::-1].mean(axis=2)
            seconds = time.monotonic() - start
            self._learn(seconds, spp * pixels.shape[0] * pixels.shape[1], divisor > 1, request.first_seconds)
            with self._changed:
                self._shown = Shown(request, pixels, color.samples if divisor == 1 else 0)
                self._changed.notify_all()
            if seconds < PASS_SECONDS:
                spp *= 2
            if divisor == 1 and color.samples < request.samples:  # a coarse picture is replaced at once
                self._rest(request, seconds)

    def _rest(self, request: Request, seconds: float) -> None:
        """Rest after a pass that took some seconds, but not while a newer request waits."""
        began = time.monotonic()
        with self._changed:
            while (left := began + rest(seconds) - time.monotonic()) > 0.0:
                if self._changed.wait_for(lambda: self._stopped or self._request is not request,
                                          min(left, LOOK_SECONDS)):  # fmt: skip
                    return

    def _learn(self, seconds: float, paths: int, coarse: bool, budget: float) -> None:
        """Learn the seconds of a path. Those of coarse pictures that were in time are mostly the start of a call."""
        found = seconds / paths
        self._seconds = min(self._seconds, found) if coarse and seconds <= budget else found

    def _divisor(self, request: Request) -> int:
        height, width = request.seen.camera.size
        seconds = self._seconds * width * height
        return next((d for d in DIVISORS if seconds <= request.first_seconds * d * d), DIVISORS[-1])

    def _following(self, scene: edgegrad.Scene, threads: int) -> edgegrad.Renderer:
        """The renderer of the scene: the last one if the scene has the same topology."""
        renderer = self._renderer if threads == self._threads else None
        if renderer is not None and renderer.scene is not scene:
            renderer.scene = scene
            try:
                renderer.update()
            except (ValueError, RuntimeError):  # another topology, or an error that a new renderer tells
                renderer = None
        if renderer is None:
            self._renderer = None  # free its memory first
            renderer = edgegrad.Renderer(scene, threads=threads, watched=False)
        self._renderer, self._threads = renderer, threads
        return renderer

    def _alpha_renderer(self, request: Request) -> edgegrad.Renderer | None:
        """The renderer of the view's transparency; None: everything is opaque."""
        if not has_alpha(request.scene, request.film_transparent):
            self._of_alpha = None
        elif (self._of_alpha is None or self._of_alpha[0] is not request.scene
              or self._of_alpha[1] != request.threads):  # fmt: skip
            self._of_alpha = None  # free its memory first
            clear = alpha_scene(request.scene, request.film_transparent)
            renderer = edgegrad.Renderer(clear, threads=request.threads, watched=False)
            self._of_alpha = request.scene, request.threads, renderer
        return None if self._of_alpha is None else self._of_alpha[2]
