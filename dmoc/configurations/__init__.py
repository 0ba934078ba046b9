"""The coordinates of a body: what they are made of, the constraint between them, its kinetic energy."""
