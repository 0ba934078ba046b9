"""What is asked: what pushes, what is minimised, what is forbidden, where it starts and ends."""
