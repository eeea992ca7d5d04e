#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Case study: a descent from 1 au to 2 m above the ridge between Shackleton and de Gerlache, in one sequence of frames.

Usage: descent.py OBSCURA [--frames N] [--size N] [--samples N] [--tested M,M,...] [--output FOLDER] [--json FILE]
The camera looks down on one point; its altitude falls by the same factor from frame to frame. Heights are LDEM_4, a strip of GLD100 and
Site01 of OBSCURA_DATA (default ../shared/data), with procedural detail between their samples. Tests that nothing pops up: at thirteen
altitudes, three frames a thousandth of the altitude apart differ from a straight line by no more than their stated noise, and so do
their means. Says what a frame costs. Exit status 1 where a figure is further off than it may be, 77 where data or numpy are missing. With
--output also the contact sheet and the table of docs/cases/descent.md. The page is made
with --frames 2000 --size 256.
"""
import argparse
import importlib.util
import json
import math
import pathlib
import resource
import sys
import tempfile

if not importlib.util.find_spec("numpy"):
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)
import numpy as np

import case_files
import lunar_south_pole as flyby
from case_report import Report

AU_M, END_M, FIELD_DEG = 149597870700.0, 2.0, 30.0
TESTED_M = "1e10,1e9,1e8,1e7,3e6,1e6,3e5,1e5,1e4,1e3,100,10,2"
FAR_M = 5e7  # beyond, the disc has some pixels and its samples are cheap
STEP = 1e-3  # of the altitude
SHEET_PX = 128  # edge of a picture of the contact sheet


def scene_text(files, size, up, table):
    heights = "".join(f'[[body.height]]\nfile = "{file}"\n{more}' for file, more in zip(files, flyby.LAYERS))
    pixel = 2 * math.tan(math.radians(FIELD_DEG / 2)) / size
    side = flyby.at(flyby.LONGITUDE + 90, 0)
    return f"""name = "descent"
