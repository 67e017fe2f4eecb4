"""Proposals to carve matter out of a distance field, or to add matter, from what the pictures show.

A derivative moves a surface. It does not open a hole through thick matter, and it does not begin a new part: there is
no surface yet that could move. The *topological derivative* is the change of the loss when matter vanishes at a place,
or appears. For a ray that hits the field, this is a difference of two values: the ray would show what lies behind the
field in the place of the field. Both are rendered: a picture I of the scene, and a picture B in which cameras do not
see the field. With the target T, (I - T)^2 - (B - T)^2 is what the ray gains if nothing of the field is left on it.

A ray is *empty* if it shows the field, but the target shows what is behind the field. All matter on the ray must go.
One such view is enough, whatever the others show: the view sees along the whole ray.
A ray is *filled* if the target differs from what is behind, and *missing* if it is filled but shows no field. Matter
may appear at a place that is on a missing ray of some view and on filled rays of all views that see it.

Squares of differences are products of two independent renders, (I1 - T) (I2 - T), so that noise does not add to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...geometry.camera_view import depths, in_picture, pixel_widths, pixels
from ...geometry.labels import connected
from ...scene.camera import PANORAMAS, Camera

F64 = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Largest side, in pixels, of the pictures that decide. Larger ones are averaged over blocks first.
_MOST_SIDE = 160
# A ray shows the field if |I - B|^2 is more than this part of its typical value where the field is seen.
_SEEN = 0.1
# With T = B + a (I - B), a ray is empty for a below 1/4: (I - T)^2 - (B - T)^2 > |I - B|^2 / 2. Besides, (B - T)^2 must
# be small.
_GAIN, _LEFT = 0.5, 0.25
# In some pixel of each connected region of empty rays it must be smaller, since T equals B there: below a part of
# |I - B|^2, or not much above what is usual beside the field, if B itself differs from the target. Else a field whose
# colours are not yet known would be carved where its true colour is near that of what is behind.
_SAME, _BESIDE = 0.02, 9.0
# A ray is filled if (B - T)^2 is more than this part of the typical |I - B|^2.
_FILLED = 0.25


@dataclass(frozen=True)
class Evidence:
    """What the target of one view says about the field.

    Attributes
    ----------
    camera
        Camera of the view.
    block
        Side, in pixels of the picture, of the entries of the arrays.
    empty, filled, missing
        (h, w) distances from the borders of these regions, in entries; negative inside. `filled` counts parts of the
        picture about which nothing is known as filled.
    """

    camera: Camera
    block: int
    empty: F64
    filled: F64
    missing: F64


def evidence(
    camera: Camera, target: NDArray[np.float32], mask: F64 | None, shown: Sequence[NDArray[np.float32]],
    hidden: Sequence[NDArray[np.float32]],
) -> Evidence:
    """Decide about the rays of one view.

    Parameters
    ----------
    camera, target, mask
        The view.
    shown, hidden
        Two independent renders each: of the scene, and of the scene whose field cameras do not see.
    """
    block = -(-max(camera.size) // _MOST_SIDE)
    weight = np.ones(camera.size) if mask is None else mask
    total = _averaged(weight[..., None], block)[..., 0]
    known = total > 0.5 * float(total.max())

    def product(a: NDArray[np.floating], b: NDArray[np.floating]) -> F64:
        summed = _averaged(weight[..., None] * a * b, block).sum(axis=-1)
        return np.asarray(summed / np.where(known, total, 1.0))

    goal = np.asarray(target, np.float64)
    with_field = product(shown[0] - goal, shown[1] - goal)
    without = product(hidden[0] - goal, hidden[1] - goal)
    contrast = product(shown[0].astype(np.float64) - hidden[0], shown[1].astype(np.float64) - hidden[1])
    positive = np.where(known, np.maximum(contrast, 0.0), 0.0)
    typical = float((positive**2).sum() / max(positive.sum(), 1e-300))
    seen = contrast > _SEEN * typical
    # Where the field is not seen, the target shows how well B is known.
    beside = without[known & ~seen]
    unknown = _BESIDE * float(np.median(np.abs(beside))) if len(beside) else np.inf
    like_behind = without < np.maximum(_SAME * contrast, unknown)
    region = parts(known & seen & (with_field - without > _GAIN * contrast) & (without < _LEFT * contrast))
    empty = (region >= 0) & np.isin(region, region[like_behind])
    filled = without > _FILLED * typical
    missing = known & filled & ~seen if typical > 0.0 else np.zeros_like(known)
    return Evidence(camera, block, signed_distance(empty), signed_distance(filled | ~known), signed_distance(missing))


def carved(values: F64, points: F64, scale: float, views: Sequence[Evidence]) -> F64:
    """Values at points of a field from which the matter on empty rays is gone.

    Parameters
    ----------
    values
        (n,) distances of the points, negative inside.
    points
        (n, 3) places in the world.
    scale
        Length in the world of a unit of the field's own space.
    views
        Evidence of all views.
    """
    out = np.array(values)
    for view in views:
        seen, distance = _at(view.empty, view, points, scale)
        out[seen] = np.maximum(out[seen], -distance)
    return out


def added(values: F64, points: F64, scale: float, views: Sequence[Evidence]) -> F64:
    """Values at points of a field with matter where the pictures miss it; parameters as for `carved`."""
    filled, missing = np.full(len(points), -np.inf), np.full(len(points), np.inf)
    for view in views:
        seen, distance = _at(view.filled, view, points, scale)
        filled[seen] = np.maximum(filled[seen], distance)
        seen, distance = _at(view.missing, view, points, scale)
        missing[seen] = np.minimum(missing[seen], distance)
    return np.minimum(values, np.maximum(filled, missing))


def parts(inside: Flags) -> NDArray[np.int64]:
    """Number of the connected part of each node or pixel inside; -1 outside. They are connected along the axes."""
    index = np.arange(inside.size).reshape(inside.shape)
    start, end = [], []
    for axis in range(inside.ndim):
        within, at = np.moveaxis(inside, axis, 0), np.moveaxis(index, axis, 0)
        both = within[:-1] & within[1:]
        start.append(at[:-1][both])
        end.append(at[1:][both])
    label = connected(np.concatenate(start), np.concatenate(end), inside.size)
    out = np.full(inside.shape, -1, np.int64)
    out[inside] = np.unique(label[inside.ravel()], return_inverse=True)[1].reshape(-1)
    return out


def _at(region: F64, view: Evidence, points: F64, scale: float) -> tuple[NDArray[np.int64], F64]:
    """The points that a view may see, and how far they are from the border of a region, in the field's own space.

    A region of the picture is a cone in space. Its distance is that in the picture, times the width of a pixel there.
    """
    camera = view.camera
    if camera.kind in PANORAMAS:
        return np.zeros(0, np.int64), np.zeros(0)
    seen = np.flatnonzero(in_picture(camera, points))
    points = points[seen]
    place = (pixels(camera, points) - camera.window[:2]) / view.block - 0.5
    high = np.array(region.shape[::-1]) - 1
    place = np.clip(place, 0.0, high)
    low = np.minimum(place.astype(np.int64), np.maximum(high - 1, 0))
    right, below = np.minimum(low + 1, high).T
    u, v = (place - low).T
    x, y = low.T
    distance = ((1.0 - v) * ((1.0 - u) * region[y, x] + u * region[y, right])
                + v * ((1.0 - u) * region[below, x] + u * region[below, right]))  # fmt: skip
    return seen, distance * view.block * pixel_widths(camera, depths(camera, points)) / scale


def signed_distance(region: Flags) -> F64:
    """(h, w) distance of each pixel's centre from the border of a region of pixels, in pixels; negative inside."""
    most = float(sum(region.shape))
    return np.minimum(_distance(region, most) - 0.5, most) * ~region - (_distance(~region, most) - 0.5) * region


