"""Training instances: the catalogue, the cost model and the study's preferences in, facts with labels and poses out."""
