# SPDX-License-Identifier: Apache-2.0
"""The scenario of scenario_test.py in Python. Usage: scenario.py ADDRESS"""
import hashlib
import sys

import numpy

import obscura_client


def show(picture):
    print("values", hashlib.sha256(picture.values.tobytes()).hexdigest())
    print("depth", hashlib.sha256(picture.depth_m.tobytes()).hexdigest())
    print("lit", numpy.count_nonzero(picture.values > 0))
    print("seen", numpy.count_nonzero(~numpy.isnan(picture.depth_m)))


with obscura_client.connect(sys.argv[1]) as camera:
    camera.load(scene={})
    camera.set("camera", width=160, height=120, focal_length_mm=10.0, pixel_pitch_um=20.0, boresight=[0, 0, 1],
               up=[0, -1, 0], psf_sigma_px=1.5)
    camera.set("sun", direction=[-1.0, -0.5, -2.0])
    camera.add("body", name="ball", shape="ellipsoid", radii_m=[1.0, 1.0, 1.0], albedo=0.3, position_m=[0.25, -0.125, 12.5])
    show(camera.render(time_s=0.0, samples=16, seed=7, frame=3, layers=["depth_m"]))
    try:
        camera.set("body", "ball", albedo=2.5)
    except obscura_client.RequestError as error:
        print("refused", error.code, error.field, error.allowed)
    camera.set("body", "ball", position_m=[0.1, 0.2, 10.0])
    camera.set("camera", psf_sigma_px=None)
    show(camera.render(time_s=1.5, samples=16, seed=7, frame=4, layers=["depth_m"]))
    exposed = camera.render(exposure_s=0.02, sensor={"file": "generic", "readout": {"width": 96, "height": 64}}, samples=2, seed=7,
                            frame=5, run=3)
    print("dn", hashlib.sha256(exposed.values.tobytes()).hexdigest())
    print("sum", exposed.values.sum(dtype=numpy.int64))
    print("export", hashlib.sha256(camera.export().encode()).hexdigest())
