#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Places of maps that obscura import takes from files: whole and partial turns, rows beyond a pole, turned maps, impossible labels, beside arithmetic.
Usage: map_places_test.py OBSCURA OBT_DUMP. Skipped (77) without obscura-gdal or numpy."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

obscura, obt_dump = sys.argv[1:3]
if not (pathlib.Path(obscura).parent / "obscura-gdal").exists():
    sys.exit(print("skipped: obscura-gdal is not built, libgdal-dev is missing") or 77)
try:
    import numpy as np
except ImportError:
    sys.exit(print("skipped: python3-numpy is not installed") or 77)
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-places-"))
failures = []
MOON = 'GEOGCS["Moon",DATUM["D_Moon",SPHEROID["Moon",1737400,0]],PRIMEM["Reference_Meridian",0],UNIT["degree",0.0174532925199433]]'
EQUIRECTANGULAR = f'PROJCS["e",{MOON},PROJECTION["Equirectangular"],PARAMETER["standard_parallel_1",0],PARAMETER["central_meridian",0],UNIT["metre",1]]'
PIXEL = 1737400 * np.pi / 36


def check(what, truth, detail=""):
    if not truth:
        failures.append(what)
        print(f"FAILED: {what} {detail}")


def vrt(name, transform, width=72, height=36, system=MOON):
    """A file of numbers 100 row + column, as GDAL's virtual dataset."""
    (100 * np.arange(height)[:, None] + np.arange(width)[None, :]).astype("<i2").tofile(folder / f"{name}.raw")
    place = "" if transform is None else f"<GeoTransform>{','.join(repr(float(t)) for t in transform)}</GeoTransform>"
    (folder / f"{name}.vrt").write_text(
        f'<VRTDataset rasterXSize="{width}" rasterYSize="{height}"><SRS>{system.replace("&", "&amp;")}</SRS>{place}<VRTRasterBand dataType="Int16" band="1" '
        f'subClass="VRTRawRasterBand"><SourceFilename relativeToVRT="1">{name}.raw</SourceFilename><PixelOffset>2</PixelOffset><LineOffset>{2 * width}</LineOffset>'
        "<ByteOrder>LSB</ByteOrder></VRTRasterBand></VRTDataset>")
    return folder / f"{name}.vrt"


def run(file, *words):
    out = folder / "out.obt"
    out.unlink(missing_ok=True)
    return subprocess.run([obscura, "import", "map", str(file), "-o", str(out), "--json", "--values", "height", "--unit", "m", *map(str, words)], capture_output=True, text=True)


def imported(what, file, *words):
    """The texture's description, samples and what was said; exits without one."""
    done = run(file, *words)
    check(f"{what}: status {done.returncode}", done.returncode == 0, done.stderr)
    if done.returncode:
        sys.exit(1)
    about = json.loads(subprocess.run([obt_dump, folder / "out.obt", folder / "s.f32"], capture_output=True, text=True, check=True).stdout)
    report = json.loads(done.stdout)
    return about, np.fromfile(folder / "s.f32", "<f4").reshape(about["height"], about["width"]), " ".join(report["warnings"] + report["notes"])


def is_at(what, about, longitude, latitude, step=None):
    """The middle of the first sample, degrees, to a ten-thousandth of a pixel."""
    found = about["corners"]["first"]
    check(f"{what}: first sample", abs((found[0] - longitude + 180) % 360 - 180) < 5e-4 and abs(found[1] - latitude) < 5e-4, found)
    if step:
        check(f"{what}: step", abs(about["transform"][1] / PIXEL * 5 - step) < 1e-6, about["transform"])


