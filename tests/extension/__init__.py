"""The extension: its zip, its wheels, and how it is loaded and disabled in Blender."""
