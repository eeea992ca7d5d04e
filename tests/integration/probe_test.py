#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The pixel probe of a running camera: what it tells of a frame is what `obscura capture` makes of the same frame, whose scene moves before
a rolling shutter.

Usage: probe_test.py OBSCURA SOURCE-DIRECTORY OBSCURAD
Exit status 1 if a check failed, 77 without numpy.
"""
import contextlib
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from client_checks import PATIENCE_S, check, check_refused, end, obscura, obscura_client, source, wait_for  # noqa: E402
from read_image import read_exr, read_fits  # noqa: E402

obscurad = os.path.abspath(sys.argv[3])
WIDTH, HEIGHT = 64, 48
PIXELS = [(x, y) for y in (0, 7, 19, 24, 31, 40, 47) for x in (0, 13, 26, 32, 39, 63)]

with tempfile.TemporaryDirectory(prefix="obscura-probe-") as temporary:
    folder = pathlib.Path(temporary)
    scene = (source / "tests/support/light_scene.toml").read_text().replace("[500, 400, 300]", "[60, 50, 40]")
    scene = scene.replace("aperture_mm = 25", "aperture_mm = 10").replace("[[body]]", '[[body]]\nname = "rock"\ntrajectory = "swing.csv"')
    (folder / "scene.toml").write_text(scene)
    (folder / "other.toml").write_text(scene.replace("albedo = 0.1", "albedo = 0.2"))
    # To and fro by 14 pixels, up to 22 pixels a second.
    (folder / "swing.csv").write_text("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n" + "".join(
        f"{t / 8},0,{30 * math.sin(math.pi * t / 16):.6f},0,1,0,0,0\n" for t in range(8 * 600)))
    (folder / "c.toml").write_text(f"""[scene]
