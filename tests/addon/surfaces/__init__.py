"""Tests of what the add-on makes of single surfaces: their nodes, films and flattened bodies."""
