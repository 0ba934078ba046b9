"""The NLP: from motion to numbers for Ipopt, and the way back."""
