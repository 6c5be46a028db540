"""Model and evidence to network."""
