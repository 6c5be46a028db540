"""Databases to what learning counts: choices, groundings, worlds."""
