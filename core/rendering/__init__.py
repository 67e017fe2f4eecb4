"""Rendering: the renderer, its options, and the engines that do the work."""
