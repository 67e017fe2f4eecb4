"""Whether a film fits the targets and the parameters of a fit."""

from __future__ import annotations

from collections.abc import Sequence

from ..._check import instance
from ...scene import parameters
from ...scene.scene import Scene
from ..driven import Driven
from ..targets import View
from .film import Film
from .keyed_parameters import CAMERA


def check_film(film: Film, work: Scene, seen: Sequence[View], paths: Sequence[str], driven: Driven | None) -> None:
    """Check a film.

    Parameters
    ----------
    film, work, seen
        The film, the scene, and the views of the targets.
    paths, driven
        What the fit finds besides the film's keyed parameters.

    Raises
    ------
    ValueError
        If they do not fit together; names the parameter and the cure.
    """
    instance("fit", "film", film, Film)
    film.check_fields("film")
    if len(film.frames) != len(seen):
        raise ValueError(f"film: frames has {len(film.frames)} frames, but there are {len(seen)} targets; give the "
                         "frame of each target")
    for path in film.keyed:
        if driven is not None:
            raise ValueError(f"film: '{path}' is keyed, but the fit has driven variables too; key one of them instead")
        if path in paths:
            raise ValueError(f"film: '{path}' is keyed and in wrt; leave it out of wrt")
        if path.startswith(CAMERA) and any(view.camera is not work.camera for view in seen):
            raise ValueError(f"film: '{path}' is keyed, but a target has a camera of its own; leave the cameras of "
                             "the targets out")
    if any(collection == "fields" for collection, _, _ in map(parameters.split, paths)):
        raise ValueError("film: distance fields can't be fitted to films; fit the field to single pictures")
    if not film.keyed and not paths and driven is None:
        raise ValueError("fit: wrt is empty, and film has no keyed parameter; name at least one parameter path")
