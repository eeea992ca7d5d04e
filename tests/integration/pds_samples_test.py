#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Samples of PDS3 and PDS4 labels by `obscura import map` and by the image reader of scenes, beside numpy and GDAL: types, byte orders, order of
bands, prefixes and suffixes of lines, scale, constants of missing samples.
Usage: pds_samples_test.py OBSCURA OBT_DUMP IMAGE_DUMP. Skipped (77) without obscura-gdal or numpy; without gdal-bin only numpy is asked."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

obscura, obt_dump, image_dump = sys.argv[1:4]
if not (pathlib.Path(obscura).parent / "obscura-gdal").exists():
    sys.exit(print("skipped: obscura-gdal is not built, libgdal-dev is missing") or 77)
try:
    import numpy as np
except ImportError:
    sys.exit(print("skipped: python3-numpy is not installed") or 77)
gdal = shutil.which("gdal_translate")
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-pds-"))
failures = []
compared = {"import": 0, "scenes": 0, "GDAL": 0}
H, W = 6, 12


def check(what, truth, detail=""):
    if not truth:
        failures.append(what)
        print(f"FAILED: {what} {detail}")


def run(*words, status=0):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    check(f"{words}: status {done.returncode}, wanted {status}", done.returncode == status, done.stderr[-500:])
    return done


def label(name, data, kind, bits, bands=1, storage=None, prefix=0, suffix=0, image=None):
    """A label of a whole globe beside its data."""
    row = len(data) // (H * (1 if storage == "SAMPLE_INTERLEAVED" else bands))
    keys = {"LINES": H, "LINE_SAMPLES": W, "SAMPLE_TYPE": kind, "SAMPLE_BITS": bits, "UNIT": "METER"}
    if bands > 1:
        keys["BANDS"] = bands
    if storage:
        keys["BAND_STORAGE_TYPE"] = storage
    if prefix:
        keys["LINE_PREFIX_BYTES"] = prefix
    if suffix:
        keys["LINE_SUFFIX_BYTES"] = suffix
    keys.update(image or {})
    place = {"MAP_PROJECTION_TYPE": '"SIMPLE CYLINDRICAL"', "MAP_RESOLUTION": f"{W / 360:.15g} <pix/deg>", "A_AXIS_RADIUS": "1737.4 <km>",
             "POSITIVE_LONGITUDE_DIRECTION": "EAST", "CENTER_LATITUDE": 0, "CENTER_LONGITUDE": 180, "MAXIMUM_LATITUDE": 90, "MINIMUM_LATITUDE": -90,
             "WESTERNMOST_LONGITUDE": 0, "EASTERNMOST_LONGITUDE": 360, "LINE_PROJECTION_OFFSET": H / 2 - 0.5, "SAMPLE_PROJECTION_OFFSET": W / 2 - 0.5}
    text = f'PDS_VERSION_ID = PDS3\r\nRECORD_TYPE = FIXED_LENGTH\r\nRECORD_BYTES = {row}\r\nFILE_RECORDS = {len(data) // row}\r\n^IMAGE = "{name}.IMG"\r\nOBJECT = IMAGE\r\n'
    text += "".join(f" {k} = {v}\r\n" for k, v in keys.items()) + "END_OBJECT = IMAGE\r\nOBJECT = IMAGE_MAP_PROJECTION\r\n"
    text += "".join(f" {k} = {v}\r\n" for k, v in place.items()) + "END_OBJECT = IMAGE_MAP_PROJECTION\r\nEND\r\n"
    (folder / f"{name}.LBL").write_text(text)
    (folder / f"{name}.IMG").write_bytes(data)
    return folder / f"{name}.LBL"


def laid_out(samples, storage, prefix, suffix):
    """Bytes of samples[band, line, column]; prefixes and suffixes of lines are 0xA5."""
    lines = {"SAMPLE_INTERLEAVED": samples.transpose(1, 2, 0), "LINE_INTERLEAVED": samples.transpose(1, 0, 2).reshape(-1, W)}.get(storage, samples.reshape(-1, W))
    return b"".join(b"\xa5" * prefix + np.ascontiguousarray(line).tobytes() + b"\xa5" * suffix for line in lines)


