"""The loop of a fit.

Each iteration renders the picture of each target, finds unknown gains (`gains`), evaluates the loss and its adjoint
picture, pulls the adjoint back to a gradient by the parameters (`Renderer.render_backward`), and makes one step of each
optimiser. Pictures and gradients are Monte Carlo estimates, so the loop shortens its steps towards the end and compares
losses that are averaged over a few iterations.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._check import function
from ..planning.scene_plan import Plan, plan
from ..rendering.one_shot import CAUSTIC_SAMPLES
from ..rendering.options import Progress
from ..rendering.renderer import Renderer
from ..scene import parameters
from ..scene.scene import Scene
from .driven import Driven, Placement, Steps
from .fields.topological_steps import TopologicalStep, topology_is_due
from .fields.variables import Coefficients
from .film.keyed import KeyedFrames, KeyedNumbers
from .fit_step import Callback, FitStep, effect, ending
from .gains import Gains
from .history import History, Values
from .losses import Loss
from .outcome.zero_gradients import warn_of_untouched
from .schedule import Schedule, done_before
from .silhouettes import Silhouettes, is_negative, moves_silhouettes
from .targets import View, camera_of_gradient, checked_loss
from .variables import Unknown

F64 = NDArray[np.float64]

class Run:
    """The state of a running fit."""

    def __init__(
        self, work: Scene, renderer: Renderer, seen: list[View], unknowns: list[Unknown], loss: Loss, *,
        schedule: Schedule, spp: int, gradient_spp: int, limits: dict[str, Any], seed: int, started: float,
        progress: Progress | None, driven: Driven | None = None, placement: Placement | None = None,
        silhouettes: Silhouettes | None = None, keyed: KeyedFrames | None = None, field_edges: str = "outlines",
    ) -> None:
        self.work, self.renderer, self.seen, self.unknowns, self.loss = work, renderer, seen, unknowns, loss
        self.schedule, self.iterations = schedule, schedule.iterations
        self.done_before = done_before(schedule, len(seen))
        self.spp, self.gradient_spp, self.limits, self.field_edges = spp, gradient_spp, limits, field_edges
        self.seed, self.started, self.progress = seed, started, progress
        self.driven, self.placement, self.silhouettes, self.keyed = driven, placement, silhouettes, keyed
        self.gains = Gains(seen)
        self.checkpoint: Callable[[], None] | None = None  # stores the state
        self.checkpoint_every = 1
        self.before: Callable[[int], None] | None = None  # called before each iteration
        self.notes: list[str] = []  # on what happened on the way
        self.done, self.measured = 0, False  # iterations, and whether the loss after the last step is known
        # What `driven` was asked to place last: values, and for which pictures
        self.asked: tuple[dict[str, F64], Sequence[int] | None] = {}, None
        self.variables = () if driven is None else driven.variables  # the driven ones
        self.steps = Steps([one for one in self.variables if not isinstance(one, KeyedNumbers)])
        self.first_gradient: dict[str, F64] = {}  # by the driven variables, at the start
        self.effects: dict[str, float] = {}
        self.rendered: tuple[int, NDArray[np.float32]] = (0, np.zeros((0, 0, 3), np.float32))
        self.start = self.values()
        self.history = History([view.weight for view in seen], self.start, self.gains.values)
        self.touched = {path: np.zeros(np.shape(value), bool) for path, value in self.start.items()}
        if keyed is not None:
            keyed.scale(seen, loss)
            renderer.find_edges()  # of the same scene in a fit that goes on from a checkpoint

    def iterate(self, callback: Callback | None) -> str | None:
        """Run all iterations that are left.

        Returns
        -------
        None, or how the callback stopped the fit: "restore", "best", or "callback" if `on_cancel` decides.
        """
        full_turn = self.schedule.complete_after
        for k in range(self.done, self.iterations):
            if self.before is not None:
                self.before(k)
            turn = self.schedule.turn(k)
            gradient = self._gradient(k)
            # A part of a film's frames is better than none
            self.history.record(k >= full_turn - 1, self._now, parts_count=self.keyed is not None)
            for item in self.unknowns:
                parameters.put(self.work, item.path, item.take_step(gradient[item.path], turn.factor))
            changed = [item.path for item in self.unknowns]
            if self.driven is not None:
                values = self.steps.take(gradient, turn.factor)
                changed += self.place(values) if self.keyed is None else self._go_on(k, values, gradient, changed)
            self.update(changed)
            for item in self.unknowns:
                if isinstance(item, Coefficients) and topology_is_due(item.options.topology_every, k, full_turn,
                                                                      self.iterations):  # fmt: skip
                    self._topological_step(k, item).take()
            self.done = k + 1
            if k == full_turn - 1:
                warn_of_untouched(self.work, self.touched, self.history.newest, [item.path for item in self.variables],
                                  all(view.objects is not None for view in self.seen), lambda: self.plan)  # fmt: skip
            stop = None if callback is None else ending(callback(self._report(k + 1, gradient)))
            if self.checkpoint is not None and (stop is not None or self.done % self.checkpoint_every == 0):
                self.checkpoint()
            if stop is not None:
                return stop
        return None

    def _topological_step(self, k: int, item: Coefficients) -> TopologicalStep:
        """The step that follows iteration k."""

        def render(j: int, twin: int, without: bool) -> NDArray[np.float32]:
            view = self.seen[j]
            if without and view.objects is not None:
                return np.full(view.image.shape, is_negative(self.work, view.objects), np.float32)
            image = self.renderer_of(j).render(spp=self.spp, **self.limits_of(j), seed=self.seed_of(k, j, 5 + twin),
                                             camera=view.camera)
            return np.asarray(self.gains.values[j] * image, np.float32) if isinstance(view.gain, str) else image

        return TopologicalStep(item, self.work, self.update, self.seen, self.loss, render)

    def _simplify_best(self) -> None:
        """Remove what the pictures do not need from the best values of fields whose topology may change."""
        for item in [one for one in self.unknowns if isinstance(one, Coefficients) and one.options.topology_every]:
            best = self.history.best_values
            self.bring_to(best)
            if item.adopt_scene_values(best[item.path]) and self._topological_step(
                    self.iterations, item).simplify():  # fmt: skip
                self.history.best_values = best | {item.path: parameters.get(self.work, item.path)}

    def update(self, changed: list[str] | None) -> None:
        """Take over changed parameters, in the scene's renderer and in those of silhouettes.

        None: all changes of the scene other than parameters, which silhouettes do not have.
        """
        self.renderer.update(changed)
        if self.silhouettes is not None and changed is not None:
            self.silhouettes.update(changed)

    def place(self, values: Mapping[str, F64], views: Sequence[int] | None = None) -> list[str]:
        """Set the driven variables and the scene's parameters that follow; return the paths of the latter.

        The parameters of other pictures than `views` are not known then; None: those of all are.
        """
        assert self.driven is not None
        self.asked = dict(values), views
        self.placement = placed = self.driven.place(values, views)
        for item in self.driven.variables:
            item.value = placed.values[item.path]
        for view, fields in zip(self.seen, placed.cameras, strict=True):
            for name, value in fields.items():
                setattr(view.camera, name, value)
        for path, value in placed.parameters.items():
            parameters.put(self.work, path, value)
        return list(placed.parameters)

    def bring_to(self, values: Mapping[str, Any]) -> None:
        """Bring the scene to values of its parameters, of which some may be left out, and of all driven variables."""
        changed = [item.path for item in self.unknowns if item.path in values]
        for path in changed:
            parameters.put(self.work, path, values[path])
        if self.driven is not None:
            changed += self.place({item.path: values[item.path] for item in self.variables})
        self.update(changed)

    def _go_on(self, k: int, values: dict[str, F64], gradient: Mapping[str, F64], changed: list[str]) -> list[str]:
        """Place the next values of the driven variables of a film, as `place`; `changed` are the scene's others."""
        assert self.keyed is not None
        values |= self.keyed.take(gradient, self.schedule.turn(k))
        if k + 1 == self.iterations:
            return self.place(values)
        following = self.schedule.turn(k + 1)
        ways, losses = self.keyed.begun(values, following), [0.0]
        if len(ways) > 1:
            losses.clear()
            for way in ways:
                self.update([*changed, *self.place(way, following.views)])
                losses.append(self.loss_of(k + 1, following.views))
        return self.place(ways[int(np.argmin(losses))], following.views)

    def loss_of(self, k: int, views: Sequence[int]) -> float:
        """Loss of some pictures as they are now, with the samples of iteration k; it is not recorded."""
        pictures = {j: self._pictures(k, j, 0.0, 0.0) for j in views}
        return sum(self.seen[j].weight * value for j, (value, _) in self.compare(k, self.loss, pictures)[1].items())

    def see(self, j: int) -> None:
        """Bring the scene to the state in which picture j shows it."""
        if self.placement is None or not self.placement.own:
            return
        changed = [path for path, value in self.placement.own[j].items()
                   if not np.array_equal(parameters.get(self.work, path), value)]  # fmt: skip
        for path in changed:
            parameters.put(self.work, path, self.placement.own[j][path])
        if changed:
            self.update(changed)

    def measure_end(self) -> None:
        """Render all pictures once more and record the loss after the last step, unless this was done."""
        if self.measured:
            return
        k, part = self.iterations, 1.0 / len(self.seen)
        self._adjoints(k, {j: self._pictures(k, j, part * j, part) for j in range(len(self.seen))})
        self.history.record(True, self._now)
        self._simplify_best()
        self.measured = True
        if self.checkpoint is not None:
            self.checkpoint()

    def record_newton_step(self, step: int, gains: list[F64]) -> None:
        """Take the present values, which a Newton step after the end has found, as the best."""
        k = self.iterations + step
        self.gains.values = gains
        self._adjoints(k, {j: self._pictures(k, j, 0.0, 0.0) for j in range(len(self.seen))})
        self.history.record(False, self._now)
        self.history.keep(self.values(), gains)

    def _gradient(self, k: int) -> dict[str, F64]:
        """Return the gradient of the loss over the pictures of iteration k, and record their losses."""
        turn = self.schedule.turn(k).views
        total = {path: np.zeros(np.shape(value)) for path, value in self.start.items()}
        own = [item.path for item in self.unknowns]
        half = 0.5 / len(turn)  # of the work on a view, as a part of the iteration
        pictures = {j: self._pictures(k, j, half * n, half) for n, j in enumerate(turn)}
        for n, (j, adjoint) in enumerate(self._adjoints(k, pictures).items()):
            view = self.seen[j]
            moving = () if self.placement is None else self.placement.paths[j]
            wrt = [path for path in dict.fromkeys((*own, *moving)) if view.objects is None or moves_silhouettes(path)]
            if not adjoint.any() or not wrt:
                continue
            self.see(j)
            renderer = self.renderer_of(j)
            part = renderer.render_backward(
                adjoint, wrt, spp=self.gradient_spp, **self.limits_of(j), seed=self.seed_of(k, j, 1),
                camera=camera_of_gradient(renderer, view.camera, wrt), field_edges=self.field_edges,
                progress=self._part(k, 0.5 + half * n, half),
            )
            part = part | {path: np.zeros(np.shape(parameters.get(self.work, path)))
                           for path in (*own, *moving) if path not in part}  # fmt: skip
            pulled = {} if self.placement is None else self.placement.pull(part, j)
            for path, value in ({path: part[path] for path in own} | pulled).items():
                total[path] += value / len(turn)
        for path, value in total.items():
            bad = np.argwhere(~np.isfinite(value))
            if len(bad):
                at = f" at {tuple(int(i) for i in bad[0])}" if value.ndim else ""
                raise FloatingPointError(f"fit: the gradient of '{path}' is not finite{at} in iteration {k + 1}")
            self.touched[path] |= value != 0.0
        if k == 0:
            self.first_gradient = {item.path: total[item.path] for item in self.variables}
            self.effects = {item.path: effect(item, total[item.path]) for item in (*self.unknowns, *self.variables)}
        return total

    def renderer_of(self, j: int) -> Renderer:
        """The renderer of picture j: that of the scene, or of a silhouette."""
        objects = self.seen[j].objects
        if objects is None:
            return self.renderer
        assert self.silhouettes is not None
        return self.silhouettes.renderers[objects]

    def limits_of(self, j: int) -> dict[str, Any]:
        """Path length and bounces of picture j; a silhouette is seen directly."""
        return self.limits if self.seen[j].objects is None else self.limits | {"max_depth": 1}

    def _pictures(self, k: int, j: int, first: float, part: float) -> tuple[NDArray[np.float32], ...]:
        """Render picture j, or two independent pictures of half the samples if its gain is unknown.

        It is a part of iteration k, which has come as far as `first`.
        """
        self.see(j)
        view = self.seen[j]
        halves = 2 if isinstance(view.gain, str) else 1
        out = []
        for half in range(halves):
            image = self.renderer_of(j).render(
                spp=max(1, self.spp // halves), **self.limits_of(j), seed=self.seed_of(k, j, 4 * half),
                camera=view.camera, progress=self._part(k, first + part * half / halves, part / halves),
            )
            if not np.isfinite(image).all():
                raise FloatingPointError(f"fit: the picture of target {j} is not finite in iteration {k + 1}")
            out.append(image)
        return tuple(out)

    def _adjoints(self, k: int, pictures: Mapping[int, tuple[NDArray[np.float32], ...]]) -> dict[int, NDArray[Any]]:
        """Record the losses of pictures, and return their adjoints for this iteration.

        The recorded loss is the same function in all iterations. The adjoint is that of `loss.at(progress)`, if the
        loss has a schedule.
        """
        self.gains.values, out = self.compare(k, self.loss, pictures)
        for j, (value, _) in out.items():
            self.history.newest[j] = value
        at = getattr(self.loss, "at", None)
        if at is not None:
            loss = function("fit", "what loss.at returns", at(self.schedule.turn(k).progress))
            out = self.compare(k, loss, pictures)[1]
        return {j: adjoint for j, (_, adjoint) in out.items()}

    def compare(
        self, k: int, loss: Loss, pictures: Mapping[int, tuple[NDArray[np.float32], ...]]
    ) -> tuple[list[F64], dict[int, tuple[float, NDArray[Any]]]]:
        """Return the gains, and the loss of each picture with its adjoint, weighted by that of the view."""

        def checked(view: View, image: NDArray[Any]) -> tuple[float, NDArray[Any]]:
            return checked_loss(loss(image, view.image, view.mask), image)

        values = self.gains.find(lambda view, image: checked(view, image)[1], pictures)
        out = {}
        for j, halves in pictures.items():
            view, image = self.seen[j], halves[0]
            factor = np.ones(3)
            if len(halves) == 2:
                factor = values[j]
                image = np.asarray(0.5 * factor * (halves[0].astype(np.float64) + halves[1]), np.float32)
            value, adjoint = checked(view, image)
            if not (np.isfinite(value) and np.isfinite(adjoint).all()):
                raise FloatingPointError(f"fit: the loss of target {j} is not finite in iteration {k + 1}")
            self.rendered = j, image
            out[j] = value, np.asarray(view.weight * factor * adjoint, np.float32)
        return values, out

    def _now(self) -> Values:
        return self.values(), self.gains.values

    def values(self) -> dict[str, Any]:
        own = {item.path: parameters.get(self.work, item.path) for item in self.unknowns}
        return own | {item.path: item.value for item in self.variables}

    def _report(self, iteration: int, gradient: Mapping[str, F64]) -> FitStep:
        return FitStep(
            iteration, self.iterations, self.history.losses[-1], self.history.smoothed(), self.history.best + 1,
            time.monotonic() - self.started, self.values(), *self.rendered, self.seen[self.rendered[0]].image,
            gradient, self.effects,
        )

    def seed_of(self, k: int, j: int, kind: int) -> int:
        """Seed of iteration k, picture j and kind; all seeds are independent.

        Kinds are 0: picture, 1: derivative, 4: second half of the picture, 5 and 6: pictures of a topological step,
        7 to 10: pictures and derivatives of `outcome.measurement`, 11 and 12: coarse pictures, 13 and 14: gradients of
        `outcome.uncertainty`, 15 and 16: pictures of `outcome.newton_steps`.
        """
        return int(np.random.SeedSequence([self.seed, k, j, kind]).generate_state(1)[0])

    def _part(self, k: int, first: float, part: float) -> Progress | None:
        """Map the progress of one render, which is a part of iteration k, to that of the whole fit."""
        report = self.progress
        if report is None:
            return None
        begin, end = self.done_before[[k, k + 1]] if k <= self.iterations else (1.0, 1.0)
        return lambda fraction: report(min(float(begin + (end - begin) * (first + part * fraction)), 1.0))

    @cached_property
    def plan(self) -> Plan:
        """The plan of the derivatives with respect to the fitted parameters."""
        paths = dict.fromkeys(item.path for item in self.unknowns)
        for of_view in () if self.placement is None else self.placement.paths:
            paths |= dict.fromkeys(of_view)
        return plan(self.renderer, list(paths), **self.limits, measure=CAUSTIC_SAMPLES, field_edges=self.field_edges)

    @cached_property
    def missing(self) -> tuple[str, ...]:
        """Sentences on what the derivatives leave out."""
        return tuple(self.plan.missing)

    @property
    def planned(self) -> bool:
        """Whether the plan was made, which a resumed fit would make of other values."""
        return "plan" in self.__dict__ or "missing" in self.__dict__
