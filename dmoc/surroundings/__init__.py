"""WHAT LIES AROUND A PATH: attractors, zones and links as geometry, which pictures and pages draw."""
