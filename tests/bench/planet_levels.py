#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What coarser cells of a planet cost and save: renders LDEM_4 with procedural detail from 100 km with cells of at most
0.25 to 2 pixels (`cell_px`) and prints differences from the finest and processor time as a Markdown table.

Usage: planet_levels.py OBSCURA [SAMPLES (128)]. LDEM_4 is taken from OBSCURA_DATA (default ../shared/data).
"""
import json
import math
import pathlib
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cases"))
import case_files  # noqa: E402

CELLS = (0.25, 0.5, 1, 2)
SCENE = """
[sun]
direction = [{up:.9f}, {along:.9f}, 0]
distance_au = 1
[camera]
width = 96
height = 96
pixel_pitch_um = 10
focal_length_mm = 3.2
aperture_mm = 1
psf_sigma_px = 0.5
position_m = [-1837400, 0, 0]
boresight = [1, 0, 0]
up = [0, 0, 1]
[[body]]
name = "moon"
shape = "planet"
radii_m = [1737400, 1737400, 1737400]
material = "moon"
cell_px = {cell}
[[body.height]]
file = "{file}"
[body.detail]
terrain = "highlands"
[[band]]
from_nm = 400
to_nm = 900
"""


def main():
    obscura, samples = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "128"
    file = case_files.data_file("dem_moon_lola_ldem4/LDEM_4.LBL")
    print("| Sun | cells at most | rms difference | mean difference | processor time |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for elevation in (30, 8):
            finest = None
            for cell in CELLS:
                scene, image = pathlib.Path(folder, "scene.toml"), pathlib.Path(folder, "image.fits")
                angle = math.radians(elevation)
                scene.write_text(SCENE.format(up=-math.sin(angle), along=math.cos(angle), cell=cell, file=file))
                told = json.loads(case_files.run(obscura, "render", scene, "-o", image, "--samples", samples, "--json"))
                picture = next(iter(case_files.read_fits(image)[1].values())).astype(float).squeeze()
                finest = picture if finest is None else finest
                off = (picture - finest) / finest.mean()
                print(f"| {elevation} deg | {cell} px | {100 * np.sqrt((off ** 2).mean()):.2f} % | {100 * off.mean():+.2f} % | "
                      f"{told['render_cpu_s']:.1f} s |", flush=True)


if __name__ == "__main__":
    main()
