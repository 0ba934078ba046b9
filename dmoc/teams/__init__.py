"""Teams: several bodies on one clock, in one NLP."""
