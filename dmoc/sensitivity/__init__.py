"""What an answer is worth: its derivatives by the numbers of the problem, and how it spreads with errors."""
