"""A network to log-potentials, made smaller and taken apart before anything is solved."""
