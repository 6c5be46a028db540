"""Good worlds by local search, without a proof."""
