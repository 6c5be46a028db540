"""Rules from data."""
