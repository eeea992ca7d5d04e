#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""[[body.albedo]]: the layer `albedo` of rendered pictures beside gdallocationinfo at their latitudes and longitudes, what
`obscura render` says of overlaps, a giant texture beside the image that it was imported from, and refused scenes.

Usage: albedo_maps_test.py OBSCURA. Skipped (77) without numpy or gdal-bin.
"""
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

try:
    import numpy as np
except ImportError:
    sys.exit(print("skipped: python3-numpy is not installed") or 77)
if not shutil.which("gdallocationinfo"):
    sys.exit(print("skipped: gdal-bin is not installed") or 77)
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cases"))
from case_files import read_fits  # noqa: E402

obscura = str(pathlib.Path(sys.argv[1]).resolve())
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-albedo-"))
os.chdir(folder)
failures = []
RADIUS = 1737400.0


def check(what, good, detail=""):
    if not good:
        failures.append(what)
        print(f"FAILED: {what} {detail}")


def tool(*words, **more):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, check=False, **more)
    if done.returncode != 0:
        sys.exit(f"{words}: {done.stderr[-500:]}")
    return done.stdout


def raw_map(name, values, system, corners, kind="UInt16"):
    """A GeoTIFF of the values, made by GDAL: corners are left, top, right, bottom in the system's units."""
    values.astype({"UInt16": "<u2", "Float32": "<f4"}[kind]).tofile(f"{name}.raw")
    rows, columns = values.shape
    size = values.itemsize if kind == "Float32" else 2
    pathlib.Path(f"{name}.vrt").write_text(
        f'<VRTDataset rasterXSize="{columns}" rasterYSize="{rows}"><VRTRasterBand dataType="{kind}" band="1" '
        f'subClass="VRTRawRasterBand"><SourceFilename relativeToVRT="1">{name}.raw</SourceFilename><ByteOrder>LSB</ByteOrder>'
        f'<ImageOffset>0</ImageOffset><PixelOffset>{size}</PixelOffset><LineOffset>{size * columns}</LineOffset>'
        f"</VRTRasterBand></VRTDataset>")
    tool("gdal_translate", "-q", "-a_srs", system, "-a_ullr", *corners, f"{name}.vrt", f"{name}.tif")
    return f"{name}.tif"


def sampled(file, longitudes, latitudes):
    """gdallocationinfo's bilinear interpolation does not exist in every version: of its nearest samples."""
    places = "\n".join(f"{lon:.12f} {lat:.12f}" for lon, lat in zip(longitudes, latitudes))
    out = tool("gdallocationinfo", "-valonly", "-l_srs", f"+proj=longlat +R={RADIUS} +no_defs", file, input=places)
    return np.array([float(v) for v in out.split()])


# Reflectances that are smooth over a texel, so that the nearest sample is close: of a quarter of a degree and of 500 m.
lon, lat = np.meshgrid(np.arange(1440) * 0.25 - 179.875, 89.875 - np.arange(720) * 0.25)
wide = 30000 + 15000 * np.sin(np.radians(3 * lon)) * np.cos(np.radians(2 * lat))
base = raw_map("base", wide, f"+proj=eqc +R={RADIUS} +units=m", [-math.pi * RADIUS, math.pi * RADIUS / 2, math.pi * RADIUS,
                                                               -math.pi * RADIUS / 2])
x, y = np.meshgrid(np.arange(800) * 500 - 199750, 199750 - np.arange(800) * 500)
fine = (0.4 + 0.15 * np.sin(x / 30000) * np.sin(y / 40000)).astype("f4")
patch = raw_map("patch", fine, f"+proj=stere +lat_0=-90 +lon_0=0 +R={RADIUS} +units=m", [-200000, 200000, 200000, -200000],
                "Float32")

HEAD = "[[band]]\nfrom_nm = 500\nto_nm = 700\n\n[[body]]\nname = \"moon\"\nshape = \"planet\"\nradii_m = [1737400, 1737400, 1737400]\n"
MAPS = ("[[body.albedo]]\nfile = \"base.tif\"\n[[body.albedo]]\nfile = \"patch.tif\"\npriority = 1\nfeather_m = 10000\n")


