"""LagrangeBench's own data set class opens ours: ``python lagrangebench_h5.py FOLDER LENGTH``.

Only its loader is imported: the package itself also imports its models, which want older programs.
"""

import importlib.util
import json
import sys
import types
from pathlib import Path

import numpy as np

place = Path(importlib.util.find_spec("lagrangebench").origin).parent
package = types.ModuleType("lagrangebench")
package.__path__ = [str(place)]
sys.modules["lagrangebench"] = package
sys.modules.setdefault("pyvista", types.ModuleType("pyvista"))  # what it draws with

from lagrangebench.data.data import H5Dataset  # noqa: E402

folder, length = sys.argv[1], int(sys.argv[2])
windows = H5Dataset("train", folder, name="ours", input_seq_length=length)
position, kind = windows[len(windows) - 1]
whole, _ = H5Dataset("train", folder, name="ours", input_seq_length=length, is_rollout=True)[0]
print(
    json.dumps(
        {
            "windows": len(windows),
            "shape": list(np.shape(position)),
            "kinds": np.unique(np.asarray(kind)).tolist(),
            "last": np.asarray(position)[:, -1].astype(float).mean(axis=0).tolist(),
            "trajectory": list(np.shape(whole)),
            "bounds": windows.metadata["bounds"],
        }
    )
)
