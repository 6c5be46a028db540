"""The grammars of the languages."""
