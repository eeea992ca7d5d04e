#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Giant textures read by numpy after docs/textures.md alone, by the verbs `obscura texture`, and their exports by GDAL (where
it is installed).

Usage: texture_test.py OBSCURA TEXTURE_FILES
Exit status 1 if a check failed.
"""
import json
import math
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from verb_checks import VerbChecks  # noqa: E402

obscura, maker = sys.argv[1:3]
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-texture-"))
os.chdir(folder)
verbs = VerbChecks(obscura, "texture")
run, refused = verbs.run, verbs.check_refused


def check(what, good, detail=""):
    if not good:
        verbs.fail(what, detail)


def crc32c(data):
    table = []
    for i in range(256):
        for _ in range(8):
            i = i >> 1 ^ 0x82F63B78 if i & 1 else i >> 1
        table.append(i)
    crc = 0xFFFFFFFF
    for byte in data:
        crc = table[(crc ^ byte) & 0xFF] ^ crc >> 8
    return crc ^ 0xFFFFFFFF


class Texture:
    """What docs/textures.md says of the format, and no more."""

    def __init__(self, path):
        shards = sorted(path.parent.glob(path.name + "*"))
        self.bytes = b"".join(shard.read_bytes() for shard in shards)
        h = self.bytes
        assert h[:8] == b"OBSTEX\r\n" and struct.unpack_from("<II", h, 8) == (1, 4096)
        self.header_crc = crc32c(h[:4092]) == struct.unpack_from("<I", h, 4092)[0]
        self.flags, = struct.unpack_from("<I", h, 16)
        self.dtype = np.dtype(["u1", "<i2", "<u2", "<f2", "<f4"][h[21]])
        self.planes, = struct.unpack_from("<H", h, 26)
        self.levels, = struct.unpack_from("<I", h, 36)
        self.size = struct.unpack_from("<QQ", h, 40)
        self.scale, self.offset = struct.unpack_from("<dd", h, 160)
        self.nodata = struct.unpack_from("<i", h, 180)[0] if self.flags & 8 else None
        self.file_bytes, = struct.unpack_from("<Q", h, 192)
        self.roots = [struct.unpack_from("<Q", h, 1280 + 48 * k)[0] for k in range(self.planes)]
        self.ranges = [struct.unpack_from("<3d", h, 1280 + 48 * k + 16) for k in range(self.planes)]
        toml_bytes, = struct.unpack_from("<I", h, 208)
        self.toml = h[4096:4096 + toml_bytes].decode()

    def level_size(self, level):
        return tuple(-(-s // 2 ** level) for s in self.size)

    def tile(self, plane, level, i, j):
        depth = self.levels - 1 - level
        assert depth < 5  # one block
        place = self.roots[plane] + 24 * ((4 ** depth - 1) // 3 + j * 2 ** depth + i)
        entry = self.bytes[place:place + 24]
        slot = int.from_bytes(entry[:6], "little") * 4096
        state, holes = entry[6] & 127, entry[6] >> 7
        step = 2.0 ** struct.unpack_from("<b", entry, 7)[0]
        base, = struct.unpack_from("<i", entry, 8)
        assert state in (1, 2)
        dtype = np.dtype("<f4") if state == 2 else self.dtype
        raw = self.bytes[slot:slot + 260 * 260 * dtype.itemsize]
        crc_good = crc32c(entry[:20] + raw) == struct.unpack_from("<I", entry, 20)[0] if (i, j) == (1, 1) else True
        codes = np.frombuffer(raw, dtype).reshape(260, 260)
        numbers = codes.astype(float)
        if self.flags & 2 and state == 1:
            numbers = (base + codes.astype(float)) * step
            if holes:
                numbers[codes == 65535] = np.nan
        elif self.nodata is not None:
            numbers[codes == self.nodata] = np.nan
        return numbers, crc_good

    def level(self, plane, level):
        width, height = self.level_size(level)
        out = np.full((height, width), np.nan)
        good = True
        for j in range(-(-height // 256)):
            for i in range(-(-width // 256)):
                numbers, crc = self.tile(plane, level, i, j)
                good = good and crc
                rows, columns = min(256, height - 256 * j), min(256, width - 256 * i)
                out[256 * j:256 * j + rows, 256 * i:256 * i + columns] = numbers[2:2 + rows, 2:2 + columns]
        return self.offset + self.scale * out, good


def numbers(width, height, plane):
    y, x = np.mgrid[0:height, 0:width]
    return (x * 31 + y * 17 + plane * 5) % 2003


def area_mean(values):
    """The next level: means of 2 x 2, without missing ones, of what there is at the edges."""
    padded = np.full([s + s % 2 for s in values.shape], np.nan)
    padded[:values.shape[0], :values.shape[1]] = values
    quads = np.stack([padded[0::2, 0::2], padded[0::2, 1::2], padded[1::2, 0::2], padded[1::2, 1::2]])
    with np.errstate(invalid="ignore"):
        return np.nansum(quads, axis=0) / np.sum(~np.isnan(quads), axis=0)


subprocess.run([maker, folder], check=True, timeout=120)
expected = {}
for name, numbers_of in {"u8": lambda n: n % 256, "i16": lambda n: n - 1000, "u16": lambda n: n, "f16": lambda n: n / 8,
                         "f32": lambda n: n / 8}.items():
    texture = Texture(folder / f"{name}.obt")
    check(f"{name}: the header has its checksum and size", texture.header_crc and texture.file_bytes == len(texture.bytes))
    for plane in range(2):
        wanted = numbers_of(numbers(1000, 600, plane)).astype(float)
        if name == "i16":
            wanted[:30, :20] = np.nan
        expected[name, plane] = wanted
        got, good = texture.level(plane, 0)
        check(f"{name}, plane {plane}: numpy reads the numbers that were written", np.array_equal(got, wanted, equal_nan=True))
        check(f"{name}, plane {plane}: checksum of a tile", good)
        least, largest, mean = texture.ranges[plane]
        check(f"{name}, plane {plane}: range and mean", least == np.nanmin(wanted) and largest == np.nanmax(wanted) and
              abs(mean - np.nanmean(wanted)) < 0.3, (least, largest, mean, np.nanmean(wanted)))
        for level in range(1, texture.levels):
            wanted = area_mean(wanted)
            got, _ = texture.level(plane, level)
            # Rounded to whole numbers, or by f16; levels of odd size weigh their last samples by area.
            bound = {"f32": 1e-4, "f16": 0.13}.get(name, 0.51)
            worst = np.nanmax(np.abs(got - wanted)[:-2, :-2])
            check(f"{name}, plane {plane}, level {level}: area means", worst <= bound, worst)
    if "nodata" in texture.toml or name != "i16":
        check(f"{name}: the text for people", f'type = "{name}"' in texture.toml and 'licence = "CC0"' in texture.toml)
    check(f"{name}: whole", "damaged" in run("check", f"{name}.obt"))

moon = Texture(folder / "moon.obt")
check("moon: of several parts", (folder / "moon.obt.001").exists())
wanted = numbers(720, 360, 0) / 8 + np.where(np.arange(720)[None, :] > 400, 6000.0 * (np.arange(360)[:, None] % 2), 0)
got, good = moon.level(0, 0)
check("moon: heights within half a step", np.abs(got - wanted).max() <= 0.0625 and good, np.abs(got - wanted).max())
check("moon: calm tiles are exact", np.array_equal(got[:, :256], wanted[:, :256]))

# The verbs.
info = json.loads(run("info", "moon.obt", "--json"))
check("info: size, projection, range", (info["width"], info["height"], info["projection"], info["levels"]) ==
      (720, 360, "simple_cylindrical", 3) and info["plane_values"][0]["least"] == 0, info)
check("info: missing samples", "samples are missing" in run("info", "i16.obt"))
for lat, lon in [(89.9, 0.1), (-45.3, 200.7), (0.25, 359.9), (12.1, -0.1), (-89.99, 123)]:
    sample = json.loads(run("sample", "moon.obt", lat, lon, "--json"))
    column, row = int(lon % 360 * 2), int((90 - lat) * 2)
    check(f"sample at {lat}, {lon}: column and row", (sample["column"], sample["row"]) == (column, row), sample)
    check(f"sample at {lat}, {lon}: number", sample["nearest"] == got[row, column], (sample, got[row, column]))
# Linear between samples, over the seam.
left, right = json.loads(run("sample", "moon.obt", 10.25, 359.75, "--json")), json.loads(run("sample", "moon.obt", 10.25, 0.25, "--json"))
middle = json.loads(run("sample", "moon.obt", 10.25, 0, "--json"))
check("sample: linear over the seam", abs(middle["value"] - (left["value"] + right["value"]) / 2) < 1e-6, (left, middle, right))
sample = json.loads(run("sample", "f32.obt", "--map", "--json", "--", -10050, -20050))
check("sample by map", (sample["column"], sample["row"]) == (299, 400) and
      sample["nearest_1"] == expected["f32", 1][400, 299], sample)
# The south polar stereographic place by its formula: rho = 2 R tan(colatitude / 2).
lat, lon = -89.2, 30.0
rho = 2 * 1737400 * math.tan(math.radians(90 + lat) / 2)
x, y = rho * math.sin(math.radians(lon)), rho * math.cos(math.radians(lon))
sample = json.loads(run("sample", "f32.obt", lat, lon, "--json"))
check("sample: south polar stereographic", (sample["column"], sample["row"]) == (int((x + 50000) // 100), int((30000 - y) // 100)), sample)
check("sample without data is null", json.loads(run("sample", "i16.obt", "--pixel", 3, 4, "--json"))["nearest_0"] is None)
refused(["sample", "f32.obt", 10, 0], 66, "outside of its 1000 x 600 samples")
refused(["sample", "moon.obt", 91, 0], 64, "-90 to 90")
refused(["sample", "moon.obt", 0, 0, "--level", 7], 64, "levels 0 to 2")

# No terrain to bake.
demo = pathlib.Path(__file__).resolve().parents[2] / "config/scenes/demo.toml"
refused(["bake", demo, "--spacing", 1, "-o", "x.obt"], 78, "demo.toml: no body is a planet or terrain")
check("nothing is left of it", not list(folder.glob("x.obt*")))

# Boulders that overhang near the camera are domes in maps.
highest = []
for rocks in ("", "boulder_rock_px = 0\n"):
    (folder / "strewn.toml").write_text("[[body]]\nname = \"ground\"\nshape = \"terrain\"\nhalf_edge_m = 12\nalbedo = 0.2\n[body.detail]\n"
                                        "boulders_per_m2 = 0.1\nboulder_least_m = 1\nboulder_largest_m = 3\n" + rocks)
    made = json.loads(run("bake", "strewn.toml", "--spacing", 0.05, "-o", "strewn.obt", "--restart", "--json"))
    highest.append(made["largest_m"])
check("baked boulders are domes", highest[0] == highest[1] and highest[0] > 0.5, highest)

# Damage.
whole = (folder / "u16.obt").read_bytes()
(folder / "cut.obt").write_bytes(whole[:200000])
refused(["info", "cut.obt"], 66, "cut.obt: 200000 bytes, where the header of the texture states")
(folder / "text.obt").write_text("no texture")
refused(["check", "text.obt"], 66, "it does not begin with OBSTEX")
refused(["info", "none.obt"], 66, "none.obt")
(folder / "bit.obt").write_bytes(whole[:100000] + bytes([whole[100000] ^ 1]) + whole[100001:])
refused(["check", "bit.obt"], 1, "tile (0, 0) of level 2, plane 0 at byte 16384: its checksum does not match")

# GDAL as a second reader of the exports.
run("export", "u16.obt", "-o", "u16.tif")
run("export", "moon.obt", "-o", "moon.tif")
run("export", "i16.obt", "-o", "i16.tif")
run("export", "f32.obt", "--level", 1, "-o", "f32.tif")
refused(["export", "f32.obt", "--level", 9, "-o", "x.tif"], 64, "levels 0 to 2")
if shutil.which("gdallocationinfo") is None:
    print("skipped: GDAL reads the exports: gdallocationinfo is not installed")
else:
    def gdal(file, x, y, *options):
        done = subprocess.run(["gdallocationinfo", "-valonly", *options, file, str(x), str(y)], capture_output=True,
                              text=True, timeout=60)
        return [float(v) for v in done.stdout.split()]
    check("GDAL reads u16", gdal("u16.tif", 777, 555) == [expected["u16", p][555, 777] for p in (0, 1)])
    check("GDAL reads heights", gdal("moon.tif", 500, 99) == [got[99, 500]])
    check("GDAL finds places on the map", gdal("f32.tif", -10100, -20100, "-geoloc") ==
          [Texture(folder / "f32.obt").level(p, 1)[0][250, 199] for p in (0, 1)])
    facts = json.loads(subprocess.run(["gdalinfo", "-json", "i16.tif"], capture_output=True, text=True).stdout)
    check("GDAL knows missing samples and the projection", facts["bands"][0]["noDataValue"] == -32768 and
          "Polar_Stereographic" in facts["coordinateSystem"]["wkt"].replace(" ", "_"), facts["coordinateSystem"])
    check("GDAL knows the transform", facts["geoTransform"] == [-50000, 100, 0, 30000, 0, -100], facts["geoTransform"])



def mounted():
    """The levels as files, where a file system in user space can be mounted."""
    if not os.access("/dev/fuse", os.R_OK | os.W_OK):
        return print("skipped: texture mount: /dev/fuse cannot be opened")
    point = folder / "mounted"
    point.mkdir()
    process = subprocess.Popen([obscura, "texture", "mount", "f32.obt", point], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    first = process.stdout.readline()
    if "mounted" not in first:
        _, why = process.communicate(timeout=120)
        check("texture mount: one line", process.returncode == 69 and "obscura texture mount" in why or "cannot be mounted" in why, why)
        return print(f"skipped: texture mount: {why.strip()}")
    try:
        files = sorted(p.name for p in point.iterdir())
        texture = Texture(folder / "f32.obt")
        check("mount: two files a level", files == sorted(f"level{k}.{e}" for k in range(texture.levels) for e in ("f32", "vrt")), files)
        for level in range(texture.levels):
            columns, rows = texture.level_size(level)
            values = np.fromfile(point / f"level{level}.f32", "<f4").reshape(2, rows, columns)
            for plane in range(2):
                check(f"mount: level {level}, plane {plane}", np.array_equal(values[plane], texture.level(plane, level)[0].astype("f4")))
        with open(point / "level0.f32", "rb") as file:  # from the middle of a number to the middle of another row
            file.seek(4 * 1000 * 17 + 2398)
            check("mount: any bytes", file.read(9001) == expected["f32", 0].astype("<f4").tobytes()[4 * 1000 * 17 + 2398:][:9001])
            file.seek(0, 2)
            check("mount: nothing beyond the end", file.read(10) == b"")
        for what, act in (("written", lambda: open(point / "level0.f32", "r+b")), ("made", lambda: open(point / "new", "wb"))):
            try:
                act()
                check(f"mount: nothing is {what}", False)
            except OSError:
                pass
        if shutil.which("gdallocationinfo"):
            place = subprocess.run(["gdallocationinfo", "-valonly", "-geoloc", point / "level1.vrt", "-10100", "-20100"], capture_output=True,
                                   text=True, timeout=60).stdout.split()
            check("mount: GDAL finds places on the map", [float(v) for v in place] == [texture.level(p, 1)[0][250, 199] for p in (0, 1)], place)
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=120)
    check("mount: ends with Ctrl-C, unmounted", process.returncode == 0 and not list(point.iterdir()), process.returncode)


mounted()
refused(["mount", "text.obt", "."], 66, "it does not begin with OBSTEX")

os.chdir("/")
shutil.rmtree(folder)
verbs.end()
