"""The loader of geoelements/gns opens ours: ``python gns_npz.py CHECKOUT TRAIN.npz LENGTH``."""

import json
import sys

import numpy as np

sys.path.insert(0, sys.argv[1])
from gns.data_loader import SamplesDataset

samples = SamplesDataset(sys.argv[2], int(sys.argv[3]))
(position, kind, stiffness, count), label = samples[len(samples) - 1]
print(
    json.dumps(
        {
            "samples": len(samples),
            "shape": list(position.shape),
            "count": count,
            "kinds": np.unique(kind).tolist(),
            "simulated_young_pa": sorted(set(np.round(10.0**stiffness, 3).tolist())),
            "last": np.asarray(label, dtype=float).mean(axis=0).tolist(),
        }
    )
)