def by_import(file, *words, band=None):
    out = folder / "out.obt"
    out.unlink(missing_ok=True)
    done = run(obscura, "import", "map", file, "-o", out, "--json", "--values", "height", "--unit", "m", *([] if band is None else ["--band", band + 1]), *words)
    if done.returncode:
        return None
    about = json.loads(run(obt_dump, out, folder / "samples.f32").stdout)
    return np.fromfile(folder / "samples.f32", "<f4").reshape(about["height"], about["width"]).astype("f8")


def by_scenes(file, bands=1):
    run(image_dump, bands, file)
    return np.stack([np.fromfile(f"{file}.{b}.f64", "<f8").reshape(H, W) for b in range(bands)])


def by_gdal(file, bands):
    run(gdal, "-q", "-of", "ENVI", "-co", "INTERLEAVE=BSQ", "-ot", "Float64", file, folder / "gdal.bin")
    return np.fromfile(folder / "gdal.bin", "<f8").reshape(bands, H, W)


def same(what, found, truth, which):
    if found is None:
        return
    compared[which] += 1
    holes = np.isnan(truth)
    close = np.where(holes, np.isnan(found), np.abs(np.where(holes, 0, found) - np.where(holes, 0, truth)) <= 1e-6 * np.nanmax(np.abs(truth)))
    check(f"{what}: {which}", found.shape == truth.shape and close.all(), f"\n{found.ravel()[:8]}\n{truth.ravel()[:8]}")


def vax(values, bits, exponent_bits):
    """VAX F, D (8 bits of exponent) or G (11): words of 16 bits, the most significant first, each with its low byte first."""
    fraction, exponent = np.frexp(np.abs(values))
    fraction_bits = bits - 1 - exponent_bits
    words = []
    for value, f, e in zip(values.ravel(), fraction.ravel(), exponent.ravel()):
        number = 0 if value == 0 else int(value < 0) << bits - 1 | int(e) + (1 << exponent_bits - 1) << fraction_bits | int(f * 2.0 ** (fraction_bits + 1)) - (1 << fraction_bits)
        words += [number >> shift & 0xFFFF for shift in range(bits - 16, -1, -16)]
    return np.array(words, "<u2").view(f"V{bits // 8}").reshape(values.shape)


