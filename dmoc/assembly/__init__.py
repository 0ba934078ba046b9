"""Assembly: kernels and the places that they are mapped to become one sparse NLP."""
