"""PyBullet loads URDFs: ``python pybullet_urdf.py A.urdf …``; prints mass and inertia of each."""

import json
import sys

import pybullet

pybullet.connect(pybullet.DIRECT)
said = {}
for path in sys.argv[1:]:
    body = pybullet.loadURDF(path, flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
    mass, friction, moments = pybullet.getDynamicsInfo(body, -1)[:3]
    said[path] = {"mass": mass, "friction": friction, "moments": moments}
print(json.dumps(said))
