"""What pushes and limits a body that turns."""
