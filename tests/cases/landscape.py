#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Case study: a landscape like Mars, as a lander sees it: picture, depth, slope and hazard map.

Usage: landscape.py OBSCURA [--size WxH] [--samples N] [--made] [--output FOLDER] [--json FILE]
Makes two height maps, 9.6 km at 8 m and in its middle 768 m at 0.75 m with craters and rocks, from random numbers (no data are
needed), lays one over the other as a scene's [[body.height]] tables, renders them with all layers, and holds depth, slopes and hazards
against the maps, which it interpolates, blends and searches on its own. With --made there are no maps: [body.detail] makes the ground
with craters and rocks, and what is held against each other are two views, and the slopes and the table they follow. Exit status 1 where one is further off than it may be, 77
where numpy is missing. With --output also the pictures and the table of docs/cases/landscape.md.
"""
import argparse
import importlib.util
import json
import pathlib
import sys
import tempfile

if not importlib.util.find_spec("numpy"):
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)
import numpy as np

import case_files
from case_report import Report

REGION_M, REGION_PIXEL_M = 9600.0, 8.0
SITE_M, SITE_PIXEL_M, FEATHER_M = 768.0, 0.75, 60.0
HALF_EDGE_M = 4700.0
CAMERA_M, LOOK_AT_M, FIELD_DEG = np.array([-640.0, -330.0, 235.0]), np.array([150.0, 75.0, 25.0]), 62.0
SUN = np.array([-0.55, 0.70, 0.46])  # 27 degrees above the horizon
# Rms slopes in degrees over baselines in metres; craters of the Moon on ground of that age, few for it: wind and water wear them.
SLOPES = {0.1: 9, 1: 7, 10: 5.2, 100: 5, 300: 5.4, 1000: 5.2, 3000: 3.6, 10000: 1.4}
MADE = f"""[body.detail]
terrain = "own"
baselines_m = {list(SLOPES)}
slopes_deg = {list(SLOPES.values())}
seed = 12
crater_age_ga = 0.6
boulders_per_m2 = 4e-3
boulder_rock_px = 0
"""
ABOVE_M, FIELD_M, SITE_HALF_M = 900.0, 600.0, 230.0  # of the camera that looks down, and half of the ground whose heights it gives
# A lander of 4 m: steepest ground under it and highest rock above the plane through it.
LANDER_M, MOST_SLOPE_DEG, MOST_ROUGHNESS_M = 4.0, 12.0, 0.35


def cubic(values, x, y):
    """Catmull-Rom between samples, at places in samples; edges repeat."""
    def weights(t):
        return (-0.5 * t**3 + t**2 - 0.5 * t, 1.5 * t**3 - 2.5 * t**2 + 1, -1.5 * t**3 + 2 * t**2 + 0.5 * t, 0.5 * t**3 - 0.5 * t**2)
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = weights(x - i), weights(y - j)
    height, width = values.shape
    return sum(down[b] * sum(across[a] * values[np.clip(j + b - 1, 0, height - 1), np.clip(i + a - 1, 0, width - 1)]
                             for a in range(4)) for b in range(4))


class Map:
    """Square raster about the origin, first row at the largest y."""

    def __init__(self, edge_m, pixel_m):
        self.edge, self.pixel = edge_m, pixel_m
        count = round(edge_m / pixel_m)
        middle = (np.arange(count) + 0.5) * pixel_m - edge_m / 2
        self.x, self.y = np.meshgrid(middle, middle[::-1])
        self.values = np.zeros_like(self.x)

    def at(self, x, y):
        return cubic(self.values, (x + self.edge / 2) / self.pixel - 0.5, (self.edge / 2 - y) / self.pixel - 0.5)

    def add_noise(self, random, rms_m, largest_m, smallest_m, power):
        """Heights with a spectrum of that power between two wavelengths, and no others."""
        count = len(self.values)
        k = np.fft.fftfreq(count, self.pixel)
        wave = np.hypot(*np.meshgrid(k, k))
        with np.errstate(divide="ignore"):
            amplitude = np.where((wave > 1 / largest_m) & (wave < 1 / smallest_m), wave**(-power / 2), 0)
        noise = np.fft.ifft2(np.fft.fft2(random.normal(size=(count, count))) * amplitude).real
        self.values += noise * rms_m / noise.std()

    def add_crater(self, x, y, radius, fresh):
        """Fresh crater of Fassett and Thomson (2014), eq. 4, flattened by age."""
        r = np.hypot(self.x - x, self.y - y) / radius
        near = r < 2.2
        r = r[near]
        inside = np.maximum(-0.228809953 + 0.227533882 * r + 0.083116795 * r**2 - 0.039499407 * r**3, -0.16)
        outside = 0.188253307 - 0.187050452 * r + 0.01844746 * r**2 + 0.01505647 * r**3
        shape = np.where(r < 0.98, inside, np.where(r < 1.02, 0.036822095, np.where(r < 1.5, outside, 0)))
        fade = np.where(r > 1.3, np.clip((1.5 - r) / 0.2, 0, 1), 1)
        self.values[near] += 2 * radius * fresh * np.maximum(shape, -1) * fade

    def add_rock(self, x, y, radius, height):
        i, j = (x + self.edge / 2) / self.pixel, (self.edge / 2 - y) / self.pixel
        reach = int(radius / self.pixel) + 2
        part = (slice(max(int(j) - reach, 0), int(j) + reach), slice(max(int(i) - reach, 0), int(i) + reach))
        r2 = ((self.x[part] - x)**2 + (self.y[part] - y)**2) / radius**2
        self.values[part] += height * np.sqrt(np.clip(1 - r2, 0, None))


class Ground:
    """The region with the site over it, as the scene lays them."""

    def __init__(self):
        random = np.random.Generator(np.random.Philox(2024))
        self.region, self.site = Map(REGION_M, REGION_PIXEL_M), Map(SITE_M, SITE_PIXEL_M)
        region, site = self.region, self.site
        region.add_noise(random, 30, 6000, 16, 4.2)
        region.add_noise(random, 0.8, 220, 17, 3.2)
        # A table mountain on the horizon and a rise beside it.
        for x, y, height, radius, edge in ((3000, 1500, 420, 1050, 330), (3450, -900, 170, 800, 600), (900, 3300, 280, 900, 420)):
            r = np.hypot(region.x - x, region.y - y) * (1 + 0.12 * np.sin(5 * np.arctan2(region.y - y, region.x - x)))
            region.values += height / (1 + np.exp((r - radius) / (edge / 4)))
        for _ in range(160):
            radius = 26 * random.uniform(0.01, 1)**(-0.5)
            region.add_crater(*random.uniform(-4600, 4600, 2), min(radius, 420), random.uniform(0.3, 0.9))
        region.values -= region.at(np.zeros(1), np.zeros(1))
        site.values = region.at(site.x, site.y)
        site.add_noise(random, 0.12, 30, 1.5, 3.6)
        for _ in range(60):
            site.add_crater(*random.uniform(-370, 370, 2), min(3 * random.uniform(0.01, 1)**(-0.55), 38), random.uniform(0.3, 1))
        for _ in range(900):
            radius = min(0.8 * random.uniform(0.002, 1)**(-0.4), 5)
            site.add_rock(*random.uniform(-375, 375, 2), radius, radius * random.uniform(0.5, 0.9))

    def height(self, x, y):
        """region + w (site - region), w the smoothstep of the distance to the site's edge, two samples inside it."""
        inside = np.minimum(SITE_M / 2 - np.abs(x), SITE_M / 2 - np.abs(y)) - 2 * SITE_PIXEL_M
        w = np.clip(inside / FEATHER_M, 0, 1)
        w = w * w * (3 - 2 * w)
        region = self.region.at(x, y)
        return region + w * (self.site.at(x, y) - region)

    def slope_deg(self, x, y, step):
        along = (self.height(x + step, y) - self.height(x - step, y)) / (2 * step)
        across = (self.height(x, y + step) - self.height(x, y - step)) / (2 * step)
        return np.degrees(np.arctan(np.hypot(along, across)))


