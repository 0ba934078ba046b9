"""What acts on the body. A user's own effect derives from `Conservative` or `Force`."""
