"""Evaluation: models against baselines on unseen objects, on the published rows, and of the handovers themselves."""
