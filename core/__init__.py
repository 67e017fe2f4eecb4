"""Edgegrad: differentiable, physically based rendering of triangle scenes, boundary terms included."""

from .bounces import Bounces
from .camera import Camera
from .differentiable import differentiable
from .fit import FitResult, fit
from .fit_run import FitStep
from .image import Image
from .light import AreaLight, PointLight, SpotLight, SunLight
from .material import Material, Mixture
from .mesh import Mesh
from .plan import Plan, plan
from .render import render, render_backward, render_forward
from .render_options import TERMS
from .renderer import Cancelled, Renderer
from .scene import Scene, World
from .targets import Target

__all__ = [
    "TERMS",
    "AreaLight",
    "Bounces",
    "Camera",
    "Cancelled",
    "FitResult",
    "FitStep",
    "Image",
    "Material",
    "Mesh",
    "Mixture",
    "Plan",
    "PointLight",
    "Renderer",
    "Scene",
    "SpotLight",
    "SunLight",
    "Target",
    "World",
    "differentiable",
    "fit",
    "plan",
    "render",
    "render_backward",
    "render_forward",
]
