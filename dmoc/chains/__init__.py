"""The NLP of legs that stand in a chain, or beside each other: their programs, joined by a few rows."""
