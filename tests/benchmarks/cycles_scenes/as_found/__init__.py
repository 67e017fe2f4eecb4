"""Scenes as other people's files have them: imported, untidy, of old versions, from tutorials and kits."""

from __future__ import annotations

from . import (  # noqa: F401  (importing a family registers its cases)
    attributes,
    coarse,
    colors,
    coordinates,
    gltf,
    habits,
    images,
    layers_and_files,
    lights,
    nodes,
    odd_data,
    outputs,
    props,
    rooms,
    scatter,
    settings,
    shaders,
    shots,
    traps,
    tutorials,
    undeformed,
    untidy_bodies,
)