file = "scene.toml"
[daemon]
run = 3
autostart = true
[trigger]
rate_hz = 5
[control]
unix_socket = "{folder}/calls"
scenes = "."
[monitor]
socket = "{folder}/monitor"
[gige]
enabled = false
[camera]
exposure_us = 1000
[sensor.readout]
width = {WIDTH}
height = {HEIGHT}
pixel_clock_hz = 4e4
[sensor.detector]
crosstalk_edge = 0.02
prnu_local = 0.02
dark_nonuniformity_e_per_s = 10
""")
    daemon = subprocess.Popen([obscurad, "--config", folder / "c.toml"], stdout=subprocess.PIPE, stderr=open(folder / "log", "w"))
    daemon.stdout.readline()  # ready
    try:
        with obscura_client.connect_camera(str(folder / "calls"), timeout_s=PATIENCE_S) as camera:
            def policies():
                return [thread["policy"] for thread in camera.state()["threads"] if thread["name"] == "probe"]

            check("nothing is loaded before it is asked for", policies() == [])
            camera.probe(0, 0)
            check("the thread that renders has idle priority", policies() == ["idle"], policies())
            # The last frame stays.
            frame = camera.frame()
            camera.set(TriggerSource="Software")
            last = camera.frame()
            with contextlib.suppress(obscura_client.RequestError):
                while True:  # one may have been in progress
                    last = camera.frame(after=last.number, wait_s=2)
            check("frames came", last.number >= frame.number)
            told = {place: camera.probe(*place, frame=last.frame) for place in PIXELS}
            check("all of one frame", {pixel["frame"] for pixel in told.values()} == {last.frame}, last.frame)
            check("digital numbers are those of the frame", all(told[x, y]["dn"] == last.pixels[y, x] for x, y in PIXELS))

            made = folder / "made"
            subprocess.run([obscura, "capture", folder / "c.toml", "--first", str(last.frame), "-n", "1", "-o", made, "--exr", "--truth"],
                           check=True, capture_output=True, timeout=PATIENCE_S)
            ideal = read_exr((made / f"ideal_{last.frame:06}.exr").read_bytes())[0]
            electrons = read_fits((made / f"truth_{last.frame:06}.fits").read_bytes())[0]
            light = {place: struct.unpack("f", struct.pack("f", pixel["irradiance_w_m2"]))[0] for place, pixel in told.items()}
            check("the irradiance is that of the same frame of obscura capture, bit for bit",
                  all(light[x, y] == ideal[y * WIDTH + x] for x, y in PIXELS) and sum(value > 0 for value in light.values()) > 4, light)
            whole = camera.irradiance(last.frame)
            check("and so is that of all pixels together", whole.shape == (1, HEIGHT, WIDTH) and whole.ravel().tolist() == list(ideal), whole)
            check("and so are the expected electrons", all(told[x, y]["electrons"]["exact"] == electrons[y * WIDTH + x] for x, y in PIXELS),
                  [(x, y, told[x, y]["electrons"], electrons[y * WIDTH + x]) for x, y in PIXELS][:3])
            noise = [abs(pixel["electrons"]["estimated"] - pixel["electrons"]["exact"]) / (pixel["electrons"]["exact"] + 100) ** 0.5
                     for pixel in told.values()]
            check("electrons by the formula are about those", max(noise) < 6, [pixel["electrons"] for pixel in told.values()])
            pixel = told[32, 24]
            check("the formula gives what it says", abs(eval(pixel["formula"].replace("DN/e-", "").replace("dB", "").replace("^", "**").replace(
                "DN", str(pixel["dn"]))) - pixel["electrons"]["estimated"]) < 1e-3, pixel)
            check("the sum is that of the bands", pixel["irradiance_w_m2"] == sum(band["irradiance_w_m2"] for band in pixel["bands"]) and
                  [(band["name"], band["wavelength_nm"]) for band in pixel["bands"]] == [("400-900nm", [400, 900])], pixel["bands"])
            middles = [told[0, y]["row_mid_exposure_tai_ns"] for y in (0, 19, 47)]
            check("each row has its own time", middles[0] < middles[1] < middles[2], middles)
            seen = [pixel for pixel in told.values() if pixel["body"] == "rock"]
            check("what is behind the centres is told, and nothing of nothing", len(seen) > 4 and all(19930 < p["range_m"] < 20000 for p in seen) and
                  all(p["range_m"] is None and p["phase_deg"] is None for p in told.values() if p["body"] is None) and len(seen) < len(told))

            by_verb = subprocess.run([obscura, "probe", "32", "24", "--frame", str(last.frame), "--json", "--socket", folder / "monitor"],
                                     capture_output=True, text=True, timeout=PATIENCE_S)
            check("the verb tells the same", by_verb.returncode == 0 and json.loads(by_verb.stdout) == told[32, 24], by_verb)
            in_words = subprocess.run([obscura, "probe", "32", "24", "--frame", str(last.frame), "--socket", folder / "monitor"], capture_output=True,
                                      text=True, timeout=PATIENCE_S)
            check("in words, too", "rock" in in_words.stdout and "W/m2" in in_words.stdout, in_words)

            for x, y in (WIDTH, 0), (0, HEIGHT):
                check_refused(f"{x}, {y} is outside", "bad-argument", "is outside of the image, allowed 0 to", lambda: camera.probe(x, y, last.frame))
            check_refused("an older frame is gone", "not-now", f"is not kept any more, the newest one is {last.frame}", lambda: camera.probe(0, 0, 10 ** 6))
            check_refused("so is its irradiance", "not-now", f"is not kept any more, the newest one is {last.frame}", lambda: camera.irradiance(10 ** 6))
            camera.show_scene("other.toml")
            check_refused("and so is its scene once another is shown", "not-now", "shows a scene that is gone",
                          lambda: camera.probe(32, 24, last.frame))
            camera.set(TriggerSource="Line0")
            check("frames of that are probed by its light", wait_for(lambda: camera.frame().frame > last.frame) and
                  camera.probe(0, 0)["frame"] > last.frame)
        daemon.terminate()
        check("the daemon ends well", daemon.wait(PATIENCE_S) == 0)
    finally:
        if daemon.poll() is None:
            daemon.kill()
            daemon.wait()
        daemon.stdout.close()
sys.exit(end())
