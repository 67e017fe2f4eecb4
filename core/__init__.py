"""Edgegrad: differentiable, physically based rendering of triangle scenes, boundary terms included."""

from .camera import Camera
from .light import AreaLight, PointLight, SunLight
from .material import Material
from .mesh import Mesh
from .scene import Scene, World

__all__ = ["AreaLight", "Camera", "Material", "Mesh", "PointLight", "Scene", "SunLight", "World"]
