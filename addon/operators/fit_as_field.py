"""The operator edgegrad.fit_as_field."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from ..field_fit import FieldRequest
from ..field_fit.fitted_values import WORDS
from ..problem import Problem
from ..properties import request
from ..session import Request
from .fit import RunsFit


class FitAsField(RunsFit, bpy.types.Operator):
    """Hide the active object, and make a new one that matches the targets; its parts may merge and come apart"""

    bl_idname = "edgegrad.fit_as_field"
    bl_label = "Fit as Field"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def requested(self, context: Any) -> Request:
        """Return the fit that is set in the panel, with the active object as a field instead of vertices."""
        ob = context.view_layer.objects.active
        if ob is None:
            raise Problem("no object is active; select the object to fit as a field")
        plain = request(context)
        settings = context.scene.edgegrad
        return replace(plain, names=replace(plain.names, vertices=()),
                       field=FieldRequest(ob.name, settings.field_resolution, settings.field_start,
                                          tuple(key for key in WORDS if key in settings.field_values)))  # fmt: skip
