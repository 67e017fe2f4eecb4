"""Lines in the 3D views that show the shapes which a running fit has reached; nothing in the file changes."""

from __future__ import annotations

import time
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..status import redraw
from .fit_job import FitJob
from .job import Job

# Seconds between two updates, and how much longer than its making they must be apart.
UPDATE_SECONDS, SHARE = 0.5, 10.0
WIDTH = 1.0


class _Drawn:
    handler: Any = None
    batch: Any = None
    iteration = 0
    due = 0.0
    scene = 0  # session_uid of that of the fit
    edges: dict[str, NDArray[np.int32]] = {}  # noqa: RUF012  one object, emptied by `remove`


def begin(scene: Any) -> None:
    """Draw in this scene's views only: other windows may show other scenes."""
    _Drawn.scene = scene.session_uid


def is_drawn_in(scene: Any) -> bool:
    """Whether views of a scene show the lines."""
    return _Drawn.handler is not None and bool(scene.session_uid == _Drawn.scene)


def update(job: Job) -> None:
    """Draw the present shapes, if it is time and the user wants it."""
    if not isinstance(job, FitJob):
        return
    wanted = not bpy.app.background and bpy.context.scene.edgegrad.show_shapes
    if job.session.field is not None:
        job.session.field.live = wanted
    if not wanted or job.step is None or job.step.iteration == _Drawn.iteration:
        return
    began = time.monotonic()
    if began < _Drawn.due:
        return
    import gpu
    from gpu_extras.batch import batch_for_shader

    _Drawn.iteration = job.step.iteration
    points, lines, start = [], [], 0
    for name, vertices in job.shapes().items():
        if name not in _Drawn.edges:
            _Drawn.edges[name] = edges_of(job.session.export.scene.meshes[name].faces)
        points.append(vertices)
        lines.append(_Drawn.edges[name] + start)
        start += len(vertices)
    surface = None if job.session.field is None else job.session.field.newest
    if surface is not None:
        points.append(surface.vertices)
        lines.append(edges_of(surface.faces) + start)
    if not points:
        return
    _Drawn.batch = batch_for_shader(gpu.shader.from_builtin("UNIFORM_COLOR"), "LINES",
                                    {"pos": np.concatenate(points).astype(np.float32)},
                                    indices=np.concatenate(lines).astype(np.int32))  # fmt: skip
    if _Drawn.handler is None:
        _Drawn.handler = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
    ended = time.monotonic()
    _Drawn.due = ended + max(UPDATE_SECONDS, SHARE * (ended - began))
    redraw(all_regions=True)


def remove() -> None:
    """Stop drawing."""
    if _Drawn.handler is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_Drawn.handler, "WINDOW")
    _Drawn.handler = _Drawn.batch = None
    _Drawn.iteration, _Drawn.due = 0, 0.0
    _Drawn.edges.clear()


def edges_of(faces: Any) -> NDArray[np.int32]:
    """(m, 2) edges of triangles, each once."""
    sides = np.concatenate([np.asarray(faces)[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    return np.unique(np.sort(sides, axis=1), axis=0).astype(np.int32)


def _draw() -> None:
    if not is_drawn_in(bpy.context.scene):
        return
    import gpu

    theme = bpy.context.preferences.themes[0].view_3d
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.bind()
    shader.uniform_float("color", (*theme.object_active, 0.8))
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.line_width_set(WIDTH)
    _Drawn.batch.draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")
