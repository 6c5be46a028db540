"""Fields of application, each a plugin."""
