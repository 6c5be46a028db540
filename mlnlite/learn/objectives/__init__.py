"""What is maximised: pseudo-likelihood, likelihoods, margins."""
