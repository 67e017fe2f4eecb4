"""Fits of any animatable property of Blender, and of the vertices of meshes under their modifiers.

A property is a datablock and the path of Blender's RNA to a number in it. Its derivative follows from the chain rule:
the difference quotient of the exported arrays by the property, times the gradient of the loss by these arrays.
"""
