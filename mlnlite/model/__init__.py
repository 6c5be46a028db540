"""Syntax tree to typed model, and evidence."""
