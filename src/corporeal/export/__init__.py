"""Writers for other tools: OpenUSD, MJCF, URDF, animated GLB, splats, HDF5, Alembic."""
