"""The panel Fit: start, progress and end of a fit."""

from __future__ import annotations

from typing import Any

import bpy

from ..running.current import text_of
from ..running.fit_job import FitJob, fit_text, trend
from ..status import STATUS
from . import derived, icons
from .tab import Tab, editable
from .words import wrapped

CURVE_SCALE = 7.0  # side of the loss curve, in heights of a button


class QualityMenu(bpy.types.Menu):
    """Sets iterations, samples and pictures per iteration"""

    bl_idname = "EDGEGRAD_MT_quality"
    bl_label = "Quality"

    def draw(self, context: Any) -> None:
        self.layout.props_enum(context.scene.edgegrad, "quality")


class FitPanel(Tab, bpy.types.Panel):
    """Panel with the button Fit and the progress."""

    bl_idname = "EDGEGRAD_PT_fit"
    bl_label = "Fit"
    bl_order = 2

    def draw(self, context: Any) -> None:
        layout, job = self.layout, STATUS.job
        if isinstance(job, FitJob):
            _progress(context, layout, job)
            return
        settings = context.scene.edgegrad
        known = derived.start(context, settings)
        column = editable(layout if job is None else layout.column())
        # A plain property would have Python find the quality of the numbers at each draw.
        column.menu("EDGEGRAD_MT_quality", text=known.quality)
        if known.film:
            column.use_property_split, column.use_property_decorate = True, False
            column.prop(settings, "use_frames")
            column.prop(settings, "first_frame")
            column.prop(settings, "last_frame")
            column.prop(settings, "frame_smoothness")
        if job is not None:
            _busy(layout, job)
            return
        _start(context, layout, known)
        if STATUS.said:
            wrapped(context, layout, STATUS.said, "ERROR" if STATUS.failed else "INFO")


class FitDetailsPanel(Tab, bpy.types.Panel):
    """Panel with the settings of a fit that are rarely touched."""

    bl_idname = "EDGEGRAD_PT_fit_details"
    bl_label = "Details"
    bl_parent_id = FitPanel.bl_idname
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        return STATUS.job is None

    def draw(self, context: Any) -> None:
        layout, settings = self.begin(), context.scene.edgegrad
        layout.prop(settings, "iterations")
        if settings.use_frames:
            return
        layout.prop(settings, "use_frames")
        layout.prop(settings, "restarts")
        layout.prop(settings, "uncertainty")


def _start(context: Any, layout: Any, known: derived.Start) -> None:
    """Draw the button Fit, or what is in its way with the button that cures it."""
    found = known.obstacle
    if found is not None:
        wrapped(context, layout, found.sentence, "ERROR")
        if found.operator and not found.is_above:
            button = layout.operator(found.operator, text=found.label, icon="FORWARD")
            for name, value in found.options.items():
                setattr(button, name, value)
    column = layout.column()
    column.scale_y = 1.5
    if found is not None:
        column.enabled = False
    column.operator("edgegrad.fit", text=known.label, icon_value=icons.PLAY)
    if known.kept:
        layout.operator("edgegrad.write_kept_result", icon="FILE_TICK")


def _busy(layout: Any, job: Any) -> None:
    """Draw the progress of another job than a fit."""
    row = layout.row(align=True)
    row.progress(factor=job.fraction, type="BAR", text=text_of(job))
    row.operator("edgegrad.cancel", text="", icon="X")


def _progress(context: Any, layout: Any, job: FitJob) -> None:
    row = layout.row(align=True)
    row.scale_y = 1.5
    row.operator("edgegrad.fit_pause", text="Resume" if job.paused else "Pause", icon="PLAY" if job.paused else "PAUSE",
                 depress=job.paused)  # fmt: skip
    row.operator("edgegrad.fit_stop", icon="SNAP_FACE")
    row.operator("edgegrad.cancel", text="", icon="LOOP_BACK")
    layout.progress(factor=job.fraction, type="BAR", text=fit_text(job))
    row = layout.row()
    row.label(text="" if job.step is None else f"Loss {job.step.smoothed:.4g} {trend(job.losses)}")
    if job.ending is not None:
        row.label(text="Ending…")
    elif job.paused:
        row.label(text="Paused")
    else:
        row.label(text="Esc: back to the start")
    if len(job.losses) > 1:
        layout.template_icon(icon_value=icons.loss_curve(job.losses), scale=CURVE_SCALE)
    row = layout.row(align=True)
    if job.moves_shapes:
        row.prop(context.scene.edgegrad, "show_shapes")
    row.operator("edgegrad.show_difference", text="" if job.moves_shapes else "Show Difference", icon="IMAGE_DATA")


CLASSES: tuple[Any, ...] = (QualityMenu, FitPanel, FitDetailsPanel)
