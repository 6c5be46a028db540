"""The most probable world: which rung answers what, and the exact rungs."""
