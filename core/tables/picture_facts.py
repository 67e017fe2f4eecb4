"""The facts by which an engine skips work in pictures of a scene."""

from __future__ import annotations

from typing import NamedTuple


class PictureFacts(NamedTuple):
    """Facts of an engine's scene (native/engine/decisions/picture_facts.h).

    Attributes
    ----------
    triangles, instances
        Triangles of the meshes, and instances that are traced in place.
    transparent, glossy, refracting
        Whether some closure transmits light unscattered, has microfacets, or refracts.
    lambertian
        Whether all closures are Lambertian.
    flat
        Whether no shading normals are interpolated or mapped.
    material_rows
        Materials of visible faces and fields, as indices in the scene's order.
    emissive_triangles, sampled_rows
        The sampled lights: number of triangles, and lights of the scene, as indices in its order.
    environment, environment_image
        Whether the environment emits light, and whether it is an image.
    media
        Whether some medium scatters or absorbs light.
    """

    triangles: int
    instances: int
    transparent: bool
    lambertian: bool
    glossy: bool
    refracting: bool
    flat: bool
    material_rows: tuple[int, ...]
    emissive_triangles: int
    sampled_rows: tuple[int, ...]
    environment: bool
    environment_image: bool
    media: bool = False
