"""The search for weights."""
