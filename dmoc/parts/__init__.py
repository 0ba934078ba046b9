"""What pushes, what is minimised, what is forbidden: parts that a problem is made of."""
