"""Entry of the scripts in Blender: ``start.py -- NAME`` runs the script of this name."""

import importlib
import os
import sys

sys.path.insert(0, os.environ["BLENDER_GUI_DATA"])
name = sys.argv[sys.argv.index("--") + 1]
script = importlib.import_module(f"tests.gui.scripts.{name}")
importlib.import_module("tests.gui.window").start(script.main(), script.FOUND)
