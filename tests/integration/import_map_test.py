#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura import map: samples and places beside gdallocationinfo and numpy, traps of labels, holes, mosaics, failures.
Usage: import_map_test.py OBSCURA OBT_DUMP DATA. Skipped (77) without obscura-gdal, gdal-bin or numpy."""
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

obscura, dump, data = sys.argv[1], sys.argv[2], pathlib.Path(os.environ.get("OBSCURA_DATA", sys.argv[3]))
if not (pathlib.Path(obscura).parent / "obscura-gdal").exists():
    sys.exit(print("skipped: obscura-gdal is not built, libgdal-dev is missing") or 77)
if not shutil.which("gdal_translate"):
    sys.exit(print("skipped: gdal-bin is not installed") or 77)
try:
    import numpy as np
except ImportError:
    sys.exit(print("skipped: python3-numpy is not installed") or 77)

failures = []
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-import-map-"))
RADIUS = 1737400.0


def check(what, truth, detail=""):
    if not truth:
        failures.append(what)
        print(f"FAILED: {what} {detail}")


def tool(*words, **options):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, **options)
    if done.returncode != 0:
        check(" ".join(str(w) for w in words), False, done.stderr[-400:])
    return done.stdout


def run(*words, status=0, **options):
    done = subprocess.run([obscura, "import", "map", *map(str, words)], capture_output=True, text=True, **options)
    if done.returncode != status:
        check(f"import map {words}: status {done.returncode}, wanted {status}", False, done.stderr[-600:])
    return done


class Texture:
    """What is in a texture: its description and the finest samples of all planes."""

    def __init__(self, file):
        samples = folder / "samples.f32"
        self.about = json.loads(tool(dump, file, samples))
        a = self.about
        self.values = np.fromfile(samples, "<f4").reshape(a["planes"], a["height"], a["width"]).astype("f8")
        # Numbers as stored.
        self.numbers = (self.values - a["offset"]) / a["scale"]

    def place(self, corner):
        return self.about["corners"][corner]


def imported(*words, fails=False):
    """Imports to a texture: its content and the report."""
    out = folder / "out.obt"
    out.unlink(missing_ok=True)
    done = run(*words, "-o", out, "--json")
    if done.returncode != 0:
        sys.exit(1)
    report = json.loads(done.stdout)
    report["said"] = "\n".join(report["warnings"] + report["notes"])
    return Texture(out), report


def lines_of(said):
    """What was said, without progress."""
    return [line for line in said.splitlines() if not line.startswith("obscura: import map")]


def refused(message, *words, status=66, **options):
    out = folder / "refused.obt"
    done = run(*words, "-o", out, status=status, **options)
    check(f"{words}: one line", len(lines_of(done.stderr)) == 1, done.stderr)
    check(f"{words}: {message!r}", message in done.stderr, done.stderr)
    left = [f.name for f in folder.iterdir() if f.name.startswith("refused")]
    check(f"{words}: nothing is left", not left, left)


def near(a, b, limit):
    return abs(a - b) <= limit


def angle_near(a, b, limit=1e-9):
    return abs((a - b + 180) % 360 - 180) <= limit


# A global map of 1 degree, with its truth.
rng = np.random.default_rng(1)
H, W = 180, 360
globe = np.round(2000 * np.sin(np.arange(W) / 40)[None, :] * np.cos(np.arange(H) / 30)[:, None] + rng.normal(0, 300, (H, W))).astype("<i2")


def pds3(name, array, *, image=None, keys=None, pointer=None, attached=False, bits=None, kind="LSB_INTEGER"):
    h, w = array.shape
    image = {"UNIT": "METER", "SCALING_FACTOR": 1, "OFFSET": 0, **(image or {})}
    resolution = w / 360
    keys = {"MAP_PROJECTION_TYPE": '"SIMPLE CYLINDRICAL"', "MAP_RESOLUTION": f"{resolution} <pix/deg>", "A_AXIS_RADIUS": "1737.4 <km>",
            "B_AXIS_RADIUS": "1737.4 <km>", "C_AXIS_RADIUS": "1737.4 <km>", "POSITIVE_LONGITUDE_DIRECTION": "EAST", "CENTER_LATITUDE": 0,
            "CENTER_LONGITUDE": 180, "MAXIMUM_LATITUDE": 90, "MINIMUM_LATITUDE": -90, "WESTERNMOST_LONGITUDE": 0, "EASTERNMOST_LONGITUDE": 360,
            "LINE_PROJECTION_OFFSET": h / 2 - 0.5, "SAMPLE_PROJECTION_OFFSET": w / 2 - 0.5, "MAP_SCALE": f"{RADIUS * np.pi / 180 / resolution:.2f} <m/pix>",
            "COORDINATE_SYSTEM_NAME": '"MEAN EARTH"', **(keys or {})}
    row = w * array.itemsize
    pointer = pointer or (2 if attached else f'"{name}.IMG"')
    text = f"PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = {row}\r\nFILE_RECORDS = {h}\r\n^IMAGE = {pointer}\r\nOBJECT = IMAGE\r\n"
    text += f" LINES = {h}\r\n LINE_SAMPLES = {w}\r\n SAMPLE_TYPE = {kind}\r\n SAMPLE_BITS = {8 * array.itemsize}\r\n"
    text += "".join(f" {k} = {v}\r\n" for k, v in image.items()) + "END_OBJECT = IMAGE\r\nOBJECT = IMAGE_MAP_PROJECTION\r\n"
    text += "".join(f" {k} = {v}\r\n" for k, v in keys.items() if v is not None) + "END_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n"
    if attached:
        size = -(-len(text) // row) * row
        text = text.replace(f"^IMAGE = {pointer}", f"^IMAGE = {size // row + 1}")
        (folder / f"{name}.IMG").write_bytes(text.encode().ljust(size) + array.tobytes())
        return folder / f"{name}.IMG"
    (folder / f"{name}.IMG").write_bytes(array.tobytes())
    (folder / f"{name}.LBL").write_text(text, newline="")
    return folder / f"{name}.LBL"


EQC = "+proj=eqc +lon_0=180 +R=1737400 +units=m +no_defs"
PIXEL = RADIUS * np.pi / 180
CORNERS = ["-a_ullr", str(-180 * PIXEL), str(90 * PIXEL), str(180 * PIXEL), str(-90 * PIXEL)]


def geotiff(name, array, *more, srs=EQC, corners=CORNERS, options=("-co", "TILED=YES")):
    """A GeoTIFF through a raw file with an ENVI header."""
    types = {"uint8": 1, "int16": 2, "int32": 3, "float32": 4, "float64": 5, "uint16": 12}
    h, w = array.shape[-2:]
    bands = array.shape[0] if array.ndim == 3 else 1
    raw = folder / f"{name}.raw"
    raw.write_bytes(array.astype(array.dtype.newbyteorder("<")).tobytes())
    (folder / f"{name}.hdr").write_text(f"ENVI\nsamples = {w}\nlines = {h}\nbands = {bands}\nheader offset = 0\nfile type = ENVI Standard\n"
                                        f"data type = {types[array.dtype.name]}\ninterleave = bsq\nbyte order = 0\n")
    out = folder / f"{name}.tif"
    tool("gdal_translate", "-q", *(["-a_srs", srs] if srs else []), *(corners or []), *options, *more, raw, out)
    return out


def location_info(file, places, band=1):
    words = "\n".join(f"{x} {y}" for x, y in places)
    return [float(v) for v in tool("gdallocationinfo", "-valonly", "-b", band, file, input=words).split()]


def same_as_globe(what, texture, array=globe):
    check(f"{what}: every number", texture.numbers.shape[1:] == array.shape and np.array_equal(np.round(texture.numbers[0], 6), array.astype("f8")))
    check(f"{what}: place", angle_near(texture.place("first")[0], 0.5) and near(texture.place("first")[1], 89.5, 1e-9) and
          angle_near(texture.place("last")[0], 359.5) and near(texture.place("last")[1], -89.5, 1e-9), texture.about["corners"])


def formats():
    label = pds3("PLAIN", globe)
    texture, report = imported(label)
    same_as_globe("PDS3, detached label", texture)
    check("PDS3: type", texture.about["type"] == "i16" and report["missing"] == 0, texture.about)
    check("PDS3: heights from the sphere", texture.about["semi_axes_m"] == [RADIUS] * 3)
    same_as_globe("PDS3, data named", imported(folder / "PLAIN.IMG")[0])
    same_as_globe("PDS3, attached label", imported(pds3("ATTACHED", globe, attached=True))[0])
    same_as_globe("PDS3, quoted pointer", imported(pds3("QUOTED", globe, pointer="'QUOTED.IMG'"))[0])
    same_as_globe("PDS3, big endian", imported(pds3("BIG", globe.astype(">i2"), kind="MSB_INTEGER"))[0])
    tiff = geotiff("plain", globe)
    places = [(int(x), int(y)) for x, y in zip(rng.integers(0, W, 200), rng.integers(0, H, 200))]
    for name, driver, options, more in [("tif", "GTiff", ["-co", "TILED=YES", "-co", "COMPRESS=DEFLATE"], []), ("strip.tif", "GTiff", [], []),
                                        ("cog.tif", "COG", ["-co", "COMPRESS=LZW"], []), ("xml", "PDS4", [], []), ("cub", "ISIS3", [], []),
                                        ("jp2", "JP2OpenJPEG", ["-co", "REVERSIBLE=YES", "-co", "QUALITY=100"], []),
                                        ("vrt", "VRT", [], []), ("fits", "FITS", [], ["--edges=0,360,90,-90", "--radius", "1737400"])]:
        file = folder / f"made.{name}"
        tool("gdal_translate", "-q", "-of", driver, *options, tiff, file)
        texture, report = imported(file, *more)
        same_as_globe(driver, texture)
        found = location_info(file, places)
        check(f"{driver}: gdallocationinfo", found == [texture.numbers[0][y][x] for x, y in places])
    # 8 and 16 bits without a place of their own.
    grey = (np.abs(globe.astype("i4")) % 65536).astype("u2")
    tool("gdal_translate", "-q", "-of", "PNG", geotiff("grey", grey, srs=None, corners=None), folder / "grey.png")
    (folder / "grey.png.aux.xml").unlink(missing_ok=True)
    refused("it does not say where its samples are: --edges", folder / "grey.png")
    texture, report = imported(folder / "grey.png", "--edges=0,360,90,-90", "--radius", RADIUS)
    same_as_globe("PNG", texture, grey)
    picture = np.stack([(globe.astype("i4") * k % 256).astype("u1") for k in (1, 2, 3)])
    tool("gdal_translate", "-q", "-of", "PNG", geotiff("rgb", picture, srs=None, corners=None), folder / "rgb.png")
    texture, report = imported(folder / "rgb.png", "--albedo", "--edges=0,360,90,-90")
    check("PNG in colour", texture.about["planes"] == 3 and np.array_equal(np.round(texture.values * 255), picture.astype("f8")))
    check("PNG: not calibrated", "not calibrated" in report["said"])
    tool("gdal_translate", "-q", "-of", "JPEG", folder / "grey8.tif" if (folder / "grey8.tif").exists() else geotiff("grey8", picture[0], srs=None, corners=None), folder / "grey.jpg")
    texture, report = imported(folder / "grey.jpg", "--albedo", "--edges=0,360,90,-90")
    check("JPEG: gdallocationinfo", location_info(folder / "grey.jpg", places) == [round(texture.values[0][y][x] * 255) for x, y in places])


def real_data():
    label = data / "dem_moon_lola_ldem4/LDEM_4.LBL"
    if label.exists():
        texture, report = imported(label)
        truth = np.fromfile(label.with_suffix(".IMG"), "<i2").reshape(720, 1440)
        check("LDEM_4: every DN", np.array_equal(texture.numbers[0], truth) and texture.about["type"] == "i16")
        check("LDEM_4: heights", np.array_equal(texture.values[0], 0.5 * truth) and texture.about["meaning"] == "height")
        check("LDEM_4: place", near(texture.place("first")[0], 0.125, 1e-9) and near(texture.place("first")[1], 89.875, 1e-9))
        check("LDEM_4: MINIMUM of the label", "MINIMUM is -17758" in report["said"], report["said"])
        places = [(int(x), int(y)) for x, y in zip(rng.integers(0, 1440, 300), rng.integers(0, 720, 300))]
        check("LDEM_4: gdallocationinfo", location_info(label, places) == [texture.numbers[0][y][x] for x, y in places])
    else:
        print(f"skipped: {label} is not there")
    for name, size in [("gld100_64ppd_216-232E_42-90S", (1024, 3071)), ("lola_site01_10m", (1600, 1600))]:
        file = data / f"dem_moon_southpole/{name}.tif"
        if not file.exists():
            print(f"skipped: {file} is not there")
            continue
        texture, report = imported(file)
        places = [(int(x), int(y)) for x, y in zip(rng.integers(0, size[0], 500), rng.integers(0, size[1], 500))]
        # Values are f32: numbers follow from them by rounding.
        numbers = np.round(texture.numbers[0])
        check(f"{name}: the numbers are whole", np.abs(texture.numbers[0] - numbers).max() < 0.01)
        check(f"{name}: gdallocationinfo", location_info(file, places) == [numbers[y][x] for x, y in places])
        if name.startswith("gld100"):
            check("gld100: place", near(texture.place("first")[0], -144 + 0.5 / 64, 1e-9) and near(texture.place("last")[1], -42 - 3070.5 / 64, 1e-9))
        else:
            x, y = -19000 + 5, -4000 - 5
            rho = np.hypot(x, y)
            check("Site01: place", near(texture.place("first")[0], np.degrees(np.arctan2(x, y)), 1e-9) and
                  near(texture.place("first")[1], -90 + 2 * np.degrees(np.arctan(rho / 2 / RADIUS)), 1e-9), texture.about["corners"])


def label_traps():
    # Radii: by OFFSET, as values, in kilometres.
    texture, report = imported(pds3("RADII", globe, image={"SCALING_FACTOR": 0.5, "OFFSET": RADIUS}))
    check("OFFSET = radius", np.array_equal(texture.values[0], 0.5 * globe) and "radii" in report["said"])
    radii_km = ((RADIUS + globe) / 1000).astype("<f4")
    texture, report = imported(pds3("KM", radii_km, image={"UNIT": "KILOMETER", "SCALING_FACTOR": 1, "OFFSET": 0}, kind="PC_REAL"))
    check("radii in km", np.abs(texture.values[0] - (radii_km.astype("f8") * 1000 - RADIUS)).max() < 2e-3 and texture.about["meaning"] == "height")
    texture, report = imported(pds3("NOUNIT", radii_km, image={"UNIT": '"N/A"'}, kind="PC_REAL"))
    check("radii in km, no unit", np.abs(texture.values[0] - (radii_km.astype("f8") * 1000 - RADIUS)).max() < 2e-3 and "kilometres are taken" in report["said"], report["said"])
    texture, report = imported(pds3("RAW", radii_km, image={"UNIT": "KILOMETER"}, kind="PC_REAL"), "--values", "radius", "--radii", "1738100,1738100,1736000")
    check("radii above an ellipsoid stay radii", texture.about["meaning"] == "radius" and np.abs(texture.values[0] - radii_km.astype("f8") * 1000).max() < 0.2)
    # Units that cannot be.
    km = (globe / 1000).astype("<f4")
    check("km taken for m", "kilometres taken for metres" in imported(pds3("SMALL", km, kind="PC_REAL"))[1]["said"])
    check("km by --unit", np.abs(imported(pds3("SMALL", km, kind="PC_REAL"), "--unit", "km")[0].values[0] - km.astype("f8") * 1000).max() < 1e-3)
    refused("through its centre", pds3("HUGE", globe, image={"UNIT": "KILOMETER"}))
    check("m taken for km", "metres taken for kilometres" in imported(pds3("LARGE", (globe / 5 + 600).astype("<i2"), image={"UNIT": "KILOMETER"}))[1]["said"])
    check("another body", "is it another body?" in imported(pds3("BODY", globe), "--radius", 3396190)[1]["said"])
    plain = geotiff("unplaced", globe, srs=None, corners=None)
    refused("it does not say the body's radius", plain, "--edges=0,360,90,-90")
    # A label that is wrong about its data; one that is right says nothing.
    check("wrong MINIMUM", f"MINIMUM is {globe.min() - 1}" in imported(pds3("MIN", globe, image={"MINIMUM": globe.min() - 1}))[1]["said"])
    check("right MINIMUM", not imported(pds3("MIN", globe, image={"MINIMUM": globe.min(), "MAXIMUM": globe.max()}))[1]["warnings"])
    # Missing samples by the label only: GDAL makes up 0 for bytes.
    holes = globe.copy()
    holes[20:30, 40:50] = -32768
    texture, report = imported(pds3("HOLES", holes, image={"MISSING_CONSTANT": -32768}))
    check("MISSING_CONSTANT", np.array_equal(np.isnan(texture.values[0]), holes == -32768) and report["missing"] == 100, report["missing"])
    byte = (np.abs(globe) % 256).astype("u1")
    texture, report = imported(pds3("BYTES", byte, image={"UNIT": '"N/A"', "SCALING_FACTOR": 0.01}, kind="UNSIGNED_INTEGER"), "--albedo")
    check("0 of bytes is a number", not np.isnan(texture.values).any() and np.array_equal(np.round(texture.numbers[0]), byte))
    # The scale of a JPEG 2000 image is in its label only.
    tool("gdal_translate", "-q", "-of", "JP2OpenJPEG", "-co", "REVERSIBLE=YES", "-co", "QUALITY=100", geotiff("scaled", globe), folder / "SCALED.JP2")
    pds3("SCALED", globe, image={"SCALING_FACTOR": 0.5})
    (folder / "SCALED.IMG").unlink()
    check("JPEG 2000: scale of the label", np.array_equal(imported(folder / "SCALED.JP2")[0].values[0], 0.5 * globe))
    # ISIS: numbers at the ends of the range are no samples.
    cube = globe.copy()
    cube[3, 4:9] = [-32768, -32767, -32766, -32765, -32764]
    tool("gdal_translate", "-q", "-of", "ISIS3", geotiff("special", cube), folder / "special.cub")
    texture, report = imported(folder / "special.cub")
    check("ISIS: special pixels", np.array_equal(np.isnan(texture.values[0]), cube < -32752) and report["missing"] == 5)
    # Masks and bands of opacity.
    shown = np.stack([byte, np.where(byte % 5 == 0, 0, 255).astype("u1")])
    tool("gdal_translate", "-q", "-b", "1", "-mask", "2", "-co", "PHOTOMETRIC=MINISBLACK", "--config", "GDAL_TIFF_INTERNAL_MASK", "YES", geotiff("shown", shown), folder / "masked.tif")
    texture, report = imported(folder / "masked.tif", "--albedo")
    check("internal mask", np.array_equal(np.isnan(texture.values[0]), byte % 5 == 0) and
          np.array_equal(np.round(texture.numbers[0][byte % 5 != 0]), byte[byte % 5 != 0]), texture.about["type"])
    tool("gdal_translate", "-q", "-of", "PNG", "-colorinterp", "gray,alpha", geotiff("opaque", shown, srs=None, corners=None), folder / "opaque.png")
    texture, report = imported(folder / "opaque.png", "--albedo", "--edges=0,360,90,-90")
    check("band of opacity", np.array_equal(np.isnan(texture.values[0]), byte % 5 == 0) and not report["warnings"], report["said"])
    # A grid of nodes, the meridian 0 twice.
    node = np.pad(globe, ((0, 1), (0, 1)), mode="wrap").astype("<i2")
    texture, report = imported(pds3("NODES", node, keys={"MAP_RESOLUTION": "1 <pix/deg>", "LINE_PROJECTION_OFFSET": 90, "SAMPLE_PROJECTION_OFFSET": 180}))
    check("nodes", texture.about["registration"] == "node" and angle_near(texture.place("first")[0], 0) and angle_near(texture.place("last")[0], 0) and
          near(texture.place("first")[1], 90, 1e-9) and np.array_equal(texture.numbers[0], node), texture.about["corners"])
    # A row too low, as one set of public tiles is.
    low, _ = imported(pds3("LOW", globe[:90], keys={"MAXIMUM_LATITUDE": 45, "MINIMUM_LATITUDE": -45, "LINE_PROJECTION_OFFSET": 44.5}), "--shift=0,-1")
    check("--shift", near(low.place("first")[1], 45.5, 1e-9))
    # Damaged files.
    short = pds3("SHORT", globe)
    (folder / "SHORT.IMG").write_bytes(globe.tobytes()[:-1000])
    refused("SHORT", short)
    refused("SHORTQ", shorter("SHORTQ"))
    (folder / "text.tif").write_text("no map at all")
    refused("text.tif: GDAL cannot read it", folder / "text.tif")
    refused("missing.tif: cannot be opened", folder / "missing.tif")
    broken = plain.read_bytes()
    (folder / "broken.tif").write_bytes(broken[: len(broken) // 2])
    refused("broken.tif", folder / "broken.tif", "--edges=0,360,90,-90", "--radius", RADIUS)
    pds3("WIDE", globe)
    text = (folder / "WIDE.LBL").read_text().replace(f"LINE_SAMPLES = {W}", "LINE_SAMPLES = 2147483648")
    (folder / "WIDE.LBL").write_text(text)
    refused("WIDE.LBL", folder / "WIDE.LBL")
    palette = folder / "palette.vrt"
    palette.write_text('<VRTDataset rasterXSize="2" rasterYSize="2"><VRTRasterBand dataType="Byte" band="1"><ColorInterp>Palette</ColorInterp>'
                       '<ColorTable><Entry c1="1" c2="2" c3="3" c4="255"/></ColorTable></VRTRasterBand></VRTDataset>')
    refused("numbers of colours", palette, "--albedo", "--edges=0,360,90,-90")


def shorter(name):
    label = pds3(name, globe, pointer=f"'{name}.IMG'")
    (folder / f"{name}.IMG").write_bytes(globe.tobytes()[:-1000])
    return label


def filled_by_numpy(values, wraps):
    """Normalised convolution on a Gaussian pyramid, written for clarity."""
    kernel = np.array([1, 4, 6, 4, 1]) / 16
    levels = [(np.where(np.isnan(values), 0, values), (~np.isnan(values)).astype("f8"))]
    while levels[-1][0].shape != (1, 1):
        v, w = levels[-1]
        h, n = v.shape
        num, den = np.zeros(((h + 1) // 2, (n + 1) // 2)), np.zeros(((h + 1) // 2, (n + 1) // 2))
        for j in range(num.shape[0]):
            for dj in range(-2, 3):
                y = 2 * j + dj
                if not 0 <= y < h:
                    continue
                for di in range(-2, 3):
                    x = 2 * np.arange(num.shape[1]) + di
                    inside = np.ones(len(x), bool) if wraps else (x >= 0) & (x < n)
                    k = kernel[dj + 2] * kernel[di + 2] * w[y, x % n] * inside
                    num[j] += k * v[y, x % n]
                    den[j] += k
        levels.append((np.divide(num, den, out=np.zeros_like(num), where=den > 0), den))
    above = levels[-1][0]
    for v, w in reversed(levels[:-1]):
        def expand(a, size, axis, wrap):
            a = np.moveaxis(a, axis, 0)
            out = np.zeros((size, *a.shape[1:]))
            for x in range(size):
                taps = [(x // 2 - 1, 1), (x // 2, 6), (x // 2 + 1, 1)] if x % 2 == 0 else [(x // 2, 4), (x // 2 + 1, 4)]
                taps = [(i % len(a), k) for i, k in taps if wrap or 0 <= i < len(a)]
                out[x] = sum(k * a[i] for i, k in taps) / sum(k for _, k in taps)
            return np.moveaxis(out, 0, axis)
        up = expand(expand(above, v.shape[0], 0, False), v.shape[1], 1, wraps)
        w = np.minimum(w, 1)
        above = w * v + (1 - w) * up
    return above


def holes():
    for what, shape, wraps in [("a whole turn", (90, 180), True), ("a region of odd size", (77, 53), False)]:
        h, w = shape
        y, x = np.mgrid[0:h, 0:w]
        values = (300 * np.sin(2 * np.pi * x / w) * np.cos(y / 20) + rng.normal(0, 20, shape)).astype("f4")
        values[rng.random(shape) < 0.1] = np.nan
        values[10:31, :17] = np.nan
        values[20:40, -6:] = np.nan
        values[-9:] = np.nan
        corners = CORNERS if wraps else ["-a_ullr", "0", str(77 * PIXEL / 4), str(53 * PIXEL / 4), "0"]
        file = geotiff("holes", values, corners=corners)
        mask = folder / "mask.obt"
        texture, report = imported(file, "--fill", "gaussian", "--mask", mask)
        wanted = filled_by_numpy(values.astype("f8"), wraps)
        check(f"holes of {what}: report", report["missing"] == report["filled"] == np.isnan(values).sum(), report)
        there = ~np.isnan(values)
        check(f"holes of {what}: samples that are there stay", np.array_equal(texture.values[0][there], values[there]))
        error = np.abs(texture.values[0] - wanted)[~there]
        check(f"holes of {what}: as numpy fills them", error.max() < 2e-3, error.max())
        check(f"holes of {what}: mask", np.array_equal(Texture(mask).values[0], np.isnan(values).astype("f8")))
    # Left open, they are missing; integers stay integers.
    texture, report = imported(geotiff("open", globe, "-a_nodata", "-500"))
    check("a number for missing samples", np.array_equal(np.isnan(texture.values[0]), globe == -500) and texture.about["type"] == "i16")
    rows = globe.copy()
    rows[60:70] = -9999
    texture, report = imported(geotiff("whole", rows, "-a_nodata", "-9999"), "--fill", "gaussian")
    wanted = filled_by_numpy(np.where(rows == -9999, np.nan, rows), True)
    check("filled integers", np.abs(texture.values[0] - wanted).max() < 0.51 and np.array_equal(texture.values[0], np.round(texture.values[0])))
    refused("there is nothing to fill holes from", geotiff("void", np.full((8, 8), -1, "i2"), "-a_nodata", "-1", corners=["-a_ullr", "0", "8", "8", "0"]), "--fill", "gaussian")


def mosaics():
    # Quarters around the meridian 0, in an order that begins in the middle.
    def tile(name, left, right, top, bottom):
        part = globe[90 - top : 90 - bottom, left:right]
        return geotiff(name, part, corners=["-a_ullr", str((left - 180) * PIXEL), str(top * PIXEL), str((right - 180) * PIXEL), str(bottom * PIXEL)])
    tiles = [tile("t1", 180, 270, 90, 0), tile("t2", 0, 180, 90, 0), tile("t3", 270, 360, 90, 0), tile("t4", 0, 360, 0, -90)]
    texture, report = imported(*tiles)
    check("a mosaic of a whole turn", np.array_equal(np.roll(texture.numbers[0], round(texture.place("first")[0] - 0.5), axis=1), globe), texture.about["corners"])
    texture, report = imported(tiles[2], tiles[1])
    check("tiles across the seam are neighbours", texture.about["width"] == 270 and
          np.array_equal(texture.numbers[0], np.hstack([globe[:90, 270:], globe[:90, :180]])) and angle_near(texture.place("first")[0], 270.5))
    texture, report = imported(tiles[0], tiles[3])
    check("gaps are missing", np.isnan(texture.values[0][:90]).sum() == 270 * 90 and not np.isnan(texture.values[0][90:]).any())
    vrt = folder / "all.vrt"
    tool("gdalbuildvrt", "-q", vrt, *tiles)
    same_as_globe("VRT of tiles", imported(vrt)[0])
    other = geotiff("t5", globe[:90, :180], corners=["-a_ullr", str(-179.5 * PIXEL), str(90 * PIXEL), str(0.5 * PIXEL), "0"])
    refused("of a pixel off the grid of", tiles[0], other)
    refused("has pixels of another size than", tiles[0], geotiff("t6", globe[:90, :180], corners=["-a_ullr", "0", str(45 * PIXEL), str(90 * PIXEL), "0"]))
    refused("another scale, offset or unit", tiles[0], geotiff("t7", globe[:90, :180], "-a_scale", "2", corners=["-a_ullr", str(-180 * PIXEL), str(90 * PIXEL), "0", "0"]))


def catmull_rom(f):
    return np.array([((-0.5 * f + 1) * f - 0.5) * f, (1.5 * f - 2.5) * f * f + 1, ((-1.5 * f + 2) * f + 0.5) * f, (0.5 * f - 0.5) * f * f])


def resampled():
    # Mercator of a whole turn to 70 degrees: interpolation must go on across the seam.
    h = w = 400
    half = np.pi * RADIUS
    top = RADIUS * np.log(np.tan(np.pi / 4 + np.radians(70) / 2))
    values = (3 * np.sin(np.arange(w) * 2 * np.pi / w)[None, :] * np.cos(np.arange(h) / 30)[:, None] + rng.normal(0, 0.3, (h, w))).astype("f4")
    file = geotiff("mercator", values, "-a_nodata", "none", srs="+proj=merc +lon_0=0 +R=1737400 +units=m", corners=["-a_ullr", str(-half), str(top), str(half), str(-top)])
    texture, report = imported(file)
    check("Mercator: said", "resampled to simple cylindrical" in report["said"], report["said"])
    worst, compared = 0, 0
    a = texture.about
    left, right = texture.place("first")[0], texture.place("last")[0]
    step = (right - left) % 360 / (a["width"] - 1)
    for row in range(2, a["height"] - 2, 7):
        lat = texture.place("first")[1] + (texture.place("last")[1] - texture.place("first")[1]) * row / (a["height"] - 1)
        v = (top - RADIUS * np.log(np.tan(np.pi / 4 + np.radians(lat) / 2))) / (2 * top / h) - 0.5
        if not 1.1 < v < h - 2.1:
            continue
        for column in list(range(0, a["width"], 11)) + [0, 1, 2, a["width"] // 2 - 1, a["width"] // 2, a["width"] - 2, a["width"] - 1]:
            lon = (left + column * step + 180) % 360 - 180
            u = (lon + 180) / 360 * w - 0.5
            i, j = int(np.floor(u)), int(np.floor(v))
            taps = values[np.ix_(range(j - 1, j + 3), [k % w for k in range(i - 1, i + 3)])].astype("f8")
            wanted = catmull_rom(v - j) @ taps @ catmull_rom(u - i)
            worst = max(worst, abs(texture.values[0][row][column] - wanted))
            compared += 1
    check("Mercator: direct sampling", compared > 500 and worst < 2e-6, (worst, compared))
    # About the pole in another projection: to polar stereographic, whole at the pole.
    n = 200
    p = (np.arange(n) - n / 2 + 0.5) * 1000
    X, Y = np.meshgrid(p, -p)
    truth = lambda x, y: 2 * np.sin(x / 30000) + np.cos(y / 20000)
    colat = 2 * np.arcsin(np.hypot(X, Y) / 2 / RADIUS)
    sphere = lambda x, y, c: (np.sin(c) * x / np.maximum(np.hypot(x, y), 1e-9), np.sin(c) * y / np.maximum(np.hypot(x, y), 1e-9))
    sx, sy = sphere(X, Y, colat)
    file = geotiff("laea", truth(sx * RADIUS, sy * RADIUS).astype("f4"), srs="+proj=laea +lat_0=-90 +lon_0=0 +R=1737400 +units=m",
                   corners=["-a_ullr", str(-n * 500), str(n * 500), str(n * 500), str(-n * 500)])
    texture, report = imported(file)
    a = texture.about
    check("Lambert at the pole: polar stereographic", a["projection"] == "south_polar_stereographic", a["projection"])
    t = a["transform"]
    x = t[0] + t[1] * (np.arange(a["width"]) + 0.5)
    y = t[3] + t[5] * (np.arange(a["height"]) + 0.5)
    X, Y = np.meshgrid(x, y)
    c = 2 * np.arctan(np.hypot(X, Y) / 2 / RADIUS)
    sx, sy = sphere(X, Y, c)
    error = np.abs(texture.values[0] - truth(sx * RADIUS, sy * RADIUS))
    inside = (np.abs(X) < 90000) & (np.abs(Y) < 90000)
    check("Lambert at the pole: heights", np.nanmax(np.where(inside, error, 0)) < 2e-5 and not np.isnan(texture.values[0][inside]).any(), np.nanmax(np.where(inside, error, 0)))
    refused("gdalbuildvrt", folder / "mercator.tif", folder / "laea.tif")


def failing():
    # Three blocks of the writer.
    big = rng.integers(-3000, 3000, (9000, 3000)).astype("<i2")
    label = geotiff("larger", big, srs=None, corners=None)
    out = folder / "larger.obt"
    good = folder / "good.obt"
    run(label, "-o", good, "--title", "large", "--planar", "10")

    def children(pid):
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    if int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1]) == pid:
                        found.append(int(entry.name))
                except (OSError, IndexError, ValueError):
                    pass
        return found

    # A helper that takes its time, so that there is time to end it.
    slow = folder / "slow"
    slow.write_text(f"""#!{sys.executable}
