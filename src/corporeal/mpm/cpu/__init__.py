"""The CPU engine: memory layout and the host side of its loops."""
