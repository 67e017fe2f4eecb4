"""Work in a thread of its own while Blender stays usable, and what ends it."""
