"""Edgegrad: differentiable, physically based rendering of triangle scenes, boundary terms included."""

from .camera import Camera
from .fit import FitResult, FitStep, fit
from .light import AreaLight, PointLight, SunLight
from .material import Material
from .mesh import Mesh
from .plan import Plan, plan
from .render import render, render_backward, render_forward
from .renderer import TERMS, Cancelled, Renderer
from .scene import Scene, World
from .targets import Target

__all__ = [
    "TERMS",
    "AreaLight",
    "Camera",
    "Cancelled",
    "FitResult",
    "FitStep",
    "Material",
    "Mesh",
    "Plan",
    "PointLight",
    "Renderer",
    "Scene",
    "SunLight",
    "Target",
    "World",
    "fit",
    "plan",
    "render",
    "render_backward",
    "render_forward",
]
