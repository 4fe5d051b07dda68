"""Files of the viewer that a browser reads."""
