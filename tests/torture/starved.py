"""A process whose n-th allocation fails: ``python -m tests.torture.starved SCENE CALL FIRST STRIDE``.

It prints, one JSON object a line, how many allocations the call makes, and what became of each attempt. A process
that ends without the last line has crashed in the attempt that it named last.
"""

from __future__ import annotations

import ctypes
import gc
import json
import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import edgegrad
from edgegrad import Renderer, Scene
from tests.support.rich_scene import everything
from tests.support.small_scenes import floating_box

OPTIONS: dict[str, Any] = {"spp": 1, "max_depth": 3, "seed": 1}
# Scenes with the mesh that moves: of every kind of parameter; of a mesh by itself, whose BVH is refitted.
SCENES: dict[str, tuple[Callable[[], Scene], str]] = {"rich": (everything, "moved"), "box": (floating_box, "box")}


class Subject:
    """A renderer and the calls that are tried with it; calls that compute something return its bytes."""

    def __init__(self, scene: str) -> None:
        make, self.mesh = SCENES[scene]
        self.scene = make()
        self.renderer = Renderer(self.scene, threads=2)
        self.path = f"meshes.{self.mesh}.vertices"
        self.adjoint = np.ones((*self.scene.camera.size, 3), np.float32)
        start = self.scene.meshes[self.mesh].vertices
        self.places = [start, start + 0.1]

    def picture(self) -> bytes:
        return self.renderer.render(**OPTIONS).tobytes()

    def gradient(self) -> bytes:
        return self.renderer.render_backward(self.adjoint, [self.path], **OPTIONS)[self.path].tobytes()

    def tangent(self) -> bytes:
        return self.renderer.render_forward({self.path: np.ones(self.places[0].shape)}, **OPTIONS).tobytes()

    def construction(self) -> bytes:
        return Renderer(self.scene, threads=2).render(**OPTIONS).tobytes()

    def one_shot(self) -> bytes:
        return edgegrad.render(self.scene, threads=2, **OPTIONS).tobytes()

    def update(self) -> None:
        """Everything is looked at, with vertices that are elsewhere than before."""
        self.move()
        self.renderer.update()

    def update_named(self) -> None:
        self.move()
        self.renderer.update([self.path])

    def move(self) -> None:
        self.places.reverse()
        self.scene.meshes[self.mesh].vertices = self.places[0].copy()

    @property
    def place(self) -> bytes:
        """The position of the mesh."""
        return self.scene.meshes[self.mesh].vertices.tobytes()


COMPUTING = ("picture", "gradient", "tangent", "construction", "one_shot")
CHANGING = ("update", "update_named")


def say(**line: Any) -> None:
    print(json.dumps(line), flush=True)


def attempt(call: Callable[[], bytes | None], shim: ctypes.CDLL, n: int) -> str:
    """Run a call whose n-th allocation fails; return "done", or the type of the error."""
    try:
        shim.arm(n)
        call()
        return "done"
    except Exception as error:
        shim.disarm()
        return f"{type(error).__name__}: {error}"
    finally:
        shim.disarm()


def main() -> None:
    subject = Subject(sys.argv[1])
    call, first, stride = getattr(subject, sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    warnings.simplefilter("ignore")
    shim = ctypes.CDLL(None)
    shim.disarm.restype = ctypes.c_long
    shim.arm.argtypes = [ctypes.c_long]
    pictures: dict[bytes, bytes] = {}
    for _ in range(4):  # at both places, and so that all is there that is made once and kept
        call()
        pictures[subject.place] = subject.picture()
    gc.disable()
    shim.arm(0)
    expected = call()
    count = shim.disarm()
    say(count=count)
    for n in range(first, count + 1, stride):
        say(n=n)
        outcome = attempt(call, shim, n)
        # A failed change has been made or not, and can be made again. The renderer has not taken it over, so that its
        # pictures, with whichever vertices it has, would be refused.
        subject.renderer.watched = False
        usable = subject.picture() in pictures.values()
        subject.renderer.watched = True
        usable = usable and (expected is None or call() == expected)
        subject.renderer.update()
        usable = usable and subject.picture() == pictures[subject.place]
        say(n=n, outcome=outcome, usable=usable)
    say(end=True)


if __name__ == "__main__":
    main()
