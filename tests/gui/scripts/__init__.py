"""What is done in Blender's window; each runs in a Blender of its own."""
