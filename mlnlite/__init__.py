"""Markov logic networks: parse, check, ground, infer, learn."""
