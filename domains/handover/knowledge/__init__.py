"""The knowledge base: what an object and a receiver are in facts, the models about them, training and answers."""
