"""Scenes and results as pictures, in the browser, as tables."""