class Camera:
    def __init__(self, place, target, up, field_deg, width, height):
        self.place, self.target, self.up, self.width, self.height = place, target, up, width, height
        self.pixel = 2 * np.tan(np.radians(field_deg / 2)) / width  # tangent of a pixel's angle
        z = (target - place) / np.linalg.norm(target - place)
        x = np.cross(z, up)
        x /= np.linalg.norm(x)
        self.axes = np.stack([x, np.cross(z, x), z], axis=1)

    def rays(self):
        x, y = np.meshgrid(np.arange(self.width) - (self.width - 1) / 2, np.arange(self.height) - (self.height - 1) / 2)
        d = np.stack([x * self.pixel, y * self.pixel, np.ones_like(x)], axis=-1)
        return (d / np.linalg.norm(d, axis=-1, keepdims=True)) @ self.axes.T

    def toml(self):
        return f"""[camera]
width = {self.width}
height = {self.height}
pixel_pitch_um = 10
focal_length_mm = {0.01 / self.pixel}
position_m = {list(map(float, self.place))}
look_at_m = {list(map(float, self.target))}
up = {list(map(float, self.up))}
"""


def scene_text(camera, made):
    def table(name, ground, more):
        edge = ground.edge / 2
        return (f'[[body.height]]\nfile = "{name}.fits"\nprojection = "planar"\nleft_m = {-edge}\ntop_m = {edge}\n'
                f"pixel_m = {ground.pixel}\n{more}")
    region, site = Map(REGION_M, REGION_PIXEL_M), Map(SITE_M, SITE_PIXEL_M)
    return f"""name = "landscape"
[sun]
direction = {list(map(float, SUN))}
distance_au = 1.52
{camera.toml()}
[[band]]
from_nm = 600
to_nm = 700
[[band]]
from_nm = 500
to_nm = 600
[[band]]
from_nm = 400
to_nm = 500
[[body]]
name = "ground"
shape = "terrain"
half_edge_m = {HALF_EDGE_M}
material = "oren-nayar"
albedo = 0.3
slope_deg = 20
colour = [1.0, 0.62, 0.36]
{MADE if made else table("region", region, "") + chr(10) + table("site", site, f"priority = 1{chr(10)}feather_m = {FEATHER_M}")}
"""