import struct, subprocess, sys, time
helper = subprocess.Popen([{str(pathlib.Path(obscura).parent / "obscura-gdal")!r}], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
while len(header := sys.stdin.buffer.read(16)) == 16:
    helper.stdin.write(header + sys.stdin.buffer.read(struct.unpack("<IIQ", header)[2]))
    helper.stdin.flush()
    answer = helper.stdout.read(16)
    time.sleep(0.5)
    sys.stdout.buffer.write(answer + helper.stdout.read(struct.unpack("<IIQ", answer)[2]))
    sys.stdout.buffer.flush()
""")
    slow.chmod(0o755)
    slowly = {"env": {**os.environ, "OBSCURA_GDAL": str(slow)}, "stderr": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    command = [obscura, "import", "map", str(label), "-o", str(out), "--title", "large", "--planar", "10"]

    def begun(least_bytes=0):
        until = time.monotonic() + 60
        process = subprocess.Popen(command, **slowly)
        while not [f for f in folder.glob("larger.obt*") if f.stat().st_blocks * 512 >= least_bytes] and time.monotonic() < until and process.poll() is None:
            time.sleep(0.01)
        return process

    started = begun()
    for pid in children(started.pid):
        os.kill(pid, signal.SIGKILL)
    _, said = started.communicate(timeout=120)
    check("helper killed: one line", started.returncode == 66 and len(lines_of(said)) == 1 and "signal 9" in said, said)
    check("helper killed: nothing is left", not list(folder.glob("larger.obt*")), list(folder.glob("larger.obt*")))
    # A helper that answers no more.
    hung = folder / "hung"
    hung.write_text("#!/bin/sh\nexec sleep 60\n")
    hung.chmod(0o755)
    refused("has not answered within 0.3 s", label, "--planar", "10", "--time-limit", "0.3", env={**os.environ, "OBSCURA_GDAL": str(hung)})
    refused("obscura-gdal", label, "--helper-memory", "64")
    refused("obscura-gdal is missing", label, status=69, env={**os.environ, "OBSCURA_GDAL": "/nonexistent"})

    def small_files():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))

    refused("refused.obt", label, "--planar", "10", status=74, preexec_fn=small_files, restore_signals=False)
    holes = big.copy()
    holes[::3] = -9999
    # The file for filling holes is the first that is too long.
    refused("cannot be written", geotiff("largeholes", holes, "-a_nodata", "-9999", srs=None, corners=None), "--planar", "10", "--fill", "gaussian", status=74, preexec_fn=small_files, restore_signals=False)
    # Interrupted, and gone on with: the same bytes.
    started = begun(1 << 20)
    started.send_signal(signal.SIGINT)
    _, said = started.communicate(timeout=120)
    check("interrupted: said", started.returncode == -signal.SIGINT and "the same command goes on" in said, said)
    check("interrupted: not there yet", not out.exists() and (folder / "larger.obt.part").exists())
    resumed = json.loads(run(*command[3:], "--json").stdout)
    check("gone on with what was done", resumed["resumed_tiles"] > 0, resumed["resumed_tiles"])
    # What was done of a file that has changed since is of no use.
    for file in folder.glob("larger.obt*"):
        file.unlink()
    started = begun()
    started.send_signal(signal.SIGINT)
    started.communicate(timeout=120)
    label.touch()
    resumed = json.loads(run(*command[3:], "--json").stdout)
    check("begun anew after a change", resumed["resumed_tiles"] == 0, resumed["resumed_tiles"])
    check("interrupted and gone on with: the same bytes", out.exists() and out.read_bytes() == good.read_bytes())


for part in (formats, real_data, label_traps, holes, mosaics, resampled, failing):
    if len(sys.argv) < 5 or part.__name__ in sys.argv[4:]:
        part()
if not failures:
    shutil.rmtree(folder)
print(f"{len(failures)} failures" + (f", files in {folder}" if failures else ""))
sys.exit(1 if failures else 0)
