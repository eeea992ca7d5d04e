#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A chaser approaches a target and its arm unfolds: 100 frames with depth maps, a light spot on the target.

The arm is a tree: each link hangs on the one before by a hinge, so that a frame only sets angles. Prints one line a frame
and writes the last picture.

Usage: rendezvous.py [FRAMES [FOLDER]]    (PYTHONPATH=clients/python in the source tree)
"""
import hashlib
import pathlib
import sys

import numpy

import obscura_client

frames = int(sys.argv[1]) if len(sys.argv) > 1 else 100
folder = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else ".")


def link(name, parent, at, angle_deg):
    """A boom of 2 m, hinged at its parent's end."""
    return {"name": name, "shape": "cone", "bottom_radius_m": 0.08, "top_radius_m": 0.08, "height_m": 2.0, "albedo": 0.6,
            "parent": parent, "position_m": at, "joint": "hinge", "joint_axis": [0, 1, 0], "joint_angle_deg": angle_deg}


scene = {
    "sun": {"direction": [-0.6, -0.5, -1.0]},
    "camera": {"width": 256, "height": 256, "focal_length_mm": 25, "pixel_pitch_um": 20, "aperture_mm": 10, "look_at": "target"},
    "lamp": [{"name": "spot", "beam": "gaussian", "half_angle_deg": 2.0, "intensity_w_sr": [5e5], "look_at": "target"}],
    "body": [
        {"name": "target", "shape": "box", "size_m": [3.0, 3.0, 4.0], "albedo": 0.3, "spin_axis": [0, 0, 1],
         "spin_rate_deg_per_s": 0.5},
        link("upper arm", "target", [0.0, 0.0, 2.0], 0.0),
        link("forearm", "upper arm", [0.0, 0.0, 2.0], 0.0),
    ],
}

digest = hashlib.sha256()
with obscura_client.start() as camera:
    camera.load(scene=scene)
    for frame in range(frames):
        along = frame / max(frames - 1, 1)
        place = numpy.array([6.0, -3.0, -60.0]) * (1 - 0.6 * along)
        camera.set("camera", position_m=place)
        camera.set("lamp", "spot", position_m=place + [0.5, 0.0, 0.0])
        camera.set("body", "upper arm", joint_angle_deg=70 * along)
        camera.set("body", "forearm", joint_angle_deg=40 * along)
        picture = camera.render(time_s=float(frame), frame=frame + 1, samples=4, layers=["depth_m"], truth=True)
        digest.update(picture.values.tobytes())
        print(f"frame {frame + 1:3}: nearest surface {numpy.nanmin(picture.depth_m):7.3f} m, light {picture.values.sum():.4e} W/m2")
    picture.save(folder / "rendezvous.png")
    (folder / "rendezvous.toml").write_text(camera.export())
print(f"sha256 of all pictures: {digest.hexdigest()}")