def _distance(region: Flags, most: float) -> F64:
    """(h, w) exact distance to the nearest pixel of a region; `most` if the region has none."""
    rows = np.where(region, 0.0, most)
    for y in range(1, len(rows)):
        rows[y] = np.minimum(rows[y], rows[y - 1] + 1.0)
    for y in range(len(rows) - 2, -1, -1):
        rows[y] = np.minimum(rows[y], rows[y + 1] + 1.0)
    x = np.arange(region.shape[1], dtype=np.float64)
    across = (x[:, None] - x) ** 2
    return np.minimum(np.sqrt(np.stack([(row**2 + across).min(axis=1) for row in rows])), most)


def _averaged(picture: F64, block: int) -> F64:
    """Means over blocks of pixels, each then averaged with its neighbours by [1 2 1]/4 along both axes."""
    h, w, channels = picture.shape
    padded = np.pad(picture, [(0, -h % block), (0, -w % block), (0, 0)])
    found = padded.reshape(padded.shape[0] // block, block, padded.shape[1] // block, block, channels).mean(axis=(1, 3))
    for axis in (0, 1):
        moved = np.moveaxis(np.pad(found, [(1, 1) if a == axis else (0, 0) for a in range(3)], mode="edge"), axis, 0)
        found = np.moveaxis(0.25 * moved[:-2] + 0.5 * moved[1:-1] + 0.25 * moved[2:], 0, axis)
    return found