def turns():
    whole, _, _ = imported("exact", vrt("exact", (0, 5, 0, 90, 0, -5)))
    is_at("exact", whole, 2.5, 87.5, 5)
    # Rounded by 5e-5: the turn is meant. By 3e-3, a fifth of a pixel: it is not.
    near, _, said = imported("rounded", vrt("rounded", (0, 5 * (1 + 5e-5), 0, 90, 0, -5)))
    is_at("rounded", near, 2.509, 87.5, 5)
    check("rounded: said", "rounded" in said, said)
    for name, step in (("narrow", 4.985), ("half", 4.97)):
        part, samples, _ = imported(name, vrt(name, (10, step, 0, 90, 0, -5)))
        is_at(name, part, 10 + step / 2, 87.5, step)
        check(f"{name}: columns", samples.shape == (36, 72), samples.shape)
    # More than a turn by a part of a column: the last column is left out.
    wide, samples, said = imported("wide", vrt("wide", (10, 5.015, 0, 90, 0, -5)))
    is_at("wide", wide, 12.5075, 87.5, 5.015)
    check("wide: columns", samples.shape == (36, 71) and (samples[3] == 300 + np.arange(71)).all() and "1 are left out" in said, f"{samples.shape} {said}")
    # Edges by hand are not rounded.
    hand, _, _ = imported("by hand", vrt("hand", None, system=""), "--edges=10,368.92,90,-90", "--radius", 1737400)
    is_at("by hand", hand, 10 + 358.92 / 144, 87.5, 358.92 / 72)
    hand, _, _ = imported("rows by hand", vrt("hand2", None, system=""), "--edges=0,360,90,-89.5", "--radius", 1737400)
    last = hand["corners"]["last"]
    check("rows by hand", abs(last[1] - (-89.5 + 179.5 / 72)) < 1e-6, last)
    rows, _, _ = imported("rows", vrt("rows", (0, 5, 0, 90, 0, -4.99)))
    check("rows", abs(rows["corners"]["last"][1] - (90 - 4.99 * 35.5)) < 1e-6, rows["corners"])


def poles():
    # 38 rows of 5 degrees from 95 to -95: the first and last are beyond the poles. In metres too.
    for name, system, unit in (("beyond", MOON, 5), ("beyond_m", EQUIRECTANGULAR, PIXEL)):
        about, samples, said = imported(name, vrt(name, (0, unit, 0, 19 * unit, 0, -unit), height=38, system=system))
        check(f"{name}: rows", samples.shape == (36, 72) and (samples[:, 0] == 100 + 100 * np.arange(36)).all(), samples[:, 0])
        check(f"{name}: said", "2 of its rows lie beyond a pole" in said, said)
        is_at(name, about, 2.5, 87.5)
    about, samples, _ = imported("south", vrt("south", (0, 5, 0, -60, 0, -5), height=9))
    check("south: rows", samples.shape == (6, 72) and samples[5, 71] == 571, samples.shape)
    about, samples, _ = imported("upwards", vrt("upwards", (0, 5, 0, -101, 0, 5), height=20))
    check("upwards: rows", samples[0, 0] == 200 and abs(about["corners"]["first"][1] + 88.5) < 1e-6, samples[:3, 0])
    nodes, samples, _ = imported("nodes", vrt("nodes", (-2.5, 5, 0, 92.5, 0, -5), width=73, height=37))
    check("nodes stay", samples.shape == (37, 73) and nodes["registration"] == "node", nodes)
    # Rows off by 0.4 of a pixel stay where they are.
    off, _, _ = imported("off", vrt("off", (0, 5, 0, 88, 0, -5), height=35))
    is_at("off", off, 2.5, 85.5)


def turned():
    """A cylindrical map with cross terms: the values at places of the texture, by the inverse transform."""
    for name, t, system in (("shear", (-180, 5, 0.01, 90, 0.01, -5), MOON), ("patch", (20, 0.5, 0.02, 30, -0.03, -0.5), MOON),
                            ("metres", (20 * PIXEL / 5, 0.5 * PIXEL / 5, 0, 30 * PIXEL / 5, -0.03 * PIXEL / 5, -0.5 * PIXEL / 5), EQUIRECTANGULAR)):
        about, samples, said = imported(name, vrt(name, t, system=system))
        check(f"{name}: said", "rows do not follow parallels" in said, said)
        unit = PIXEL / 5 if system == EQUIRECTANGULAR else 1
        first, last = about["corners"]["first"], about["corners"]["last"]
        h, w = samples.shape
        lon = first[0] + np.arange(w)[None, :] * ((last[0] - first[0]) % 360) / (w - 1)
        lat = first[1] + np.arange(h)[:, None] * (last[1] - first[1]) / (h - 1)
        left, det = t[0] / unit, t[1] * t[5] - t[2] * t[4]
        best = np.full((h, w), np.nan)
        for turn in (-360, 0, 360):
            dx, dy = (lon + turn) * unit - left * unit, lat * unit - t[3]
            x, y = (dx * t[5] - dy * t[2]) / det - 0.5, (dy * t[1] - dx * t[4]) / det - 0.5
            inside = (x > 1) & (y > 1) & (x < 70) & (y < 34)
            best = np.where(inside, 100 * y + x, best)
        known = ~np.isnan(best)
        check(f"{name}: values", known.sum() > 500 and np.nanmax(np.abs(np.where(known, samples - best, 0))) < 0.01, np.nanmax(np.abs(np.where(known, samples - best, 0))))
        check(f"{name}: no holes inside", not np.isnan(samples[known]).any())


