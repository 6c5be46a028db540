"""Marginal questions: which rung answers what."""
