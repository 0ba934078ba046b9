"""The command line."""

from dmoc.cli.app import app, main

__all__ = ["app", "main"]
