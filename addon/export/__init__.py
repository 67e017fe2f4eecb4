"""Export of the evaluated dependency graph to an `edgegrad.Scene`, with the information to write results back."""

from .camera import export_camera
from .scene import Export, export_scene
from .settings import RenderSettings, render_export

__all__ = ["Export", "RenderSettings", "export_camera", "export_scene", "render_export"]
