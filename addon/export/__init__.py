"""Export of what a render shows to an `edgegrad.Scene`, with the information to write results back."""

from .exported import Export
from .scene import export_scene
from .surroundings.settings import RenderSettings, render_export

__all__ = ["Export", "RenderSettings", "export_scene", "render_export"]
