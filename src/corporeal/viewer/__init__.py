"""A server for the viewer's page: runs to look at, to touch and to change, and files to upload."""
