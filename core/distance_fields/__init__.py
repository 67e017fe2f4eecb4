"""Distance fields: from meshes and to meshes, made true distances again, and measures of their smoothness."""

from .isosurface import to_mesh
from .mesh_sampling import from_mesh
from .painting import sampled_attributes
from .redistancing import redistanced
from .regularisers import eikonal, laplacian
from .resampling import refined, resampled
from .surfaces import Topology, chamfer_distance, topology

__all__ = [
    "Topology",
    "chamfer_distance",
    "eikonal",
    "from_mesh",
    "laplacian",
    "redistanced",
    "refined",
    "resampled",
    "sampled_attributes",
    "to_mesh",
    "topology",
]