def impossible():
    """Each ends as a texture or in one line that names the file, never as an internal error."""
    files = []
    for i, t in enumerate([(0, 0, 0, 0, 0, 0), (0, 5, 0, 90, 0, 0), (0, 0, 0, 90, 0, -5), (0, 5, 5, 90, -5, -5), (0, 5, 5, 90, 5, 5), (1e300, 5, 0, 90, 0, -5), (0, 1e300, 0, 90, 0, -5),
                           (0, 1e-300, 0, 90, 0, -1e-300), (0, 5, 0, 200, 0, -5), (0, 5, 0, -200, 0, -5), (0, 400, 0, 90, 0, -5), (0, 5, 0, 90, 0, -400), (0, 5, 0, 1e9, 0, -5),
                           (0, -5, 0, 90, 0, -5), (0, 0, 5, 90, 5, 0), (1e9, 5, 0, 90, 0, -5), (float("nan"), 5, 0, 90, 0, -5), (0, float("inf"), 0, 90, 0, -5), (0, 5, 1e-12, 90, 0, -5),
                           (0, 30, 1, 90, 1, -30), (0, 1e-9, 0, 0, 0, -1e-9), (0, 5, 0, 3000, 1, -5)]):
        for j, system in enumerate((MOON, EQUIRECTANGULAR)):
            files.append(vrt(f"t{i}_{j}", t, system=system))
    good = (0, PIXEL, 0, 18 * PIXEL, 0, -PIXEL)
    for i, system in enumerate([EQUIRECTANGULAR.replace('"standard_parallel_1",0', '"standard_parallel_1",90'), EQUIRECTANGULAR.replace('"standard_parallel_1",0', '"standard_parallel_1",1e9'),
                                EQUIRECTANGULAR.replace("1737400,0", "1e300,0"), EQUIRECTANGULAR.replace("1737400,0", "0,0"), EQUIRECTANGULAR.replace("1737400,0", "-5,0"),
                                EQUIRECTANGULAR.replace("1737400,0", "1737400,0.5"), EQUIRECTANGULAR.replace('"central_meridian",0', '"central_meridian",1e300'),
                                EQUIRECTANGULAR.replace('"Equirectangular"', '"Polar_Stereographic"').replace('"standard_parallel_1",0', '"latitude_of_origin",-90'),
                                EQUIRECTANGULAR.replace('"Equirectangular"', '"Polar_Stereographic"').replace('"standard_parallel_1",0', '"latitude_of_origin",1e5'),
                                EQUIRECTANGULAR.replace('"Equirectangular"', '"Sinusoidal"'), EQUIRECTANGULAR.replace('"Equirectangular"', '"Mercator_1SP"'),
                                EQUIRECTANGULAR.replace('"Equirectangular"', '"Orthographic"').replace('"standard_parallel_1",0', '"latitude_of_origin",40'),
                                EQUIRECTANGULAR.replace('UNIT["metre",1]', 'UNIT["metre",1e-300]'), EQUIRECTANGULAR.replace('UNIT["metre",1]', 'UNIT["metre",0]'),
                                MOON.replace("0.0174532925199433", "1e300"), MOON.replace('"Reference_Meridian",0', '"Reference_Meridian",1e300'), 'LOCAL_CS["l",UNIT["metre",1]]', ""]):
        files.append(vrt(f"s{i}", good, system=system))
    keys = {"MAP_PROJECTION_TYPE": '"SIMPLE CYLINDRICAL"', "MAP_RESOLUTION": "0.2 <pix/deg>", "MAP_SCALE": "151.6167535 <km/pix>", "A_AXIS_RADIUS": "1737.4 <km>", "B_AXIS_RADIUS": "1737.4 <km>",
            "C_AXIS_RADIUS": "1737.4 <km>", "CENTER_LATITUDE": 0, "CENTER_LONGITUDE": 180, "MAXIMUM_LATITUDE": 90, "MINIMUM_LATITUDE": -90, "WESTERNMOST_LONGITUDE": 0,
            "EASTERNMOST_LONGITUDE": 360, "LINE_PROJECTION_OFFSET": 17.5, "SAMPLE_PROJECTION_OFFSET": 35.5, "POSITIVE_LONGITUDE_DIRECTION": "EAST"}
    image = {"LINES": 36, "LINE_SAMPLES": 72, "SAMPLE_TYPE": "LSB_INTEGER", "SAMPLE_BITS": 16, "BANDS": 1, "OFFSET": 0, "SCALING_FACTOR": 1, "LINE_PREFIX_BYTES": 0, "UNIT": "METER"}
    (folder / "L.IMG").write_bytes((folder / "exact.raw").read_bytes())
    number = 0

    def labelled(keys, image):
        nonlocal number
        number += 1
        text = 'PDS_VERSION_ID = PDS3\r\n^IMAGE = "L.IMG"\r\nOBJECT = IMAGE\r\n' + "".join(f" {k} = {v}\r\n" for k, v in image.items()) + "END_OBJECT = IMAGE\r\n"
        text += "OBJECT = IMAGE_MAP_PROJECTION\r\n" + "".join(f" {k} = {v}\r\n" for k, v in keys.items() if v is not None) + "END_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n"
        file = folder / f"L{number}.lbl"
        file.write_text(text)
        return file

    files.append(labelled(keys, image))
    for kind in ('"SIMPLE CYLINDRICAL"', '"POLAR STEREOGRAPHIC"', "EQUIRECTANGULAR"):
        for key in list(keys)[1:]:
            for value in (None, 0, -1, 1e300, 89.9, '"N/A"', "nan"):
                if kind != '"SIMPLE CYLINDRICAL"' and value in (None, "nan", '"N/A"'):
                    continue
                files.append(labelled({**keys, "MAP_PROJECTION_TYPE": kind, key: value}, image))
    for key in image:
        for value in (0, -1, 3, 1e300, '"N/A"', 9223372036854775807):
            files.append(labelled(keys, {**image, key: value}))
    taken = 0
    for file in files:
        done = run(file)
        good = done.returncode == 0 or done.returncode == 66 and done.stderr.splitlines()[-1].count(str(folder)) > 0 and not done.stderr.count("internal")
        taken += done.returncode == 0
        check(f"{file.name}: status {done.returncode}", good, f"{done.stderr}\n{file.read_text()[-900:] if not good else ''}")
    print(f"{len(files)} labels, {taken} of them taken")
    # Each option by hand, too.
    for words in (("--edges=0,0,90,-90",), ("--edges=0,360,95,-95",), ("--edges=0,720,90,-90",), ("--edges=0,360,90,90",), ("--edges=0,1e300,90,-90",), ("--edges=0,360,900,800",),
                  ("--shift=0,1e9",), ("--shift=1e9,0",), ("--shift=0,3",), ("--planar", 1e9), ("--registration", "node"), ("--latitudes", "planetographic"), ("--west-positive",),
                  ("--radius", 1e-300), ("--radius", 1e300), ("--radii", "1,1,1e9"), ("--scale", 0), ("--scale", 1e300), ("--offset", 1e300), ("--nodata", 1e300), ("--band", 9)):
        done = run(folder / "exact.vrt", *words)
        check(f"{words}: status {done.returncode}", done.returncode in (0, 64, 66), done.stderr)


turns()
poles()
turned()
impossible()
shutil.rmtree(folder)
sys.exit(1 if failures else 0)
