"""Built-in demo scenes and the models they are made of."""