def samples_of(dtype, bands):
    """Numbers that show sign, byte order and place; reals with fractions that all types keep."""
    count = bands * H * W
    if dtype.kind == "f":
        return ((np.arange(count) * 37 % 1013 - 500) / 8).reshape(bands, H, W)
    info = np.iinfo(dtype)
    step = max(1, min(int(info.max) // (count + 1), 2 ** 14) // 3)
    first = -(count // 2) * step if info.min < 0 else 1
    return (first + np.arange(count) * step).reshape(bands, H, W).clip(int(info.min), int(info.max))


TYPES = [("MSB_INTEGER", ">i"), ("INTEGER", ">i"), ("SUN_INTEGER", ">i"), ("MAC_INTEGER", ">i"), ("LSB_INTEGER", "<i"), ("PC_INTEGER", "<i"), ("VAX_INTEGER", "<i"),
         ("MSB_UNSIGNED_INTEGER", ">u"), ("UNSIGNED_INTEGER", ">u"), ("SUN_UNSIGNED_INTEGER", ">u"), ("MAC_UNSIGNED_INTEGER", ">u"),
         ("LSB_UNSIGNED_INTEGER", "<u"), ("PC_UNSIGNED_INTEGER", "<u"), ("VAX_UNSIGNED_INTEGER", "<u"),
         ("IEEE_REAL", ">f"), ("REAL", ">f"), ("FLOAT", ">f"), ("SUN_REAL", ">f"), ("MAC_REAL", ">f"), ("PC_REAL", "<f"),
         ("VAX_REAL", "vax"), ("VAX_DOUBLE", "vax"), ("VAXG_REAL", "vaxg")]


def types_and_layouts():
    number = 0
    for kind, code in TYPES:
        for bits in {"i": (8, 16, 32, 64), "u": (8, 16, 32, 64)}.get(code[1:], (64,) if code == "vaxg" or kind == "VAX_DOUBLE" else (32, 64)):
            for storage, bands in ((None, 1), ("BAND_SEQUENTIAL", 3), ("LINE_INTERLEAVED", 3), ("SAMPLE_INTERLEAVED", 3)):
                number += 1
                prefix, suffix = ((0, 0), (8, 0), (0, 24), (16, 8))[(number + number // 4) % 4]
                dtype = np.dtype(f"f{bits // 8}") if code.startswith("vax") else np.dtype(f"{code}{bits // 8}")
                truth = samples_of(dtype, bands).astype(dtype).astype("f8")
                data = vax(truth, bits, 11 if code == "vaxg" else 8) if code.startswith("vax") else truth.astype(dtype)
                what = f"{kind} {bits}, {storage}, {prefix}+{suffix}"
                file = label(f"T{number}", laid_out(data, storage, prefix, suffix), kind, bits, bands, storage, prefix, suffix, {"SCALING_FACTOR": 0.5, "OFFSET": -3})
                same(what, by_scenes(file, bands), 0.5 * truth - 3, "scenes")
                band = number % bands
                if number % 4 == number // 4 % 4 or kind in ("LSB_INTEGER", "VAX_REAL"):  # each layout with many types
                    same(what, by_import(file, band=band), 0.5 * truth[band] - 3, "import")


def beside_gdal():
    """Where GDAL 3.6 follows the Standards Reference: not for integers of 32 bits, byte orders of some unsigned types, interleaved bands, prefixes."""
    for kind, code in TYPES:
        for bits in {"i": (16,), "u": (8, 16), "f": (32, 64)}.get(code[1:], ()):
            if bits == 16 and kind in ("UNSIGNED_INTEGER", "PC_UNSIGNED_INTEGER", "VAX_UNSIGNED_INTEGER"):
                continue
            for storage, bands in ((None, 1), ("BAND_SEQUENTIAL", 3)):
                dtype = np.dtype(f"{code}{bits // 8}")
                truth = samples_of(dtype, bands).astype(dtype)
                file = label(f"G{kind}{bits}{storage}", laid_out(truth, storage, 0, 0), kind, bits, bands, storage)
                found = by_scenes(file, bands)
                same(f"{kind} {bits}, {storage}", found, truth.astype("f8"), "scenes")
                same(f"{kind} {bits}, {storage}", by_gdal(file, bands), found, "GDAL")


KEYS = ["MISSING_CONSTANT", "MISSING", "NULL_CONSTANT", "NULL", "INVALID_CONSTANT", "INVALID", "UNKNOWN_CONSTANT", "NOT_APPLICABLE_CONSTANT", "CORE_NULL", "CORE_LOW_REPR_SATURATION",
        "CORE_LOW_INSTR_SATURATION", "CORE_HIGH_REPR_SATURATION", "CORE_HIGH_INSTR_SATURATION"]


def holes():
    number = 0
    for kind, code, special in (("LSB_INTEGER", "<i2", -32768), ("MSB_INTEGER", ">i2", -32767), ("LSB_INTEGER", "<i4", -2 ** 31), ("UNSIGNED_INTEGER", "u1", 255),
                                ("MSB_UNSIGNED_INTEGER", ">u2", 65535), ("INTEGER", "i1", -128), ("LSB_INTEGER", "<i8", -2 ** 63), ("PC_REAL", "<f4", -3.4028226550889045e38),
                                ("IEEE_REAL", ">f4", -1e9), ("IEEE_REAL", ">f8", -1e9 / 3)):
        dtype = np.dtype(code)
        bits = 8 * dtype.itemsize
        numbers = samples_of(dtype, 1).astype(dtype)
        numbers[0, 2, 3:6] = special
        numbers[0, 4, 0] = special
        pattern = int.from_bytes(numbers[0, 2, 3:4].astype(dtype.newbyteorder(">")).tobytes(), "big")
        truth = np.where(numbers == dtype.type(special), np.nan, numbers.astype("f8"))
        forms = [repr(special), f"16#{pattern:0{bits // 4}X}#", f'"16#{pattern:x}#"', f"2#{pattern:b}#", f"8#{pattern:o}#", f"({special!r}, {special!r})"]
        for i, form in enumerate(forms + [repr(special)] * (len(KEYS) - len(forms))):
            if kind == "LSB_INTEGER" and bits == 64 and i == 0:
                continue
            number += 1
            what = f"{KEYS[i]} = {form} of {kind} {bits}"
            file = label(f"H{number}", numbers.tobytes(), kind, bits, image={KEYS[i]: form})
            same(what, by_scenes(file), truth, "scenes")
            if i < len(forms) or bits == 16:
                same(what, by_import(file), truth[0], "import")
    # Several at once, one that no sample can be, and words in place of numbers.
    numbers = samples_of(np.dtype("<i2"), 1).astype("<i2")
    numbers[0, 1, 1:5] = -32768, -32767, -32766, 32767
    truth = np.where((numbers <= -32766) | (numbers == 32767), np.nan, numbers.astype("f8"))
    file = label("SEVERAL", numbers.tobytes(), "LSB_INTEGER", 16, image={"CORE_NULL": -32768, "CORE_LOW_REPR_SATURATION": "16#8001#", "CORE_LOW_INSTR_SATURATION": -32766,
                                                                        "CORE_HIGH_REPR_SATURATION": 32767, "MISSING_CONSTANT": '"N/A"', "INVALID_CONSTANT": '"UNK"',
                                                                        "UNKNOWN_CONSTANT": 99999})
    same("several constants", by_scenes(file), truth, "scenes")
    same("several constants", by_import(file), truth[0], "import")
    file = label("SELENE", numbers.tobytes(), "LSB_INTEGER", 16, image={"INVALID_VALUE": "(-32768, -32767,\r\n -32766)", "OUT_OF_IMAGE_BOUNDS_VALUE": 32767})
    same("lists of values", by_scenes(file), truth, "scenes")
    file = label("BOUND", numbers.tobytes(), "LSB_INTEGER", 16, image={"CORE_VALID_MINIMUM": -32765, "NULL": 32767})
    same("CORE_VALID_MINIMUM", by_scenes(file), truth, "scenes")
    same("CORE_VALID_MINIMUM", by_import(file), truth[0], "import")


def words():
    """Values of keywords as labels in archives have them."""
    numbers = samples_of(np.dtype("<i2"), 3).astype("<i2")
    file = label("WORDS", numbers.tobytes(), "lsb_integer", 16, 3, '"band sequential"', image={"SCALING_FACTOR": '"N/A"', "OFFSET": "2 <m>", "UNIT": '"UNK"'})
    same("words", by_scenes(file, 3), numbers.astype("f8") + 2, "scenes")
    same("words", by_import(file, band=2), numbers[2].astype("f8") + 2, "import")


def refusals():
    numbers = samples_of(np.dtype("<i2"), 1).astype("<i2").tobytes()
    for what, kind, bits, image in (("MISSING_CONSTANT is \"16#12345#\"", "LSB_INTEGER", 16, {"MISSING_CONSTANT": "16#12345#"}),
                                    ("CORE_NULL is \"some\"", "LSB_INTEGER", 16, {"CORE_NULL": "some"}),
                                    ("type PC_COMPLEX with 64 bits", "PC_COMPLEX", 64, {}), ("type CHARACTER with 8 bits", "CHARACTER", 8, {}),
                                    ("type LSB_INTEGER with 24 bits", "LSB_INTEGER", 24, {}), ("ENCODING_TYPE HUFFMAN", "LSB_INTEGER", 16, {"ENCODING_TYPE": "HUFFMAN"}),
                                    ("BAND_STORAGE_TYPE is OTHER", "LSB_INTEGER", 16, {"BANDS": 3, "BAND_STORAGE_TYPE": "OTHER"}),
                                    ("SCALING_FACTOR 0", "LSB_INTEGER", 16, {"SCALING_FACTOR": 0})):
        file = label("REFUSED", numbers, kind, bits, image=image)
        done = run(image_dump, 1, file, status=1)
        check(f"scenes refuse {what}", what in done.stderr and done.stderr.count("\n") == 1, done.stderr)
    for image in ({"CORE_NULL": "some"}, {"SCALING_FACTOR": 0}):
        done = run(obscura, "import", "map", label("REFUSED", numbers, "LSB_INTEGER", 16, image=image), "-o", folder / "refused.obt", status=66)
        check("import: one line", done.stderr.count("\n") == 1, done.stderr)


def pds4():
    """Labels of PDS4 by the import: each class of constants, in decimal and as a bit pattern."""
    place = """<Observation_Area><Discipline_Area><cart:Cartography xmlns:cart="http://pds.nasa.gov/pds4/cart/v1"><cart:Spatial_Domain><cart:Bounding_Coordinates>
<cart:west_bounding_coordinate unit="deg">0</cart:west_bounding_coordinate><cart:east_bounding_coordinate unit="deg">360</cart:east_bounding_coordinate>
<cart:north_bounding_coordinate unit="deg">90</cart:north_bounding_coordinate><cart:south_bounding_coordinate unit="deg">-90</cart:south_bounding_coordinate>
</cart:Bounding_Coordinates></cart:Spatial_Domain></cart:Cartography></Discipline_Area></Observation_Area>"""
    names = ["missing_constant", "invalid_constant", "unknown_constant", "not_applicable_constant", "error_constant", "saturated_constant", "high_instrument_saturation",
             "high_representation_saturation", "low_instrument_saturation", "low_representation_saturation"]
    for kind, code, special in (("SignedMSB2", ">i2", -32768), ("SignedLSB2", "<i2", -3), ("UnsignedByte", "u1", 255), ("SignedLSB4", "<i4", -2 ** 31), ("IEEE754MSBSingle", ">f4", -1e9)):
        dtype = np.dtype(code)
        numbers = samples_of(dtype, 1).astype(dtype)[0]
        numbers[2, 3:6] = special
        numbers[5, 0] = numbers[4, 4]
        truth = np.where((numbers == dtype.type(special)), np.nan, numbers.astype("f8"))
        pattern = int.from_bytes(numbers[2, 3:4].astype(dtype.newbyteorder(">")).tobytes(), "big")
        for name, form in [(n, f"0x{pattern:X}") for n in names[:2]] + [(n, repr(special)) for n in names] + [("missing_constant", f"16#{pattern:x}#")]:
            (folder / "P4.img").write_bytes(numbers.tobytes())
            file = folder / "P4.xml"
            axes = "".join(f"<Axis_Array><axis_name>{n}</axis_name><elements>{k}</elements><sequence_number>{i}</sequence_number></Axis_Array>" for i, (n, k) in enumerate((("Line", H), ("Sample", W)), 1))
            file.write_text(f'<?xml version="1.0"?><Product_Observational xmlns="http://pds.nasa.gov/pds4/pds/v1">{place}<File_Area_Observational><File><file_name>P4.img</file_name></File>'
                            f'<Array_2D_Image><offset unit="byte">0</offset><axes>2</axes><axis_index_order>Last Index Fastest</axis_index_order><Element_Array><data_type>{kind}</data_type></Element_Array>'
                            f"{axes}<Special_Constants><{name}>{form}</{name}></Special_Constants></Array_2D_Image></File_Area_Observational></Product_Observational>")
            same(f"PDS4 {name} = {form} of {kind}", by_import(file, "--edges=0,360,90,-90", "--radius", 1737400), truth, "import")


types_and_layouts()
pds4()
if gdal:
    beside_gdal()
holes()
words()
refusals()
print(", ".join(f"{count} images by {which}" for which, count in compared.items()))
shutil.rmtree(folder)
sys.exit(1 if failures else 0)
