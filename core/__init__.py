"""Edgegrad: differentiable, physically based rendering of triangle scenes, boundary terms included."""

from .camera import Camera
from .light import AreaLight, PointLight, SunLight
from .material import Material
from .mesh import Mesh
from .render import render, render_backward, render_forward
from .renderer import TERMS, Cancelled, Renderer
from .scene import Scene, World

__all__ = [
    "TERMS",
    "AreaLight",
    "Camera",
    "Cancelled",
    "Material",
    "Mesh",
    "PointLight",
    "Renderer",
    "Scene",
    "SunLight",
    "World",
    "render",
    "render_backward",
    "render_forward",
]
