"""How far learnt weights can be trusted: errors, tests, warnings."""
