"""The render engine that Blender knows."""

from __future__ import annotations

from typing import Any

import bpy

import edgegrad

from ..operators._common import EXPECTED
from ..problem import sentence
from .final import channels, render_frame
from .settings import ENGINE
from .view import View


class EdgegradEngine(bpy.types.RenderEngine):
    """Renders frames in Blender's render window, and the rendered view of 3D views."""

    bl_idname = ENGINE
    bl_label = "Edgegrad"
    # Icons of materials are rendered by EEVEE, since their scenes are not in the file.
    bl_use_preview = False
    bl_use_eevee_viewport = True  # for the material preview of 3D views
    bl_use_shading_nodes_custom = False  # its materials are those of Cycles and EEVEE
    bl_use_spherical_stereo = False
    bl_use_postprocess = True
    bl_use_custom_freestyle = False

    _of_view: View | None = None

    def update_render_passes(self, scene: Any, renderlayer: Any) -> None:
        """Tell Blender which passes a view layer has."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for one in channels(renderlayer):
            self.register_pass(scene, renderlayer, one.name, len(one.components), one.components, one.kind)

    def render(self, depsgraph: Any) -> None:
        """Render a view layer of a frame."""
        try:
            render_frame(self, depsgraph)
        except edgegrad.Cancelled:
            return
        except EXPECTED as error:
            said = sentence(str(error))
            self.error_set(said)  # for the render window
            self.report({"ERROR"}, said)  # for the operator, which fails with it

    def view_update(self, context: Any, depsgraph: Any) -> None:
        """Read what has changed in a rendered view."""
        self._view().update(context, depsgraph)

    def view_draw(self, context: Any, depsgraph: Any) -> None:
        """Draw a rendered view."""
        self._view().draw(context, depsgraph)

    def _view(self) -> View:
        if self._of_view is None:
            self._of_view = View(self)
        return self._of_view

    def __del__(self) -> None:
        # Python calls this also for engines that it has not made
        view = self.__dict__.get("_of_view")
        if view is not None:
            view.stop()


CLASSES: tuple[Any, ...] = (EdgegradEngine,)
