"""The engine on CUDA cards: memory layout, launches and loops."""
