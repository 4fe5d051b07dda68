"""Our own props, and the scenes made of them."""
