#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The commands and the Python of docs/images.md run as they stand, and OpenCV finds the body where the picture shows it.

Usage: images_page_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 where Python has no OpenCV or numpy.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap

try:
    import cv2  # noqa: F401
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing} (packages python3-opencv, python3-numpy)")
    sys.exit(77)

obscura, source = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


page = (source / "docs" / "images.md").read_text()
commands = re.findall(r"^    (obscura .*)$", page, re.M)
programs = re.findall(r"^```(\w*)\n(.*?)^```", page, re.M | re.S)
check("the page has a command and a program, and no other blocks",
      len(commands) == 1 and [language for language, _ in programs] == ["python"], (commands, programs))


def run(command, folder):
    environment = dict(os.environ, PATH=f"{obscura.parent}:{os.environ['PATH']}")
    done = subprocess.run(command, shell=isinstance(command, str), cwd=folder, capture_output=True, text=True,
                          env=environment, timeout=300)
    check(f"{command if isinstance(command, str) else 'the program'} succeeds", done.returncode == 0, done.stderr[-800:])
    return done.stdout


def pixels(file):
    """The first image of a FITS file, 32-bit floats or 64-bit."""
    data = file.read_bytes()
    end = re.search(rb"END {77}", data).start()
    header = {data[i:i + 8].decode().strip(): data[i + 10:i + 80].decode().split("/")[0].strip() for i in range(0, end, 80)}
    begin = (end // 2880 + 1) * 2880
    width, height, bits = (int(header[key]) for key in ("NAXIS1", "NAXIS2", "BITPIX"))
    return np.frombuffer(data, f">f{-bits // 8}", width * height, begin).reshape(height, width)


def by_page(folder):
    """The pixel that the page's lines print after its command."""
    for command in commands:
        run(command, folder)
    printed = run([sys.executable, "-c", programs[0][1]], folder)
    found = re.search(r"column ([-\d.]+), row ([-\d.]+)", printed)
    check("the program prints a pixel", found, printed)
    return [float(text) for text in found.groups()] if found else [0, 0]


with tempfile.TemporaryDirectory(prefix="obscura-images-") as name:
    folder = pathlib.Path(name)
    (folder / "config").symlink_to(source / "config")
    column, row = by_page(folder)
    lit = np.argwhere(pixels(folder / "demo.fits") > 0)
    low, high = lit.min(0), lit.max(0)
    check("OpenCV's point lies in the body of the demo", (low < (row, column)).all() and ((row, column) < high).all(),
          (column, row, low, high))

    # The same lines with strong distortion and, for the fisheye, OpenCV's other function: a small full disc
    # near the corner has its centroid where OpenCV projects its centre.
    (folder / "config").unlink()
    (folder / "config" / "scenes").mkdir(parents=True)
    for keys, other in (('distortion = "opencv"\ndistortion_coefficients = [-0.3, 0.1, 0.004, -0.003, 0.02, 0.01]', False),
                        ('projection = "equidistant"\ndistortion = "radial"\ndistortion_coefficients = [-0.2, 0.05]', True)):
        (folder / "config/scenes/demo.toml").write_text(textwrap.dedent("""\
            [sun]
            direction = [-32, 25, -100]
            distance_au = 1
            [camera]
            width = 200
            height = 160
            focal_length_mm = 4
            psf_sigma_px = 0.5
            boresight = [0, 0, 1]
            up = [0, -1, 0]
            sensor_rotation_deg = ROTATION
            LENS
            [[body]]
            name = "ball"
            shape = "ellipsoid"
            radii_m = [1, 1, 1]
            albedo = 0.5
            position_m = [32, -25, 100]
            """).replace("ROTATION", "30" if other else "0").replace("LENS", keys))
        program = programs[0][1]
        if other:
            programs[0] = ("python", program.replace("cv2.projectPoints(body,", "cv2.fisheye.projectPoints(body[None, None],"))
        column, row = by_page(folder)
        programs[0] = ("python", program)
        image = pixels(folder / "demo.fits").astype(float)
        total = image.sum()
        x, y = (image.sum(0) * np.arange(image.shape[1])).sum() / total, (image.sum(1) * np.arange(image.shape[0])).sum() / total
        check("OpenCV's point is the body's centre", abs(x - column) < 0.06 and abs(y - row) < 0.06,
              (column, row, x, y))
        check("which the distortion moved", np.hypot(x - 99.5, y - 79.5) < 0.98 * 4e-3 / 18e-6 * np.hypot(0.32, 0.25), (x, y))
sys.exit(1 if failures else 0)
