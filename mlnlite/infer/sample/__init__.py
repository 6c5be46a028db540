"""Estimates with errors: chains of worlds, and what they say."""
