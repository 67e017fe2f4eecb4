"""Blender as the owner of a fit's variables: it is evaluated with their values, and what it exports follows.

Each evaluation starts a render of the private engine, sets the values, exports, exports again beside each value, and
sets back what the file has, so that nothing in the file differs while a fit runs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, ClassVar

import bpy
import numpy as np

from edgegrad import VertexRules
from edgegrad.derivatives.table_derivatives import without_derivative
from edgegrad.fitting.control_vertices import ControlVertices
from edgegrad.fitting.driven import Numbers, Placement, Variable
from edgegrad.fitting.fit_step import effect
from edgegrad.fitting.vertices.cage import Cage
from edgegrad.rendering.engine import engine_class
from edgegrad.scene.changes import StructureChange
from edgegrad.scene.parameters import owner

from ..evaluation import Evaluation, evaluate
from ..export import Export
from ..export.geometry.memory import Memory
from ..export.geometry.mesh import positions
from ..export.scene import export_evaluated
from ..problem import Problem
from ..write_back.held import Held
from .arrays import CAMERA, F64, Key, moved, value_of
from .control_mesh import ControlMesh, LinearMap
from .data_path import restored
from .parameter import Parameter, Wanted, analyse, found
from .quotients import NoEffect, Prober, Quotient, Step

# How often a step that changes the topology is halved before it is left out.
SHORTENED = 4
# Placements after which the steps are checked again.
CHECK_EVERY = 20


@dataclass(frozen=True)
class Placed(Placement):
    """A placement, with the difference quotients of each variable's numbers."""

    columns: Mapping[str, Sequence[Quotient]] = field(default_factory=dict)


