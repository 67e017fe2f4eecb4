"""Renders of frames: export, passes of growing samples, and further channels."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..evaluation import Evaluation, active_camera
from ..export.exported import Export
from ..export.geometry.attributes import INDEX
from ..export.scene import BAKE_RESOLUTION, export_evaluated
from ..preferences import threads
from ..problem import sentence
from .passes import ALBEDO, DEPTH, NORMAL, OBJECT_INDEX, alpha_scene, channel, has_alpha

F32 = NDArray[np.float32]

# Passes double their samples until one takes so long, seconds; then the picture is shown at about this interval.
SHOWN_EVERY = 1.0
# A sentence of the export that is not true here: Blender puts the region into the full picture.
_CROPPED = "the picture contains only the render region, as with 'Crop to Render Region'"


@dataclass(frozen=True)
class Channel:
    """A render pass besides the picture.

    Attributes
    ----------
    switch
        Property of the view layer.
    names
        Blender's name from version 5.0 on, and before.
    components, kind
        Letters of its components, and type of the socket in the compositor.
    content
        As for `passes.channel`.
    """

    switch: str
    names: tuple[str, str]
    components: str
    kind: str
    content: str

    @property
    def name(self) -> str:
        """Name of the pass in this version of Blender."""
        return self.names[bpy.app.version < (5, 0, 0)]


CHANNELS = (
    Channel("use_pass_z", ("Depth", "Depth"), "Z", "VALUE", DEPTH),
    Channel("use_pass_normal", ("Normal", "Normal"), "XYZ", "VECTOR", NORMAL),
    Channel("use_pass_object_index", ("Object Index", "IndexOB"), "X", "VALUE", OBJECT_INDEX),
    Channel("use_pass_diffuse_color", ("Diffuse Color", "DiffCol"), "RGB", "COLOR", ALBEDO),
)


def channels(view_layer: Any) -> list[Channel]:
    """List the passes besides the picture that are on in a view layer."""
    return [one for one in CHANNELS if getattr(view_layer, one.switch)]


def unknown_passes(view_layer: Any) -> list[str]:
    """List the names of passes that are on and are not rendered."""
    known = {"use_pass_combined", *(one.switch for one in CHANNELS)}
    return [prop.name for prop in view_layer.bl_rna.properties
            if prop.identifier.startswith("use_pass_") and prop.identifier not in known
            and not prop.identifier.startswith("use_pass_cryptomatte_accurate")
            and getattr(view_layer, prop.identifier)]  # fmt: skip


def render_frame(engine: Any, depsgraph: Any) -> None:
    """Render the view layer of a dependency graph, and give the engine its passes.

    Raises
    ------
    Problem, ValueError, ...
        For what cannot be rendered; the message is one sentence.
    """
    scene, layer = depsgraph.scene, depsgraph.view_layer
    settings = scene.edgegrad_render
    wanted = channels(layer)
    engine.update_stats("", "Exporting")
    export = _export(depsgraph, wanted)
    for line in _warnings(export, layer):
        engine.report({"WARNING"}, sentence(line))
    if engine.test_break():
        return
    picture = _Picture(engine, export, scene, layer, wanted)
    with picture:
        samples, seed = settings.samples, settings.seed
        picture.sample(samples, seed)
        for one in wanted:
            if engine.test_break():
                break
            engine.update_stats("", f"{one.name} pass")
            values = channel(export.scene, one.content, samples, seed, export.settings.bounces, picture.check,
                             threads())
            picture.set(one.name, values)


def _export(depsgraph: Any, wanted: Sequence[Channel]) -> Export:
    scene = depsgraph.scene
    camera = active_camera(scene)
    # Bakes run Blender's operators, which only its main thread may do.
    main = threading.current_thread() is threading.main_thread()
    names = frozenset({INDEX} if any(one.content == OBJECT_INDEX for one in wanted) else ())
    return export_evaluated(Evaluation(scene, camera.original, depsgraph), (), BAKE_RESOLUTION if main else 0,
                            attributes=names)  # fmt: skip


def _warnings(export: Export, layer: Any) -> list[str]:
    lines = [line for line in export.report.lines if not line.endswith(_CROPPED)]
    unknown = unknown_passes(layer)
    if unknown:
        lines.append(f"view layer '{layer.name}': its passes {', '.join(unknown)} are not rendered")
    return lines


class _Picture:
    """The picture of a render in Blender, which grows."""

    def __init__(self, engine: Any, export: Export, scene: Any, layer: Any, wanted: Sequence[Channel]) -> None:
        self._engine, self._export, self._channels = engine, export, wanted
        self._transparent = bool(scene.render.film_transparent)
        height, width = export.scene.camera.size
        self._size = width, height
        self._layer = layer.name
        self._fraction = 0.0, 1.0  # done, and that of the running call

    def __enter__(self) -> None:
        for one in self._channels:
            self._engine.add_pass(one.name, len(one.components), one.components, layer=self._layer)
        self._result = self._engine.begin_result(0, 0, *self._size, layer=self._layer)

    def __exit__(self, *error: object) -> None:
        self._engine.end_result(self._result)

    def check(self, fraction: float) -> None:
        """Cancel if the user has; for calls of `edgegrad`."""
        if self._engine.test_break():
            raise edgegrad.Cancelled
        done, running = self._fraction
        self._engine.update_progress(min(done + fraction * running, 1.0))

    def sample(self, samples: int, seed: int) -> None:
        """Render all samples in passes; show the picture after each of them."""
        scene, settings, count = self._export.scene, self._export.settings, threads()
        of_color = edgegrad.Renderer(scene, threads=count, watched=False)
        color = edgegrad.Progressive(of_color, max_depth=settings.max_depth, bounces=settings.bounces, seed=seed)
        clear = None
        if has_alpha(scene, self._transparent):
            of_alpha = edgegrad.Renderer(alpha_scene(scene, self._transparent), threads=count, watched=False)
            clear = edgegrad.Progressive(of_alpha, max_depth=1, bounces=settings.bounces, seed=seed)
        spp = 1
        while color.samples < samples:
            spp = min(spp, samples - color.samples)
            self._fraction = color.samples / samples, spp / samples
            self._engine.update_stats("", f"Sample {color.samples} of {samples}")
            start = time.monotonic()
            picture = np.empty((*scene.camera.size, 4), np.float32)
            picture[..., :3] = color.add(spp, self.check)
            picture[..., 3] = 1.0 if clear is None else 1.0 - clear.add(spp).mean(axis=2)
            self.set("Combined", picture)
            if time.monotonic() - start < SHOWN_EVERY:
                spp *= 2
        self._fraction = 1.0, 0.0

    def set(self, name: str, values: F32) -> None:
        """Set a pass, row 0 on top, and show it."""
        passes = self._result.layers[0].passes
        found = passes.get(name)
        if found is None:
            return  # of a view that Blender does not keep
        found.rect.foreach_set(np.ascontiguousarray(values[::-1], np.float32).ravel())
        self._engine.update_result(self._result)