def render(obscura, folder, name, camera, samples, made=False):
    scene, image = folder / f"{name}.toml", folder / f"{name}.fits"
    scene.write_text(scene_text(camera, made))
    told = json.loads(case_files.run(obscura, "render", scene, "-o", image, "--layers", "--samples", samples, "--json"))
    images = case_files.read_fits(image)[1]
    return {key.lower(): value for key, value in images.items()}, told


def check_surface(report, ground, camera, layers, name):
    """Every hit lies on the surface that the maps make; slopes are those of the maps over the width of a pixel."""
    depth = layers["range_m"]
    rays = camera.rays()
    hit = np.isfinite(depth) & (depth > 0)
    points = camera.place + depth[hit][:, None] * rays[hit]
    x, y, z = points.T
    inside = np.maximum(np.abs(x), np.abs(y)) < HALF_EDGE_M - 20
    pixel = depth[hit] * camera.pixel
    off = np.abs(z - ground.height(x, y))[inside] / pixel[inside]
    report.add(f"{name}: height of the points met, above the maps", f"median {np.median(off):.4f}, 99 % within {np.percentile(off, 99):.3f} "
               f"of a pixel's width, {inside.sum()} points", "the maps, interpolated and blended on their own", np.percentile(off, 99), 0.5, "px")
    slope = layers["slope_deg"][hit][inside]
    truth = np.array([ground.slope_deg(x[inside], y[inside], step) for step in (0.25 * pixel[inside], 0.5 * pixel[inside])])
    wrong = np.abs(slope - truth.mean(axis=0))
    report.add(f"{name}: slope", f"median difference {np.median(wrong):.3f} deg, 90 % within {np.percentile(wrong, 90):.2f} deg",
               "differences of the maps over half to one pixel", np.median(wrong), 0.3, "deg")
    return hit


