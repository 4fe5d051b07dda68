"""From meshes to objects that lie at rest on a floor and on each other, with a certificate."""
