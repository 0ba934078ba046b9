"""Teams whose bodies have several legs: one clock, cut wherever any of them has a joint."""
