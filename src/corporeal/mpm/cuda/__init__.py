"""The engine on CUDA GPUs: memory layout, launches and loops."""
