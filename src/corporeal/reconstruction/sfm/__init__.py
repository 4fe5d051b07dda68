"""Structure from motion: camera poses of photographs and videos."""
