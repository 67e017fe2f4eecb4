"""Edgegrad: differentiable, physically based rendering of triangle scenes, boundary terms included."""

import sys

from . import calibration, distance_fields
from .expression import procedural
from .fitting import losses, optimisers
from .fitting.checkpoints.checkpoints import Checkpoint, read_checkpoint
from .fitting.fields.schedule import FieldSteps
from .fitting.film.film import Film
from .fitting.fit_step import FitStep
from .fitting.outcome.findings import Finding
from .fitting.outcome.result import FitResult
from .fitting.outcome.uncertainty import Exchange, Uncertainty
from .fitting.scene_fit import fit
from .fitting.targets import Target
from .fitting.vertices.rules import VertexRules
from .planning.scene_plan import Plan, plan
from .reference.simplify import differentiable
from .rendering.one_shot import render, render_backward, render_forward
from .rendering.options import TERMS
from .rendering.progressive import Progressive
from .rendering.renderer import Cancelled, Renderer
from .scene import parameters
from .scene.bounces import Bounces
from .scene.camera import Camera
from .scene.field import Field
from .scene.image import Image
from .scene.light import AreaLight, PointLight, SpotLight, SunLight
from .scene.material import Material, Mixture
from .scene.medium import Medium
from .scene.mesh import Mesh
from .scene.scene import Scene, World

# `import edgegrad.losses` works for each of these modules, whichever package holds its file.
for _module in (losses, optimisers, parameters, procedural):
    sys.modules[f"{__name__}.{_module.__name__.rpartition('.')[2]}"] = _module

__all__ = [
    "TERMS",
    "AreaLight",
    "Bounces",
    "Camera",
    "Cancelled",
    "Checkpoint",
    "Exchange",
    "Field",
    "FieldSteps",
    "Film",
    "Finding",
    "FitResult",
    "FitStep",
    "Image",
    "Material",
    "Medium",
    "Mesh",
    "Mixture",
    "Plan",
    "PointLight",
    "Progressive",
    "Renderer",
    "Scene",
    "SpotLight",
    "SunLight",
    "Target",
    "Uncertainty",
    "VertexRules",
    "World",
    "calibration",
    "differentiable",
    "distance_fields",
    "fit",
    "losses",
    "optimisers",
    "parameters",
    "plan",
    "procedural",
    "read_checkpoint",
    "render",
    "render_backward",
    "render_forward",
]
