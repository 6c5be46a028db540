"""Databases to weights."""