[sun]
direction = {list(map(float, flyby.sun_direction(25)))}
distance_au = 1
[camera]
width = {size}
height = {size}
pixel_pitch_um = 100
focal_length_mm = {0.1 / pixel}
aperture_mm = {0.02 / pixel}
psf_sigma_px = 0
trajectory = "{table}"
boresight = {list(map(float, -up))}
up = {list(map(float, side))}
[[body]]
name = "moon"
shape = "planet"
radii_m = [{flyby.RADIUS_M}, {flyby.RADIUS_M}, {flyby.RADIUS_M}]
material = "moon"
tile_memory_mib = {flyby.TILES_MIB}
{heights}
{flyby.DETAIL}
"""


def sequence(obscura, folder, name, files, up, ground_m, altitudes, size, samples, *more):
    """Layers of one frame for each altitude, processor time of a frame in s, and largest memory so far in MiB."""
    table = folder / f"{name}.csv"
    rows = ["time_s,x_m,y_m,z_m"]
    for k, altitude in enumerate(altitudes):
        place = (flyby.RADIUS_M + ground_m + altitude) * up
        rows.append(f"{k}," + ",".join(f"{c!r}" for c in map(float, place)))
    table.write_text("\n".join(rows) + "\n")
    scene = folder / f"{name}.toml"
    scene.write_text(scene_text(files, size, up, table))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    flyby.limited(obscura, "render", scene, "-o", folder / f"{name}%05d.fits", "--trajectory", "--samples", samples, *more)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    made = sorted(folder.glob(f"{name}[0-9]*.fits"))
    if len(made) != len(altitudes):
        sys.exit(f"{len(made)} frames of {len(altitudes)}")
    frames = [{key.lower(): value for key, value in case_files.read_fits(file)[1].items()} for file in made]
    for file in made:
        file.unlink()
    return frames, spent / len(altitudes), after.ru_maxrss / 1024


def check_steps(report, tested, frames):
    """What the frames in the middle differ by from the mean of their neighbours, over the noise of that."""
    for k, altitude in enumerate(tested):
        three = frames[3 * k:3 * k + 3]
        light = [f[""] for f in three]
        variance = [f["variance"] for f in three]
        bend = (light[0] + light[2]) / 2 - light[1]
        noise = (variance[0] + variance[2]) / 4 + variance[1]
        # Means of blocks: single pixels have too few samples for their variance to be known.
        blocks = [v[:v.shape[0] // 8 * 8, :v.shape[1] // 8 * 8].reshape(v.shape[0] // 8, 8, -1, 8).sum(axis=(1, 3)) for v in (bend, noise)]
        seen = blocks[1] > 0.01 * blocks[1].max() if blocks[1].max() > 0 else np.zeros_like(blocks[1], bool)
        mean = light[1].mean()
        off = abs(bend.mean()) / mean
        spread = math.sqrt(noise.sum()) / noise.size / mean
        said = f"mean bends by {100 * off:.3f} %, noise of that {100 * spread:.3f} %"
        if seen.sum() >= 4:
            z = np.abs(blocks[0][seen]) / np.sqrt(blocks[1][seen])
            said += f"; {seen.sum()} blocks of 8² pixels: rms {math.sqrt((z**2).mean()):.2f}, largest {z.max():.1f} sigma"
            report.add(f"blocks at {altitude:.3g} m", said, "their stated noise, 1 sigma", math.sqrt((z**2).mean()), 2, "sigma")
        if altitude > FAR_M:
            report.add(f"mean at {altitude:.3g} m", f"{100 * off:.3f} %", "2 %: the light of discs of some pixels has a noise of about 0.5 %, not stated", off, 0.02, "")
        else:
            report.add(f"mean at {altitude:.3g} m", f"{100 * off:.3f} %", "0.5 % and three times its noise", off, 0.005 + 3 * spread, "")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("obscura")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--tested", default=TESTED_M)
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    files = [case_files.data_file(name) for name in (flyby.GLOBAL, flyby.STRIP, flyby.SITE)]
    up = flyby.at(flyby.LONGITUDE, flyby.END_LATITUDE)
    report = Report()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        # The ground with its detail: met from a kilometre above it.
        first, _, _ = sequence(options.obscura, folder, "ground", files, up, 0.0, [20000.0, 19999.0], 3, 64, "--layers")
        ground_m = 20000.0 - float(first[0]["range_m"][1, 1])
        altitudes = [AU_M * (END_M / AU_M)**(k / (options.frames - 1)) for k in range(options.frames)]
        frames, cost, memory = sequence(options.obscura, folder, "frame", files, up, ground_m, altitudes, options.size, options.samples)
        report.say("the descent", f"{options.frames} frames of {options.size}² pixels, {options.samples} samples, {cost:.2f} s of processor time each",
                   "one process, which keeps its tiles")
        tested = [float(word) for word in options.tested.split(",")]
        for name, some, samples in (("far", [a for a in tested if a > FAR_M], 64), ("near", [a for a in tested if a <= FAR_M], 32)):
            steps, _, _ = sequence(options.obscura, folder, name, files, up, ground_m, [a * f for a in some for f in (1 - STEP, 1, 1 + STEP)], 64, samples,
                                "--layers")
            check_steps(report, some, steps)
        report.say("memory of the renderer", f"{memory:.0f} MiB at most",
                   f"tile_memory_mib is {flyby.TILES_MIB}; under a limit of {flyby.LIMIT_MIB} MiB of address space (RLIMIT_AS)")
        if options.output:
            shown = frames[::max(1, len(frames) // 60)][:60]
            by = max(1, options.size // SHEET_PX)
            pictures = [f[""].reshape(options.size // by, by, options.size // by, by).mean(axis=(1, 3)) for f in shown]
            columns = 12
            case_files.write_png(options.output / "descent.png", flyby.stacked([pictures[r:r + columns] for r in range(0, len(pictures), columns)]))
            report.into_page(options.output / "descent.md")
    report.print()
    if options.json:
        options.json.write_text(json.dumps(report.figures))
    return 0 if report.good else 1


if __name__ == "__main__":
    sys.exit(main())