def check_first(report, ground, camera, layers, name, count=400):
    """Nothing stands in the way: rays marched through the maps meet them where the renderer does."""
    random = np.random.Generator(np.random.Philox(7))
    depth, rays = layers["range_m"], camera.rays()
    hit = np.argwhere(np.isfinite(depth) & (depth > 0))
    chosen = hit[random.choice(len(hit), min(count, len(hit)), replace=False)]
    worst = []
    for j, i in chosen:
        far = depth[j, i] * 1.01
        t = np.linspace(0, far, int(far / 0.25) + 2)
        p = camera.place + t[:, None] * rays[j, i]
        below = p[:, 2] < ground.height(p[:, 0], p[:, 1])
        if np.max(np.abs(p[below][:1, :2]), initial=0) > HALF_EDGE_M - 30:
            continue
        # A crossing 0.25 m deep or less between two steps can be missed by either.
        first = t[np.argmax(below)] if below.any() else np.inf
        worst.append(abs(first - depth[j, i]) / (depth[j, i] * camera.pixel))
    worst = np.array(worst)
    # Where a ray grazes a crest by less than the facets' error, it may meet what is behind.
    good = np.mean(worst < 20)
    report.add(f"{name}: first crossing", f"{100 * good:.1f} % of {len(worst)} rays, median {np.median(worst):.2f} px of range",
               "rays marched through the maps in steps of 0.25 m", 1 - good, 0.03, "")


def hazards(heights, pixel_m):
    """Steep or rough ground under a lander: plane fitted to the heights within its footprint, about each pixel."""
    reach = int(round(LANDER_M / 2 / pixel_m))
    offsets = np.arange(-reach, reach + 1) * pixel_m
    window = np.lib.stride_tricks.sliding_window_view(heights, (2 * reach + 1, 2 * reach + 1))
    dx, dy = np.meshgrid(offsets, -offsets)
    mean = window.mean(axis=(-1, -2))
    along = (window * dx).sum(axis=(-1, -2)) / (dx**2).sum()
    across = (window * dy).sum(axis=(-1, -2)) / (dy**2).sum()
    rest = window - mean[..., None, None] - along[..., None, None] * dx - across[..., None, None] * dy
    slope = np.degrees(np.arctan(np.hypot(along, across)))
    rough = np.abs(rest).max(axis=(-1, -2))
    return (slope > MOST_SLOPE_DEG) | (rough > MOST_ROUGHNESS_M), reach


def heights_on_grid(camera, layers, half_m, pixel_m):
    """Heights from the range layer of a camera that looks down, at the points of a grid: nearest points met, and their slopes."""
    rays = camera.rays()
    points = camera.place + layers["range_m"][..., None] * rays
    # The pixel that sees a point of the grid depends on its height: three steps suffice.
    middle = np.arange(-half_m + pixel_m / 2, half_m, pixel_m)
    x, y = np.meshgrid(middle, middle[::-1])
    z = np.zeros_like(x)
    for _ in range(6):
        local = (np.stack([x, y, z], axis=-1) - camera.place) @ camera.axes
        i = local[..., 0] / local[..., 2] / camera.pixel + (camera.width - 1) / 2
        j = local[..., 1] / local[..., 2] / camera.pixel + (camera.height - 1) / 2
        i0, j0 = np.clip(np.floor(i).astype(int), 0, camera.width - 2), np.clip(np.floor(j).astype(int), 0, camera.height - 2)
        a, b = i - i0, j - j0
        h = points[..., 2]
        z = ((1 - b) * ((1 - a) * h[j0, i0] + a * h[j0, i0 + 1]) + b * ((1 - a) * h[j0 + 1, i0] + a * h[j0 + 1, i0 + 1]))
    return x, y, z


def false_colour(values, low, high):
    """Blue, cyan, green, yellow, red."""
    t = np.clip((values - low) / (high - low), 0, 1) * 4
    stops = np.array([[40, 60, 160], [40, 170, 200], [90, 190, 90], [240, 210, 60], [200, 40, 40]], float)
    i = np.minimum(t.astype(int), 3)
    colour = stops[i] + (t - i)[..., None] * (stops[i + 1] - stops[i])
    return (colour + 0.5).astype(np.uint8)


def picture_of(layers):
    bands = layers[""]
    white = np.percentile(bands[0], 99.7)
    return np.stack([case_files.grey(b, 0, white, 1.9) for b in bands], axis=-1)


def rms_slopes(heights, pixel_m, steps):
    """Degrees, over baselines of that many points, along both axes."""
    for n in steps:
        rises = [(heights[n:] - heights[:-n]).ravel(), (heights[:, n:] - heights[:, :-n]).ravel()]
        yield n * pixel_m, float(np.degrees(np.arctan(np.sqrt(np.mean(np.concatenate(rises)**2)) / (n * pixel_m))))


