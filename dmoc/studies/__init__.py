"""What accuracy, effects and long runs cost."""
