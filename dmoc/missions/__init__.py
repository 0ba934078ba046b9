"""Missions of several legs, joined by impulses, drops, conditions and other events."""
