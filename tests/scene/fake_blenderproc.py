"""A stand-in for the program blenderproc: lets every body straight down onto the floor.

It follows the protocol of the real one, `blenderproc run SCRIPT JOB RESULT`, and misbehaves as the
environment variable FAKE says.
"""

import json
import os
import subprocess
import sys
import time


def turned(q, v):
    """Rotate v by the quaternion q: v + 2w (u × v) + 2 u × (u × v)."""
    w, u = q[0], q[1:]
    t = [2 * (u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]) for k in range(3)]
    s = [u[(k + 1) % 3] * t[(k + 2) % 3] - u[(k + 2) % 3] * t[(k + 1) % 3] for k in range(3)]
    return [v[k] + w * t[k] + s[k] for k in range(3)]


def dropped(job, gap):
    rests = []
    for body in reversed(job["bodies"]):
        x, y, _ = body["position"]
        points = [v for piece in body["pieces"] for v in piece["vertices"]]
        low = min(turned(body["quaternion"], v)[2] for v in points)
        where = [x, y, gap - low]
        rests.append({"name": body["name"], "position": where, "quaternion": body["quaternion"]})
    return {"seconds": 10**0.5, "quiet": True, "bodies": rests}


def main():
    verb, script, job_path, result_path = sys.argv[1:]
    assert verb == "run" and script.endswith("blender_script.py")
    fake = os.environ.get("FAKE", "")
    sys.stderr.write("Blender 4.2.1 (a stand-in)\n")
    with open(job_path) as file:
        job = json.load(file)
    if fake.startswith("keep "):
        with open(fake[5:], "w") as file:
            json.dump(job, file)
    if fake == "fail":
        sys.stderr.write("Traceback:\n\nRuntimeError: no licence to fall\n")
        sys.exit(2)
    if fake == "nothing":
        return
    if fake.startswith("hang "):
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        with open(fake[5:], "w") as file:
            file.write(str(child.pid))
        time.sleep(600)
    text = json.dumps(dropped(job, gap=1.0 if fake == "hover" else 0.0))
    if fake.startswith("say "):
        text = fake[4:]
    with open(result_path, "w") as file:
        file.write(text)
    if fake == "crash":
        os.abort()


main()
