"""The world, lights, the camera, and the settings of the render."""