class Driver:
    """The properties of a fit (`edgegrad.fitting.driven.Driven`).

    Parameters
    ----------
    scene, cameras
        Blender's scene, and the camera objects of the pictures.
    wanted
        The properties to fit.
    controls
        Names of the objects whose vertices, under their modifiers, are fitted.
    vertices
        Makes the variable of the vertices of a control mesh.

    Attributes
    ----------
    notes
        Sentences on properties that were dropped, and on what they move without a derivative.

    Raises
    ------
    Problem
        For properties that do not exist, cannot be set, change nothing at all, or change more than float arrays.
    """

    # Whether each frame may have its own values, which are written as keys.
    film: ClassVar[bool] = False

    def __init__(
        self, scene: Any, cameras: Sequence[Any], wanted: Sequence[Wanted], controls: Sequence[str] = (),
        vertices: Callable[[ControlMesh], Variable] | None = None,
    ) -> None:
        if engine_class("auto").narrow:
            raise Problem("properties can't be fitted by the reference engine; install the native one")
        self.scene, self.cameras = scene, list(cameras)
        self._held = [Held.of("scenes", scene), *(Held.of("objects", camera) for camera in cameras)]
        self.notes: list[str] = []
        self.parameters = found(wanted, self.film)
        self.controls = [ControlMesh(name) for name in controls]
        self._memory = Memory()
        self._memory.without_normals = {name for name in controls if not bpy.data.objects[name].data.has_custom_normals}
        self._control_paths: dict[str, str] = {}
        self._placements = 0
        self._moving: set[Key] = set()  # arrays that some placement has changed
        self._start: Export | None = None
        self._last: dict[str, F64] = {}
        self._before: dict[str, Any] = {}  # the state before the last placement
        evaluate(scene, self._analyse, cameras[0])
        self.parameters = [one for one in self.parameters if one.places]
        if not self.parameters and wanted:
            raise Problem(f"no property has an effect: {'; '.join(self.notes)}")
        self.variables: list[Numbers | Variable] = [one.variable() for one in self.parameters]
        self.variables += [(vertices or control_variable)(one) for one in self.controls]

    @property
    def without_normals(self) -> list[str]:
        """Names of the exported meshes whose normals follow from their vertices."""
        assert self._start is not None
        return [name for name in self._start.scene.meshes if name in self._memory.without_normals]

    def place(self, values: Mapping[str, F64], views: Sequence[int] | None = None) -> Placed:
        """Evaluate Blender with these values, and return what follows; the file's own values are set back.

        One evaluation shows all cameras, so `views` has no effect.
        """
        self._begin_placement()
        return evaluate(self.scene, lambda evaluation: self._place(evaluation, values), self.cameras[0])

    def look(self, values: Mapping[str, F64]) -> Placed | None:
        """Evaluate Blender with these values, without derivatives; None if the structure differs."""
        self.renew()

        def work(evaluation: Evaluation) -> Placed | None:
            assert self._start is not None
            with self._kept():
                self._set(values)
                try:
                    export = self._export(evaluation)
                    changed = set(moved(self._start, export))
                except StructureChange:
                    return None
                now = {one.path: one.read() for one in self._owned}
                self._moving |= changed
                return _placement(export, now, {}, {}, self._moving, len(self.cameras))

        return evaluate(self.scene, work, self.cameras[0])

    def _begin_placement(self) -> None:
        """Find all datablocks again, and keep the state before this placement."""
        self.renew()
        self._before = {
            "placements": self._placements,
            "last": self._last,
            "steps": {one.path: [[step.size, step.change, step.error] for step in one.steps]
                      for one in self.parameters},
            "notes": list(self.notes),
        }  # fmt: skip
        self._placements += 1

    def renew(self) -> None:
        """Find all datablocks again, after changes of their names or an undo; raise `Problem` if one was removed."""
        self.scene, *self.cameras = [held.get() for held in self._held]
        for one in self._owned:
            one.renew()

    def state(self) -> dict[str, Any]:
        """Return the state before the last placement (`edgegrad.fitting.driven.Driven`)."""
        return self._before

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `state` has returned."""
        self._placements, self._last, self.notes = state["placements"], dict(state["last"]), list(state["notes"])
        for one in self.parameters:
            one.steps = [Step(*step) for step in state["steps"][one.path]]

    def export_at(self, values: Mapping[str, F64]) -> Export:
        """Export the scene with these values; the file's own values are set back."""

        def work(evaluation: Evaluation) -> Export:
            with self._kept():
                self._set(values)
                return self._export(evaluation)

        return evaluate(self.scene, work, self.cameras[0])

    def sensitivities(self, gradient: Mapping[str, F64]) -> dict[str, float]:
        """Change of the loss by the first step of each parameter, relative to the largest one."""
        found = {one.path: effect(one, gradient[one.path]) for one in self.variables if one.path in gradient}
        return relative(found)

    # ---- within an evaluation ----
    @property
    def _owned(self) -> list[Parameter | ControlMesh]:
        return [*self.parameters, *self.controls]

    def _export(self, evaluation: Evaluation) -> Export:
        evaluation.depsgraph.update()
        return export_evaluated(evaluation, self.cameras[1:], memory=self._memory)

    def _analyse(self, evaluation: Evaluation) -> None:
        self._start = self._export(evaluation)
        prober = Prober(lambda: self._export(evaluation), self._start)
        with self._kept():
            quotients = [one for parameter in self.parameters for one in analyse(parameter, prober, self.notes)]
            for one in self.controls:
                self._control_paths[one.path] = self._mesh_of(one)
                self._find_map(evaluation, one)
            moving = {path for quotient in quotients for _, path in quotient}
            self._posed = [one for one in self.controls if self._control_paths[one.path] in moving]
        without = {path: reason for quotient in quotients for _, path in quotient
                   if (reason := without_derivative(path)) is not None}  # fmt: skip
        self.notes += [f"not computed: the part of the derivative by '{path}', since {reason}"
                       for path, reason in without.items()]  # fmt: skip

    def _mesh_of(self, control: ControlMesh) -> str:
        """Path of the exported vertices of a control mesh."""
        assert self._start is not None
        name = control.object.name
        found = [key for key, source in self._start.meshes.items() if name in source.objects]
        if len(found) != 1 or self._start.meshes[found[0]].instance or self._start.meshes[found[0]].displaced:
            raise Problem(f"object '{name}': its vertices can't be fitted under its modifiers, since it is "
                          + ("instanced, has hair, or is displaced by its material" if found else "not rendered"))
        return f"meshes.{found[0]}.vertices"

    def _find_map(self, evaluation: Evaluation, control: ControlMesh) -> None:
        """Find the map of a control mesh at the present values."""
        path = self._control_paths[control.path]

        def shape() -> F64:
            evaluation.depsgraph.update()
            return positions(control.object.evaluated_get(evaluation.depsgraph).data).astype(np.float64)

        control.find(lambda: value_of(self._export(evaluation), (-1, path)), shape)
        assert self._start is not None
        control.exported_faces = owner(self._start.scene, path)[0].faces

    def _place(self, evaluation: Evaluation, values: Mapping[str, F64]) -> Placed:
        with self._kept():
            base, changed = self._stepped(evaluation, values)
            now = {one.path: one.read() for one in self._owned}
            quotients = self._quotients(Prober(lambda: self._export(evaluation), base), self._is_check)
            for one in self._posed:
                self._find_map(evaluation, one)
        maps = {one.path: ((-1, self._control_paths[one.path]), one.map)
                for one in self.controls if one.map is not None}  # fmt: skip
        self._moving |= set(changed)
        return _placement(base, now, quotients, maps, self._moving, len(self.cameras))

    def _stepped(self, evaluation: Evaluation, values: Mapping[str, F64]) -> tuple[Export, Iterable[Key]]:
        """Set the values, or nearer ones to the last if these change the structure; return the export."""
        assert self._start is not None
        last = self._last or {one.path: one.read() for one in self._owned}
        for attempt in range(SHORTENED + 1):
            self._set(values)
            try:
                base = self._export(evaluation)
                changed = moved(self._start, base)
            except StructureChange as change:
                self._note(f"some steps are shortened, since with them {change}")
                nearer = 0.5 if attempt + 1 < SHORTENED else 0.0
                values = {path: last[path] + nearer * (value - last[path]) for path, value in values.items()}
                continue
            self._last = {one.path: one.read() for one in self._owned}
            return base, changed
        raise Problem("the fit has to stop, since Blender's evaluation of its last values now has another structure; "
                      "does the scene depend on time or on a random number?")  # fmt: skip

    def _note(self, sentence: str) -> None:
        if sentence not in self.notes:
            self.notes.append(sentence)

    @property
    def _is_check(self) -> bool:
        """Whether the steps are checked in this placement."""
        return self._placements % CHECK_EVERY == 0

    def _quotients(self, prober: Prober, check: bool) -> dict[str, list[Quotient]]:
        out: dict[str, list[Quotient]] = {}
        for one in self.parameters:
            out[one.path] = []
            for k, place in enumerate(one.places):
                try:
                    if check:
                        one.steps[k], quotient = prober.step(place, one.steps[k].size)
                    else:
                        quotient = prober.quotient(place, one.steps[k].size)
                except NoEffect:
                    quotient = {}  # here, not everywhere
                except (StructureChange, Problem) as reason:
                    quotient = {}
                    self._note(f"property '{place.name}': has no derivative at some of its values ({reason})")
                out[one.path].append(quotient)
        return out

    def _set(self, values: Mapping[str, F64]) -> None:
        for one in self._owned:
            if one.path in values:
                one.write(values[one.path])

    @contextmanager
    def _kept(self) -> Iterator[None]:
        """Set the file's own values back after the block."""
        places = [place for one in self.parameters for place in one.places]
        before = [place.read() for place in places]
        shapes = [one.read() for one in self.controls]
        try:
            yield
        finally:
            restored(places, before)
            for one, shape in zip(self.controls, shapes, strict=True):
                one.write(shape)