def looked_down(options, folder, name, made, ground_m=0.0, above_m=ABOVE_M, edge=750, field_m=FIELD_M):
    """Camera straight above, its layers, and the heights at the points of a grid in the middle of its field."""
    down = Camera(np.array([0.0, 0, above_m + ground_m]), np.array([0.0, 0, ground_m]), np.array([0.0, 1, 0]),
                  2 * np.degrees(np.arctan(field_m / 2 / above_m)), edge, edge)
    layers, _ = render(options.obscura, folder, name, down, 1, made)
    return down, layers, heights_on_grid(down, layers, SITE_HALF_M / FIELD_M * field_m, field_m / 750)


def made_landscape(options, folder, width, height):
    """The ground of [body.detail]: an oblique view against one from above, that against one from half as high, slopes and their table."""
    report, step = Report(), FIELD_M / 750
    _, _, (_, _, wide) = looked_down(options, folder, "wide", True, 0.0, 8 * ABOVE_M, field_m=8 * FIELD_M)
    middle = float(wide[wide.shape[0] // 2, wide.shape[1] // 2])
    _, below, (_, _, z) = looked_down(options, folder, "down", True, middle)
    place = CAMERA_M + [0, 0, middle]
    view = Camera(place, LOOK_AT_M + [0, 0, middle], np.array([0.0, 0, 1]), FIELD_DEG, width, height)
    layers, told = render(options.obscura, folder, "view", view, options.samples, True)
    depth = layers["range_m"]
    hit = np.isfinite(depth) & (depth > 0)
    points = (view.place + np.nan_to_num(depth)[..., None] * view.rays())[hit]
    inside = np.maximum(np.abs(points[:, 0]), np.abs(points[:, 1])) < SITE_HALF_M - 5
    px, py, pz = points[inside].T
    there = cubic(z, (px + SITE_HALF_M) / step - 0.5, (SITE_HALF_M - py) / step - 0.5)
    pixel = depth[hit][inside] * view.pixel
    off = np.abs(pz - there) / np.maximum(pixel, step)
    report.add("oblique view: points met, above the heights of the view from above", f"median {np.median(off):.3f}, 90 % within {np.percentile(off, 90):.3f} of a pixel's width, {len(off)} points",
               "the range layer of a camera 900 m above", np.percentile(off, 90), 0.5, "px")
    for baseline, found in [*rms_slopes(z, step, (4, 8)), *rms_slopes(wide, 8 * step, (2,))]:
        # The table is of all ground of that kind; most of the slope over longer baselines is that of a few waves of kilometres.
        rises = np.log(list(SLOPES)) + np.log(np.tan(np.radians(list(SLOPES.values()))))
        wanted = float(np.degrees(np.arctan(np.exp(np.interp(np.log(baseline), np.log(list(SLOPES)), rises)) / baseline)))
        report.add(f"rms slope over {baseline:.3g} m", f"{found:.2f} deg", f"{wanted:.2f} deg of the table, for all such ground", abs(found / wanted - 1), 0.2, "of it")
    _, _, (_, _, low) = looked_down(options, folder, "low", True, middle, ABOVE_M / 2)
    found, _ = hazards(z, step)
    truth, _ = hazards(low, step)
    report.add("hazard map from the range layer", f"{100 * found.mean():.1f} % of the ground is steeper than {MOST_SLOPE_DEG:g} deg or rougher than "
               f"{MOST_ROUGHNESS_M:g} m under a lander of {LANDER_M:g} m", "the same from half as high", np.mean(found != truth), 0.03, "of the pixels")
    report.say("time", f"{told['render_cpu_s']:.0f} s of processor time", f"{width} x {height} pixels, {options.samples} samples")
    if options.output:
        write_pictures(options.output, "landscape-made", view, layers, hit, found, step, below)
        report.into_page(options.output / "landscape.md", "made")
    return report


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("obscura")
    parser.add_argument("--size", default="960x600")
    parser.add_argument("--samples", type=int, default=48)
    parser.add_argument("--made", action="store_true")
    parser.add_argument("--output", type=pathlib.Path)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        report = (made_landscape if options.made else mapped_landscape)(options, folder, width, height)
    report.print()
    if options.json:
        options.json.write_text(json.dumps(report.figures))
    return 0 if report.good else 1


def mapped_landscape(options, folder, width, height):
    """The ground of two maps, against these."""
    ground, report = Ground(), Report()
    for file, raster in (("region", ground.region), ("site", ground.site)):
        raster.values = raster.values.astype(np.float32).astype(float)
        case_files.write_fits(folder / f"{file}.fits", [(raster.values, {})])
    view = Camera(CAMERA_M, LOOK_AT_M, np.array([0.0, 0, 1]), FIELD_DEG, width, height)
    layers, told = render(options.obscura, folder, "view", view, options.samples)
    hit = check_surface(report, ground, view, layers, "oblique view")
    check_first(report, ground, view, layers, "oblique view")
    step = FIELD_M / 750
    down, below, (x, y, z) = looked_down(options, folder, "down", False, float(ground.height(np.zeros(1), np.zeros(1))[0]))
    check_surface(report, ground, down, below, "view from above")
    found, _ = hazards(z, step)
    truth, _ = hazards(ground.height(x, y), step)
    share = np.mean(found != truth)
    report.add("hazard map from the range layer", f"{100 * truth.mean():.1f} % of the ground is steeper than {MOST_SLOPE_DEG:g} deg or rougher than "
               f"{MOST_ROUGHNESS_M:g} m under a lander of {LANDER_M:g} m", "the same from the maps", share, 0.03, "of the pixels")
    notes = [note for body in told["plausibility"]["bodies"] for note in body.get("notes", [])]
    report.say("maps where they overlap", "; ".join(n.rsplit("/", 1)[-1] for n in notes), "stated by `obscura render`")
    report.say("time", f"{told['render_cpu_s']:.0f} s of processor time", f"{width} x {height} pixels, {options.samples} samples")
    if options.output:
        write_pictures(options.output, "landscape", view, layers, hit, found, step, below)
        report.into_page(options.output / "landscape.md")
    return report


def write_pictures(output, name, view, layers, hit, found, step, below):
    picture = picture_of(layers)
    depth = np.where(hit, layers["range_m"], np.nan)
    dark = np.array([20, 20, 24], np.uint8)
    shown = np.where(hit[..., None], false_colour(np.log(np.nan_to_num(depth, nan=1e9)), np.log(400), np.log(6000)), dark)
    slope = np.where(hit[..., None], false_colour(np.nan_to_num(layers["slope_deg"]), 0, 30), dark)
    # Hazards of the map from above, where the oblique view sees them.
    points = view.place + np.nan_to_num(depth)[..., None] * view.rays()
    grid_half = found.shape[0] * step / 2
    i = ((points[..., 0] + grid_half) / step).astype(int)
    j = ((grid_half - points[..., 1]) / step).astype(int)
    seen = hit & (i >= 0) & (j >= 0) & (i < found.shape[1]) & (j < found.shape[0])
    hazard = picture.astype(float)
    bad = np.zeros_like(seen)
    bad[seen] = found[j[seen], i[seen]]
    hazard[seen & bad] = 0.45 * hazard[seen & bad] + 0.55 * np.array([220, 40, 30])
    hazard[seen & ~bad] = 0.6 * hazard[seen & ~bad] + 0.4 * np.array([60, 200, 90])
    hazard = hazard.astype(np.uint8)
    rows = [case_files.beside(picture, shown), case_files.beside(slope, hazard)]
    gap = np.full((6, rows[0].shape[1], 3), 255, np.uint8)
    case_files.write_png(output / f"{name}.png", np.concatenate([rows[0], gap, rows[1]])[::2, ::2] if picture.shape[1] > 1200 else
                         np.concatenate([rows[0], gap, rows[1]]))
    grey = picture_of(below)
    inner = below["range_m"].shape[0]
    margin = (inner - found.shape[0]) // 2
    over = grey[margin:margin + found.shape[0], margin:margin + found.shape[1]].astype(float)
    over = np.where(found[..., None], 0.45 * over + 0.55 * np.array([220, 40, 30]), over).astype(np.uint8)
    case_files.write_png(output / f"{name}-hazards.png", case_files.beside(grey[margin:-margin, margin:-margin][:found.shape[0], :found.shape[1]], over))


if __name__ == "__main__":
    sys.exit(main())
