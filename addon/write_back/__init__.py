"""Results go back into Blender's data: what can be written is checked first, and what can't is kept."""
