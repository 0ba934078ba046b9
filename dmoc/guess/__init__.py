"""Starting guesses: a path to start from, made from the physics of a scene."""
