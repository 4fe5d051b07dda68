"""The viewer's web page."""