def scene(name, direction, maps, size=96):
    """The planet from twice its radius, from above a point."""
    place = [4e6 * d for d in direction]
    pathlib.Path(name).write_text(
        f"[sun]\ndirection = {list(direction)}\ndistance_au = 1\n[camera]\nposition_m = {place}\nlook_at_m = [0, 0, 0]\n"
        f"up = [0.3, 1, 0.2]\nwidth = {size}\nheight = {size}\npixel_pitch_um = 10\nfocal_length_mm = {size / 110}\n{HEAD}{maps}")


def rendered(name):
    done = subprocess.run([obscura, "render", name, "-o", "out.fits", "--layers", "--samples", "4"], capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{name}: {done.stderr[-500:]}")
    return read_fits("out.fits")[1], tool(obscura, "check", name)


for where, direction in (("equator", [1.0, 0.0, 0.0]), ("south pole", [0.02, 0.0, -0.9998]), ("seam", [-1.0, 0.1, 0.2])):
    scene("s.toml", direction, MAPS)
    images, said = rendered("s.toml")
    layer = {k.lower(): v for k, v in images.items()}
    albedo, latitude, longitude = layer["albedo"], layer["latitude_deg"], layer["longitude_deg"]
    emission = layer["emission_deg"]
    seen = np.isfinite(albedo) & (emission < 50)
    lons, lats = longitude[seen], latitude[seen]
    # Where a pixel covers part of the blend the maps are compared one by one.
    rho = 2 * RADIUS * np.tan(np.radians(90 + lats) / 2)
    px, py = rho * np.sin(np.radians(lons)), rho * np.cos(np.radians(lons))
    inside = np.maximum(abs(px), abs(py)) < 185000
    outside = np.maximum(abs(px), abs(py)) > 201000
    found = albedo[seen]
    check(f"{where}: enough pixels", outside.sum() > (300 if where == "south pole" else 1000), outside.sum())
    truth = sampled("base.tif", lons[outside], lats[outside]) / 65535
    off = np.abs(found[outside] - truth)
    # Half a texel of the base is up to 0.0017, the footprint of a pixel of 40 km takes 1 %.
    check(f"{where}: base map", np.percentile(off, 99) < 0.012 and off.mean() < 0.004, (off.max(), off.mean()))
    if where == "south pole":
        check("pole: patch in view", inside.sum() > 30, inside.sum())
        truth = sampled("patch.tif", lons[inside], lats[inside])
        off = np.abs(found[inside] - truth)
        check("pole: patch", np.percentile(off, 95) < 0.03 and off.mean() < 0.012, (off.max(), off.mean()))
    check(f"{where}: the overlap is said", "patch.tif: albedo at" in said and "over what is below it" in said, said[-600:])

# From near, where pixels are finer than texels, the patch is interpolated between its samples.
pathlib.Path("near.toml").write_text(
    "[sun]\ndirection = [0, 0, -1]\ndistance_au = 1\n[camera]\nposition_m = [0, 0, -1757400]\nlook_at_m = [0, 0, 0]\n"
    "up = [1, 0, 0]\nwidth = 64\nheight = 64\npixel_pitch_um = 10\nfocal_length_mm = 2\n" + HEAD + MAPS)
images, _ = rendered("near.toml")
layer = {k.lower(): v for k, v in images.items()}
lats, lons = layer["latitude_deg"].ravel(), layer["longitude_deg"].ravel()
rho = 2 * RADIUS * np.tan(np.radians(90 + lats) / 2)
px, py = rho * np.sin(np.radians(lons)), rho * np.cos(np.radians(lons))
truth = 0.4 + 0.15 * np.sin(px / 30000) * np.sin(py / 40000)
off = np.abs(layer["albedo"].ravel() - truth)
check("near: bilinear samples", off.max() < 2e-4, off.max())

# The same file as a texture of the body's material is in the same place: all longitudes from 0 on, a part of them, about a pole.
lon, lat = np.meshgrid(np.arange(720) * 0.5 + 0.25, 89.75 - np.arange(360) * 0.5)
whole = raw_map("from0", 30000 + 15000 * np.sin(np.radians(lon)) * np.cos(np.radians(2 * lat)), f"+proj=longlat +R={RADIUS} +no_defs", [0, 90, 360, -90])
tool("gdal_translate", "-q", "-srcwin", 300, 80, 200, 170, whole, "part.tif")
for name, direction in (("from0.tif", [0.3, -0.9, 0.3]), ("part.tif", [-0.97, -0.2, 0.1]), ("patch.tif", [0.02, 0.0, -0.9998])):
    scene("n.toml", direction, f"[[body.albedo]]\nfile = \"{name}\"\nfeather_m = 1\n")
    scene("x.toml", direction, f"material = \"lambert\"\nalbedo = 1\nalbedo_texture = \"{name}\"\n")
    (nested, _), (textured, said) = rendered("n.toml"), rendered("x.toml")
    a, b = ({k.lower(): v for k, v in m.items()}["albedo"] for m in (nested, textured))
    good = np.isfinite(a) & np.isfinite(b)
    off = np.abs(a - b)[good]
    # Pixels on the edge of a part see both sides of it, each its own share.
    check(f"{name}: as a texture", good.sum() > 2000 and np.percentile(off, 97) < 2e-3 and np.ptp(a[good]) > 0.2, (good.sum(), np.percentile(off, [50, 97, 100])))
    check(f"{name}: share", ("% of the body" in said) == (name != "from0.tif"), said)

# A giant texture of the same numbers is the same map.
if (pathlib.Path(obscura).parent / "obscura-gdal").exists():
    tool(obscura, "import", "map", "base.tif", "-o", "base.obt", "--albedo")
    info = tool(obscura, "texture", "info", "base.obt")
    check("imported as albedo", "albedo" in info, info)
    scene("o.toml", [1.0, 0.0, 0.0], "[[body.albedo]]\nfile = \"base.obt\"\nscale = 2\n", 64)
    scene("t.toml", [1.0, 0.0, 0.0], "[[body.albedo]]\nfile = \"base.tif\"\n", 64)
    giant, image = rendered("o.toml")[0], rendered("t.toml")[0]
    a, b = ({k.lower(): v for k, v in m.items()}["albedo"] for m in (giant, image))
    good = np.isfinite(b)
    # 16-bit numbers of an image count from 0 to 1; those of a giant texture are what they are.
    ratio = a[good] / b[good]
    check("giant texture and image", np.abs(ratio / ratio.mean() - 1).max() < 1e-4, (ratio.min(), ratio.max()))

# Refused: one line each.
pathlib.Path("broken.tif").write_bytes(pathlib.Path("base.tif").read_bytes()[:5000])
pathlib.Path("plain.png").write_bytes(b"no picture")
for what, maps, said in (
        ("damaged", "[[body.albedo]]\nfile = \"broken.tif\"\n", "broken.tif"),
        ("no image", "[[body.albedo]]\nfile = \"plain.png\"\nprojection = \"simple_cylindrical\"\n", "plain.png"),
        ("absent", "[[body.albedo]]\nfile = \"gone.tif\"\n", "gone.tif: no such file"),
        ("a number and maps", "albedo = 0.1\n" + MAPS, "o.toml:"),
        ("not for an ellipsoid", "", "")):
    text = maps
    scene("o.toml", [1.0, 0.0, 0.0], text, 16)
    if what == "not for an ellipsoid":
        path = pathlib.Path("o.toml")
        path.write_text(path.read_text().replace('"planet"', '"ellipsoid"') + "material = \"moon\"\n" + MAPS)
        said = "belongs to shape = \"planet\" or \"terrain\""
    done = subprocess.run([obscura, "render", "o.toml", "-o", "x.fits"], capture_output=True, text=True, check=False)
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    check(f"refused: {what}", done.returncode not in (0, 77) and done.returncode > 0 and any(said in line for line in lines)
          and not pathlib.Path("x.fits").exists(), (done.returncode, lines[:3]))

shutil.rmtree(folder)
if failures:
    sys.exit(1)
print("albedo maps: all as GDAL has them")
