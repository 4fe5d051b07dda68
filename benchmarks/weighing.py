"""Weigh every prop of the showcase, and every model below given folders, as a corpus does.

    python benchmarks/weighing.py [FOLDER ...] [--only NAME ...] [--json FILE] [--against FILE]

An asset is weighed cold: nothing that was kept is read. Given is processor time, which other work
on the machine changes little; what numba compiles is compiled before the clock starts. ``--json``
keeps what was found; ``--against`` names such a file and compares masses, centres and inertias.
"""

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from corporeal.core.errors import UserError
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.lab.corpus.assemble_corpus import asset_mass_properties
from corporeal.pool.asset_pool import PoolAsset
from corporeal.pool.pool_index import index_pool
from corporeal.scene.settling_body import MassProperties
from corporeal.showcase.prop_models import POOL_PROP_BUILDERS
from corporeal.showcase.showcase_scenes import prop_scene
from corporeal.vlm.real_sizes import estimate_real_extent, find_class_sizes

LIMIT = 10.0
"""What weighing one asset may cost [s]."""
FIRST = "rubber_ball"
"""Weighed before the clock starts."""


def assets(folders: Sequence[Path], below: Path) -> list[PoolAsset]:
    """Make a pool of the props and of what the folders hold."""
    props = below / "props"
    props.mkdir(parents=True, exist_ok=True)
    for name in POOL_PROP_BUILDERS:
        write_glb(props / f"{name}.glb", prop_scene(name))
    return list(index_pool([props, *folders], below / "pool").assets)


def weighed(asset: PoolAsset) -> tuple[MassProperties, float]:
    """Weigh one asset; return also the processor time that it took [s]."""
    known = find_class_sizes([asset.class_name], "metadata")
    extent = estimate_real_extent(asset.name, asset.class_name, asset.extent, asset.metric, known).extent
    start = time.process_time()
    return asset_mass_properties(asset, extent), time.process_time() - start


def compared(found: dict, before: dict) -> dict[str, float]:
    """How far mass, centre and inertia are from another measurement's, relative to that.

    The centre in radii of gyration, the inertia in the largest of its principal moments.
    """
    mass = before["mass"]
    inertia = np.array(before["inertia"])
    largest = float(np.linalg.eigvalsh(inertia)[-1])
    off = np.linalg.norm(np.subtract(found["centre"], before["centre"]))
    return {
        "mass": abs(found["mass"] / mass - 1),
        "centre": float(off / np.sqrt(largest / mass)),
        "inertia": float(np.abs(np.array(found["inertia"]) - inertia).max() / largest),
    }


def main() -> None:
    """Weigh all, print a table, the slowest first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="*", type=Path, help="of models")
    parser.add_argument("--only", nargs="+", help="weigh these alone, by name")
    parser.add_argument("--json", type=Path, help="keep what was found in this file")
    parser.add_argument("--against", type=Path, help="compare with what such a file keeps")
    asked = parser.parse_args()
    before = json.loads(asked.against.read_text()) if asked.against else {}
    rows = {}
    with TemporaryDirectory() as below:
        everything = assets(asked.folder, Path(below))
        weighed(next(a for a in everything if a.name == FIRST))
        for asset in everything:
            if asked.only and asset.name not in asked.only:
                continue
            try:
                found, seconds = weighed(asset)
            except UserError as problem:
                print(f"{asset.name}: {problem}", flush=True)
                continue
            rows[asset.name] = {
                "seconds": seconds,
                "mass": found.mass,
                "centre": found.centre.tolist(),
                "inertia": found.inertia.tolist(),
            }
            print(f"{asset.name}: {seconds:.1f} s", flush=True)
            if asked.json:
                asked.json.write_text(json.dumps(rows, indent=1))
    table(rows, before)


def table(rows: dict[str, dict], before: dict[str, dict]) -> None:
    """Print what was found, the slowest first."""
    print("\n| asset | mass [kg] | time [s] | before [s] | mass | centre | inertia |")
    print("|---|---|---|---|---|---|---|")
    for name, row in sorted(rows.items(), key=lambda item: -item[1]["seconds"]):
        cells = [name, f"{row['mass']:.4g}", f"{row['seconds']:.1f}"]
        if name in before:
            off = compared(row, before[name])
            cells += [f"{before[name]['seconds']:.1f}", *(f"{v:.1e}" for v in off.values())]
        print(f"| {' | '.join(cells)} |")
    slow = [n for n, r in rows.items() if r["seconds"] > LIMIT]
    print(f"\n{len(rows)} assets, {len(slow)} above {LIMIT:g} s" + (f": {', '.join(slow)}" * bool(slow)))


if __name__ == "__main__":
    main()
