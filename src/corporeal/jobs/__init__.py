"""Run many jobs in processes of their own: locally, or on a Ray cluster."""
