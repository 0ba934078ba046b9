"""What holds bodies on rods, rails and surfaces, and to each other."""
