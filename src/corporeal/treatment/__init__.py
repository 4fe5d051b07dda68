"""How every part is treated: rigid or deformable, and with which numbers."""
