"""Warnings about non-finite numbers: dropped samples and non-finite results.

Kernels drop derivative samples whose value is not finite, for example because a radiance overflows, and count them.
This module reports these counts, and searches results for non-finite numbers. Each report is one RuntimeWarning of one
sentence.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..tables.tables import Tables

# Term, number of dropped samples, and the place of the first one: pixel (interior term; else -1), the two vertices of
# the edge, and two faces: the surface or the face of the edge, and the face that intersects it. -1: none.
Dropped = tuple[str, int, int, tuple[int, int], tuple[int, int]]


def warn_of_samples(tables: Tables, dropped: Iterable[Dropped]) -> None:
    """Issue one warning for each term that has dropped samples."""
    for term, count, pixel, vertices, faces in dropped:
        where = _place(tables, pixel, vertices, faces)
        samples = f"{count} samples, of which the first is" if count > 1 else "one sample"
        _warn(f"derivative: the {term} term leaves out {samples} {where}, since the value is not finite")


def warn_of_light(count: int, row: int, column: int) -> None:
    """Issue a warning for light that a picture leaves out; `row` and `column` are its first pixel's."""
    light = f"{count} contributions of light, the first" if count > 1 else "one contribution of light"
    _warn(f"render: the picture leaves out {light} in row {row}, column {column}, since float32 cannot hold the value")


def warn_of_picture(picture: NDArray[np.float32], what: str, terms: Iterable[str] = ()) -> None:
    """Warn if pixels are not finite.

    Parameters
    ----------
    what
        Name of the function that made the picture, such as "render".
    terms
        Names of the terms with non-finite pixels; empty if the picture is not a derivative.
    """
    bad = ~np.isfinite(picture).all(axis=2)
    if bad.any():
        row, column = (int(k) for k in np.argwhere(bad)[0])
        by = _by(terms)
        _warn(f"{what}: {int(bad.sum())} of {bad.size} pixels are not finite{by}, the first in row {row}, "
              f"column {column}")


def warn_of_gradients(gradients: Mapping[str, NDArray[np.float64]], terms: Callable[[str], Iterable[str]]) -> None:
    """Warn of each parameter whose gradient is not finite; `terms` returns the names of the responsible terms."""
    for path, gradient in gradients.items():
        bad = np.argwhere(~np.isfinite(np.atleast_1d(gradient)))
        if len(bad):
            first = ", ".join(str(int(k)) for k in bad[0])
            _warn(f"render_backward: the gradient of '{path}' is not finite at {len(bad)} of {np.size(gradient)} "
                  f"values{_by(terms(path))}, the first at index ({first})")


def _warn(sentence: str) -> None:
    # The stack level points the warning at the caller of the renderer's method.
    warnings.warn(sentence, RuntimeWarning, stacklevel=5)


def _by(terms: Iterable[str]) -> str:
    names = list(terms)
    return f" by the {' and '.join(names)} term{'s' if names[1:] else ''}" if names else ""


def _place(tables: Tables, pixel: int, vertices: Sequence[int], faces: Sequence[int]) -> str:
    """Describe the place of a sample by the names of the scene."""
    surface = _of_mesh(tables, faces[0])
    if pixel >= 0:
        row, column = divmod(pixel, tables.width)
        return f"in row {row}, column {column}, at {surface}"
    if faces[1] >= 0:
        return f"where {surface} and {_of_mesh(tables, faces[1])} intersect"
    if vertices[0] < 0:
        return f"where {surface} intersects a light" if faces[0] >= 0 else "at the border of a light"
    mesh = _mesh_of(tables, faces[0])
    if mesh >= len(tables.mesh_names):
        return f"at the border of {_of_mesh(tables, faces[0])}"
    a, b = (k - int(tables.mesh_first_vertex[mesh]) for k in vertices)
    return f"at the edge between the vertices {a} and {b} of mesh '{tables.mesh_names[mesh]}'"


def _mesh_of(tables: Tables, face: int) -> int:
    return int(np.searchsorted(tables.mesh_first_face, face, side="right")) - 1


def _of_mesh(tables: Tables, face: int) -> str:
    if face < 0:
        return "the world"
    mesh = _mesh_of(tables, face)
    fields = (*tables.mesh_names, *tables.field_names)[mesh:]
    if mesh >= len(tables.mesh_names):
        return f"field '{fields[0]}'" if fields else "an area light"
    return f"face {face - int(tables.mesh_first_face[mesh])} of mesh '{tables.mesh_names[mesh]}'"
