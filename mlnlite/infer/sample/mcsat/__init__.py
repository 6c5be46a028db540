"""MC-SAT, compiled: slices of worlds, and draws from them."""
