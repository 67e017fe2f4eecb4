"""The operators that show derivatives: as a picture, as colors of vertices, beside finite differences, in words."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from dataclasses import replace
from functools import partial
from typing import Any

import bpy

import edgegrad
from edgegrad import images

from ..animated.driver import Driver
from ..animated.stored import PROPERTY, wanted_of_rows
from ..evaluation import active_camera
from ..look import plan as plans
from ..look.check import case_of, cases, compared
from ..look.derivative import Derivative, derivative_of_names, derivative_of_properties
from ..look.vertex_gradient import ATTRIBUTE, paint, vertex_gradients
from ..parameters import Names
from ..problem import Problem
from ..properties import request
from ..rows import names_of, place_name, switched_on
from ..running.guard import Guard
from ..running.job import Job
from ..session import Session
from ..status import STATUS
from . import _common
from .background import InBackground

NAME = "Edgegrad Gradient"


def active_row(context: Any) -> Any:
    """Return the active row of the list of parameters; raise `Problem` if there is none."""
    settings = context.scene.edgegrad
    if not settings.active_parameter < len(settings.parameters):
        raise Problem("no parameter is in the list; add one, such as the vertices of the selected mesh")
    row = settings.parameters[settings.active_parameter]
    if row.owner is None:
        raise Problem(f"parameter '{row.path or row.kind}': its datablock was removed; remove it from the list")
    return row


def derivative_of(context: Any, row: Any) -> Derivative:
    """Prepare the derivative by the values of a row."""
    direction = context.scene.edgegrad.direction
    active_camera(context.scene)
    if row.kind != PROPERTY:
        return derivative_of_names(context, names_of([row]), direction)
    return derivative_of_properties(context, wanted_of_rows([row]), direction)


class Gradient(InBackground, bpy.types.Operator):
    """Show the derivative of the picture by the active parameter: red is brighter, blue darker, white no change"""

    bl_idname = "edgegrad.gradient"
    bl_label = "Gradient"
    bl_options = {"REGISTER"}  # noqa: RUF012

    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", default=0, min=0, description="Samples per pixel; 0: those of the panel")

    def prepare(self, context: Any) -> tuple[Job, None]:
        settings = context.scene.edgegrad
        row = active_row(context)
        found = derivative_of(context, row)
        _common.tell(self, found.export.report, found.notes)
        samples = self.samples or settings.look_samples
        terms = edgegrad.TERMS if settings.term == "TOTAL" else (settings.term,)
        self._about = row.name
        return Job("Gradient", lambda job: found.picture(samples, terms=terms, progress=job.check)), None

    def finish(self, context: Any, job: Job) -> set[str]:
        codes, scale = images.labelled_derivative(job.result)
        _common.show_codes(NAME, codes)
        said = f"the picture's derivative by '{self._about}' is in the image '{NAME}'; full red is {scale:.3g} per unit"
        return _common.done(self, said)


class GradientColors(InBackground, bpy.types.Operator):
    """Write where the targets push the vertices into a color attribute: red is outwards, blue inwards"""

    bl_idname = "edgegrad.gradient_colors"
    bl_label = "Vertex Gradient"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def prepare(self, context: Any) -> tuple[Job, Guard]:
        asked = request(context)
        asked = replace(asked, iterations=1, views_per_iteration=None, animated=(),
                        samples=max(asked.samples, context.scene.edgegrad.look_samples),
                        names=Names(vertices=asked.names.vertices))
        if not asked.names.vertices:
            raise Problem("no vertices are among the parameters; add those of a mesh")
        session = Session.prepare(context, asked)
        _common.tell(self, session.export.report, session.notes)
        return Job("Vertex Gradient", lambda job: vertex_gradients(session, job.check)), Guard(session, context.scene)

    def finish(self, context: Any, job: Job) -> set[str]:
        scales = [f"{paint(found):.3g} per area on '{found.object}'" for found in job.result]
        if isinstance(context.space_data, bpy.types.SpaceView3D):
            context.space_data.shading.color_type = "VERTEX"  # else Solid shading does not show them
        said = f"the gradient is in the color attribute '{ATTRIBUTE}'; full red is {', '.join(scales)}"
        return _common.done(self, said)


class Check(InBackground, bpy.types.Operator):
    """Compare the derivative of the picture by the active parameter with finite differences of the picture"""

    bl_idname = "edgegrad.check"
    bl_label = "Check"
    bl_options = {"REGISTER"}  # noqa: RUF012

    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", default=0, min=0, description="Samples per pixel; 0: those of the panel")

    def prepare(self, context: Any) -> tuple[Job, None]:
        row = active_row(context)
        samples = self.samples or context.scene.edgegrad.look_samples
        camera = active_camera(context.scene)
        if row.kind == PROPERTY:
            driver = Driver(context.scene, [camera], wanted_of_rows([row]))
            found, notes = list(cases(driver, place_name)), driver.notes
        else:
            derivative = derivative_of(context, row)
            found, notes = [case_of(derivative, row.name, camera.name)], derivative.notes
            _common.tell(self, derivative.export.report, notes)
        for note in notes:
            _common.say(self, "INFO", note)

        def work(job: Job) -> list[Any]:
            def part(k: int, fraction: float) -> None:
                job.check((k + fraction) / len(found))

            return [compared(case, samples, progress=partial(part, k)) for k, case in enumerate(found)]

        return Job("Check", work), None

    def finish(self, context: Any, job: Job) -> set[str]:
        lines = [str(one) for one in job.result]
        STATUS.show(checks=lines)
        wrong = sum(not one.agrees for one in job.result)
        differ = "the derivative differs" if len(lines) == 1 else f"{wrong} of {len(lines)} derivatives differ"
        said = f"{differ} from" if wrong else "the derivative agrees with"
        return _common.done(self, f"{said} finite differences of the picture", failed=wrong > 0)


class Plan(InBackground, bpy.types.Operator):
    """Say in words which parts of the derivative by the chosen parameters are computed in this scene, and which not"""

    bl_idname = "edgegrad.plan"
    bl_label = "Plan"
    bl_options = {"REGISTER"}  # noqa: RUF012

    def prepare(self, context: Any) -> tuple[Job, None]:
        rows = list(switched_on(context.scene))
        if not rows:
            raise Problem("no parameter is in the list; add one, such as the vertices of the selected mesh")
        export, paths = plans.planned(context, names_of(rows), wanted_of_rows(rows))
        _common.tell(self, export.report)
        return Job("Plan", lambda job: plans.lines(export, paths)), None

    def finish(self, context: Any, job: Job) -> set[str]:
        STATUS.show(plan=job.result)
        STATUS.ended("the plan is in the panel Plan")
        return {"FINISHED"}


CLASSES: tuple[Any, ...] = (Gradient, GradientColors, Check, Plan)