def relative(effects: Mapping[str, float]) -> dict[str, float]:
    """Effects of parameters, relative to the largest one."""
    largest = max(effects.values(), default=0.0) or 1.0
    return {path: value / largest for path, value in effects.items()}


def control_variable(control: ControlMesh, step: float | None = None, smoothness: float | None = None,
                     rules: VertexRules | None = None) -> Variable:  # fmt: skip
    """Make the variable of the vertices of a control mesh, whose map is known; None means the default."""
    assert control.map is not None
    weights = np.linalg.norm(control.map.blocks, axis=(1, 2)) / np.sqrt(3.0)
    start, faces, found = control.read(), control.faces(), control.map
    cage = Cage(start, faces, control.exported, control.exported_faces, found.rows, found.columns, found.blocks)
    return ControlVertices(control.path, start, found.rows, found.columns, weights, faces, step, smoothness,
                           ~control.pinned, rules, cage)  # fmt: skip


def pulled(gradient: Mapping[str, F64], quotients: Sequence[Quotient], view: int) -> F64:
    """Gradient by the numbers of a parameter that have these quotients, from that by what a view sees."""
    return np.array([sum(float(np.vdot(gradient[name], value)) for (of, name), value in quotient.items()
                         if of in (-1, view) and name in gradient) for quotient in quotients])  # fmt: skip


def _placement(base: Export, now: dict[str, F64], quotients: dict[str, list[Quotient]],
               maps: dict[str, tuple[Key, LinearMap]], changed: set[Key], views: int) -> Placed:  # fmt: skip
    differentiated = {key for of in quotients.values() for quotient in of for key in quotient}
    differentiated |= {key for key, _ in maps.values()}
    keys = changed | differentiated
    usable = sorted(key for key in differentiated if without_derivative(key[1]) is None)

    def pull(gradient: Mapping[str, F64], view: int) -> dict[str, F64]:
        out = {path: pulled(gradient, of_path, view) for path, of_path in quotients.items()}
        return out | {path: one.pull(gradient[name]) for path, ((_, name), one) in maps.items()}

    def push(path: str, number: int, view: int) -> dict[str, F64]:
        if path in maps:
            (_, name), one = maps[path]
            move = np.zeros((one.count, 3))
            move.flat[number] = 1.0
            return {name: one.push(move, len(value_of(base, (-1, name))))}
        return {name: value for (of, name), value in quotients[path][number].items()
                if of in (-1, view) and without_derivative(name) is None}  # fmt: skip

    return Placed(
        now,
        {path: value_of(base, (view, path)) for view, path in sorted(keys) if view < 0},
        [{path[len(CAMERA) :]: getattr(base.views[k], path[len(CAMERA) :]) for view, path in sorted(keys) if view == k}
         for k in range(views)],
        [[path for view, path in usable if view in (-1, k)] for k in range(views)],
        pull,
        push=push,
        columns=quotients,
    )  # fmt: skip
