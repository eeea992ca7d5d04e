#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Exposures of an hour: `obscura capture` against the dark signal and the trail of a star in closed form, every way to set
them on a daemon, chips whose counter cannot hold them, and a daemon under a watchdog while it exposes.
Usage: long_exposure_test.py OBSCURA OBSCURAD"""
import math
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

try:
    import numpy as np
except ImportError:
    print("SKIPPED: no numpy")
    sys.exit(77)

obscura, obscurad = (str(pathlib.Path(p).resolve()) for p in sys.argv[1:3])
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402
from read_image import read_fits  # noqa: E402

folder = pathlib.Path(tempfile.mkdtemp())
SIZE, OFFSET, GAIN, DARK = 96, 100.0, 2.0, 1.5
HOUR_US = 3.6e9

SENSOR = f"""name = "long"
pixel_pitch_um = 10
[readout]
width = {SIZE}
height = {SIZE}
shutter = "SHUTTER"
pixel_clock_hz = 40e6
sample_instant_ns = 200
reset_instant_ns = 400
EXTRA
[detector]
quantum_efficiency = [[300, 0.5], [1100, 0.5]]
temperature_c = 20
dark_reference_c = 20
dark_current_e_per_s = {DARK}
full_well_e = 1e6
read_noise_e = 3
gain_dn_per_e = {GAIN}
offset_dn = {OFFSET}
adc_bits = 16
"""
# A camera on the Earth's equator that looks at the celestial equator: the sky turns by 15.041 arcsec/s along its rows.
SCENE = """[sun]
irradiance_scale = 0
[stars]
catalogue = "stars.csv"
[camera]
width = 96
height = 96
pixel_pitch_um = 10
focal_length_mm = 2.2918
aperture_mm = APERTURE
psf_sigma_px = 0.6
trajectory = "turn.csv"
"""
SIDEREAL_RAD_S = 2 * math.pi / 86164.0905


def run(*arguments, status=0):
    done = subprocess.run([obscura, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
    check(f"{arguments}: exit {status}", done.returncode == status, f"exit {done.returncode}: {done.stderr}")
    return done.stdout + done.stderr


def write(name, text):
    (folder / name).write_text(text)
    return name


def fits_pixels(path):
    numbers, _, header = read_fits(path.read_bytes())
    return np.array(numbers, float).reshape(int(header["NAXIS2"]), int(header["NAXIS1"]))


def write_sensor(shutter="rolling", extra=""):
    write("long.toml", SENSOR.replace("SHUTTER", shutter).replace("EXTRA", extra))


def write_scene(aperture_mm):
    # Half quaternions about the camera's down axis (y), which is the Earth's axis upside down.
    rows = ["time_s,x_m,y_m,z_m,qw,qx,qy,qz"]
    at_equator = np.array([0.5, -0.5, 0.5, -0.5])  # z to inertial x, x to -y, y to -z
    for t in range(-100, 4001, 100):
        half = SIDEREAL_RAD_S * (t - 1800) / 2  # eastwards about inertial z
        w, z = math.cos(half), math.sin(half)
        a, b, c, d = at_equator
        q = (w * a - z * d, w * b - z * c, w * c + z * b, w * d + z * a)
        rows.append(",".join(f"{v:.12g}" for v in (t, 0, 0, 0, *q)))
    write("turn.csv", "\n".join(rows) + "\n")
    write("stars.csv", "ra_deg,dec_deg,v_mag\n0.07,0.04,1\n")
    write("scene.toml", SCENE.replace("APERTURE", str(aperture_mm)))


def capture(name, exposure_us):
    write("camera.toml", f'[scene]\nfile = "scene.toml"\n[sensor]\nfile = "long.toml"\n[camera]\nexposure_us = {exposure_us}\n')
    run("capture", "camera.toml", "-n", 1, "-o", name, "--format", "fits")
    return fits_pixels(sorted((folder / name).glob("frame_*.fits"))[0])


def test_capture():
    write_scene(0.001)
    write_sensor()
    dark = capture("dark", HOUR_US)
    # A chip that reads rows slot by slot obtains the exposure to a slot, 100 us.
    expected = OFFSET + GAIN * DARK * 3600
    electrons = dark.var() / GAIN**2
    error = GAIN * math.sqrt(DARK * 3600 / dark.size)
    check("dark signal", abs(dark.mean() - expected) < 5 * error, (dark.mean(), expected, error))
    # Shot noise, read noise and rounding; the variance of N samples is known to sqrt(2 / N).
    wanted = DARK * 3600 + 9 + 1 / 12 / GAIN**2
    check("dark shot noise", abs(electrons / wanted - 1) < 5 * math.sqrt(2 / dark.size), (electrons, wanted))
    print(f"dark signal {dark.mean():.2f} DN, closed form {expected:.2f}; variance {electrons:.0f} e-^2, closed form {wanted:.0f}")

    write_scene(0.315)
    write_sensor("global")
    trail = capture("trail", HOUR_US) - expected
    short = capture("short", 20e6) - OFFSET - GAIN * DARK * 20
    light = np.clip(trail, 0, None) * (trail > 6 * math.sqrt(wanted) * GAIN)
    ys, xs = np.nonzero(light)
    length = SIDEREAL_RAD_S * 3600 / math.atan(10e-3 / 2.2918)
    # A uniform streak and the PSF with its pixel: L^2 / 12 + sigma^2 + 1 / 12.
    profile = trail[min(ys):max(ys) + 1].sum(axis=0)
    columns = np.arange(SIZE)
    mean = (profile * columns).sum() / profile.sum()
    half = profile[int(mean) - 10:int(mean) + 10].mean() / 2
    inside = np.nonzero(profile > half)[0]
    first, last = inside[0], inside[-1]
    left = first - (profile[first] - half) / (profile[first] - profile[first - 1])
    right = last + (profile[last] - half) / (profile[last] - profile[last + 1])
    # Along the rows of a pinhole: f (tan b - tan a).
    a, b = (SIDEREAL_RAD_S * 1800 * s + math.radians(0.07) for s in (-1, 1))
    wanted_px = 2.2918 / 10e-3 * (math.tan(b) - math.tan(a))
    check("length of the trail", abs(right - left - wanted_px) < 0.15, (right - left, wanted_px))
    rate_long = trail[min(ys) - 3:max(ys) + 4].sum() / 3600
    rate_short = short[min(ys) - 3:max(ys) + 4].sum() / 20
    rows = max(ys) - min(ys) + 7
    noise = GAIN * math.sqrt(rows * SIZE * (DARK * 20 + 9)) / 20 + math.sqrt(max(rate_short, 0) / GAIN / 20) * GAIN + GAIN * math.sqrt(rows * SIZE * DARK / 3600)
    check("light of the trail", abs(rate_long - rate_short) < 5 * noise + 0.01 * rate_long, (rate_long, rate_short, noise))
    print(f"trail {right - left:.2f} px, closed form {wanted_px:.2f} (arc {length:.1f}); {rate_long:.0f} DN/s, at rest {rate_short:.0f} +- {noise:.0f}")


def test_chips():
    write_scene(2)
    write_sensor("global", "exposure_max_ns = 1000000000")
    write("camera.toml", '[scene]\nfile = "scene.toml"\n[sensor]\nfile = "long.toml"\n[camera]\nexposure_us = 1.5e6\n')
    said = run("check", "--quick", "camera.toml", status=78)
    check("a chip's counter is named", "ExposureTime" in said or "exposure_us" in said and "1e6" in said, said)
    said = run("sensor", "plan", folder / "long.toml", "--exposure-us", 1.5e6, status=78)
    check("a plan beyond a chip's counter", "the chip's counter" in said, said)
    write_sensor("global")
    said = run("capture", "camera.toml", "-n", 1, "-o", "none", "--set", "camera.exposure_us=3.7e9", status=78) \
        if "--set" in run("capture", "--help") else None
    write("camera.toml", '[scene]\nfile = "scene.toml"\n[sensor]\nfile = "long.toml"\n[camera]\nexposure_us = 3.7e9\n')
    said = run("check", "--quick", "camera.toml", status=78)
    check("more than an hour", "allowed 1 to 3.6e9 us" in said, said)


def test_daemon():
    write_sensor("global")
    address = f"127.{90 + os.getpid() % 100}.{os.getpid() // 100 % 250}.{1 + os.getpid() % 250}"
    write("daemon.toml", f"""[scene]
