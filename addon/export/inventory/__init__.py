"""Inventory of Blender's settings: each is read, changes nothing in the picture, or is named at the export.

`structs` has one table for each of Blender's structures (materials, lights, cameras, objects, worlds, view layers,
render settings), `nodes` one for each type of shader node. A setting that changes the picture and is not read has a
sentence there; `naming` reports it wherever it is not at the value at which it changes nothing. A test walks
`bpy.types` and fails for a setting that no table has.
"""
