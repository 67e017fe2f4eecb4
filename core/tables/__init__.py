"""The scene as flat arrays of numbers, the form in which the engines read it."""
