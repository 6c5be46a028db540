"""Networks for other programs, and for people."""
