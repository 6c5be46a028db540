"""How good a model is on labels that it was not shown."""
