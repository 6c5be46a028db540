"""Exact answers: elimination on clique trees, lifted inference, model counting."""
