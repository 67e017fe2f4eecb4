"""The operator edgegrad.fit_as_field."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from ..field_fit import FieldRequest
from ..field_fit.preview import Preview
from ..problem import Problem
from ..properties import request
from ..session import Request
from .fit import RunsFit


class FitAsField(RunsFit, bpy.types.Operator):
    """Hide the active object, and make a new one that matches the targets; its parts may merge and come apart"""

    bl_idname = "edgegrad.fit_as_field"
    bl_label = "Fit as Field"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    _preview: Preview | None = None

    def requested(self, context: Any) -> Request:
        """Return the fit that is set in the panel, with the active object as a field instead of vertices."""
        ob = context.view_layer.objects.active
        if ob is None:
            raise Problem("no object is active; select the object to fit as a field")
        plain = request(context)
        settings = context.scene.edgegrad
        return replace(plain, names=replace(plain.names, vertices=()),
                       field=FieldRequest(ob.name, settings.field_resolution, settings.field_start))  # fmt: skip

    def invoke(self, context: Any, event: Any) -> set[str]:
        found = super().invoke(context, event)
        if self._job is not None and self._job.session.field is not None:
            self._preview = Preview(context, self._job.session.field.object)
            self._job.session.field.live = True
        return found

    def _show_progress(self, context: Any, job: Any) -> None:
        super()._show_progress(context, job)
        if self._preview is not None and job.session.field.newest is not None:
            self._preview.show(job.session.field.newest)
            job.session.field.newest = None

    def _clean_up(self, context: Any) -> None:
        super()._clean_up(context)
        if self._preview is not None:
            self._preview.remove()
            self._preview = None
