"""The user study: published preferences, survey files or their simulation in, statistics, figures and a report out."""
