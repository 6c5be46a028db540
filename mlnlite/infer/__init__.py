"""Network to answer."""
