"""Results: a solution, the facts about it, and its file."""
