"""Targets of a fit as Blender's users have them: pictures, frames, image datablocks, silhouettes."""
