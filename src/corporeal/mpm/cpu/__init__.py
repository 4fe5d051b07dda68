"""The engine on the processor: memory layout and the host side of its loops."""