file = "scene.toml"
[sensor]
file = "long.toml"
[camera]
exposure_us = 3.6e9
trigger_mode = "On"
[control]
unix_socket = "{folder}/calls"
[monitor]
socket = "{folder}/monitor"
[gige]
enabled = true
interface = "{address}"
""")
    notify = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    notify.bind(str(folder / "notify"))
    notify.settimeout(0.2)
    environment = {**os.environ, "NOTIFY_SOCKET": str(folder / "notify"), "WATCHDOG_USEC": "2000000"}
    daemon = subprocess.Popen([obscurad, "-c", "daemon.toml"], cwd=folder, env=environment, stderr=subprocess.PIPE, text=True)
    try:
        heard = []

        def listen(seconds):
            end = time.monotonic() + seconds
            while time.monotonic() < end and daemon.poll() is None:
                try:
                    heard.append((time.monotonic(), notify.recv(4096)))
                except socket.timeout:
                    pass

        end = time.monotonic() + 30
        while not any(b"READY=1" in text for _, text in heard) and time.monotonic() < end and daemon.poll() is None:
            listen(0.2)
        control = ("--socket", folder / "monitor")
        said = run("get", "ExposureTime", *control)
        check("an hour after reset", "3.6e+09" in said or "3600000000" in said or "3.6e9" in said, said)
        run("set", "ExposureTime=3599999999", *control)
        said = run("get", "ExposureTime", *control)
        check("a microsecond less", "3599999999" in said, said)
        run("set", "ExposureTime=3.7e9", *control, status=78)
        # A frame of 6 s: the watchdog of 2 s hears the daemon all the time, and the receiver waits for its end.
        begin = time.monotonic()
        grab = subprocess.Popen([obscura, "grab", "-a", address, "-n", "1", "--exposure-us", "6e6",
                                 "--software-trigger-rate", "0.5", "--timeout", "3", "-o", str(folder)], cwd=folder,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while grab.poll() is None and time.monotonic() - begin < 30:
            listen(0.2)
        said = grab.communicate()[0]
        check("a frame of 6 s is received with a timeout of 3 s", grab.returncode == 0, (grab.returncode, said))
        check("it takes its time", time.monotonic() - begin > 6, time.monotonic() - begin)
        beats = [at for at, text in heard if b"WATCHDOG=1" in text and at > begin]
        gaps = [b - a for a, b in zip(beats, beats[1:])]
        check("the watchdog is fed while a frame is exposed", len(beats) >= 4 and max(gaps) < 2, (len(beats), gaps))
    finally:
        daemon.terminate()
        said = daemon.communicate()[1]
    check("the daemon ends well", daemon.returncode == 0, (daemon.returncode, said))
    check("no missed heartbeat", "watchdog" not in said, said)


test_capture()
test_chips()
test_daemon()
sys.exit(1 if failures else 0)
