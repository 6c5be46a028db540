"""Relational plans and what runs them."""
