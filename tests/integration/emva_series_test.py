#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura characterise --series beside an evaluation with numpy of the same images, after EMVA 1288 release 4.

The series are made here: one after the published description of the simulated reference set 003 (HCI Heidelberg), others with
what recorded sets have (stacks at a light of their own, dark pairs at some exposure times only, left-aligned bits, 8 bits with
little gain). The real reference set 001 is read where OBSCURA_DATA (default ../shared/data) holds it, and compared with the
results that the set's publishers give.

Usage: emva_series_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed, 77 without numpy.
"""
import json
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

try:
    import numpy
except ImportError:
    print("skipped: Python's numpy is not installed (Debian package python3-numpy)")
    sys.exit(77)

obscura, source = sys.argv[1], pathlib.Path(sys.argv[2])
failures = []
folder = tempfile.TemporaryDirectory(prefix="obscura-emva-")
root = pathlib.Path(folder.name)
random = numpy.random.default_rng(1288)


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def check_near(what, value, expected, relative):
    check(f"{what} within {100 * relative:g} %", abs(value - expected) <= relative * abs(expected),
          f"{value:g}, expected {expected:g}")


def write_png(file, image, depth=16):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = image.astype(">u2" if depth == 16 else "u1")
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", *image.shape[::-1], depth, 0, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(raw, 1)) + chunk(b"IEND", b""))


def write_tiff(file, image):
    """A grey TIFF of 16 bits, little-endian, in one strip."""
    height, width = image.shape
    tags = [(256, 3, width), (257, 3, height), (258, 3, 16), (259, 3, 1), (262, 3, 1), (273, 4, 8), (277, 3, 1), (278, 3, height),
            (279, 4, 2 * width * height)]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(struct.pack("<2sHI", b"II", 42, 8 + 2 * width * height) + image.astype("<u2").tobytes() +
                     struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags) +
                     struct.pack("<I", 0))


def read_png(file):
    """A grey PNG of 16 bits, from the format's specification."""
    data, at, idat, width, height = file.read_bytes(), 8, b"", 0, 0
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        at += size + 12
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", body)
            assert (depth, colour, interlace) == (16, 0, 0)
        elif kind == b"IDAT":
            idat += body
    raw = numpy.frombuffer(zlib.decompress(idat), "u1").reshape(height, 2 * width + 1)
    rows, above = numpy.zeros((height, 2 * width), "u1"), numpy.zeros(2 * width, "u1")
    for y in range(height):
        kind, row = raw[y, 0], raw[y, 1:]
        if kind == 1:
            row = numpy.cumsum(row.reshape(-1, 2), axis=0, dtype="u1").ravel()
        elif kind == 2:
            row = row + above
        elif kind:
            row = row.astype(int)
            for i in range(2 * width):
                a, b, c = (row[i - 2], int(above[i]), int(above[i - 2])) if i > 1 else (0, int(above[i]), 0)
                p = a + b - c
                paeth = min((a, b, c), key=lambda v: abs(p - v))
                row[i] = (row[i] + ((a + b) // 2 if kind == 3 else paeth)) & 255
            row = row.astype("u1")
        rows[y] = above = row
    return rows.view(">u2").astype(numpy.int64)


class Camera:
    """A linear camera; patterns are given in DN (dark) and as a relative response."""

    def __init__(self, shape=(120, 160), bits=12, gain=0.1, eta=0.5, offset=29.4, noise_e=30.0, dark_e_per_s=0.0,
                 pattern_dn=0.0, response=1.0, nonlinearity=0.0):
        self.shape, self.bits, self.gain, self.eta, self.offset, self.noise_e = shape, bits, gain, eta, offset, noise_e
        self.dark_e_per_s, self.pattern_dn, self.response, self.nonlinearity = dark_e_per_s, pattern_dn, response, nonlinearity

    def shoot(self, photons, exposure_ns):
        mean = self.eta * photons * self.response + self.dark_e_per_s * 1e-9 * exposure_ns
        electrons = random.poisson(numpy.broadcast_to(mean, self.shape)) + random.normal(0, self.noise_e, self.shape)
        top = 2 ** self.bits - 1
        dn = self.gain * electrons
        dn = dn * (1 - self.nonlinearity * numpy.clip(dn / top, 0, 1) ** 3) + self.offset + self.pattern_dn
        return numpy.clip(numpy.rint(dn), 0, top).astype(numpy.int64)


class Series:
    """Measurements (exposure, photons or None in the dark, images) and the folder that they are written to."""

    def __init__(self, name, camera):
        self.path, self.camera, self.measurements = root / name, camera, []

    def add(self, exposure_ns, photons, count=2):
        images = [self.camera.shoot(photons or 0, exposure_ns) for _ in range(count)]
        self.measurements.append((exposure_ns, photons, images))

    def write(self, descriptor="EMVA1288_Data.txt", shift=0, depth=16, end="\n", kind="png", extra=()):
        shape = self.camera.shape
        lines = ["# made by a test: Jähne", "v 4.0", *extra, f"n {self.camera.bits} {shape[1]} {shape[0]}"]
        for i, (exposure, photons, images) in enumerate(self.measurements):
            lines.append(f"d {exposure}" if photons is None else f"b {exposure} {photons}")
            for j, image in enumerate(images):
                file = self.path / f"images/m{i:03}_{j:03}.{kind}"
                if kind == "tif":
                    write_tiff(file, image << shift)
                else:
                    write_png(file, image << shift, depth)
                lines.append(f"i images\\{file.name}")
        (self.path / descriptor).write_text(end.join(lines) + end, encoding="latin-1")
        return self.path / descriptor if descriptor != "EMVA1288_Data.txt" else self.path


def characterise(where, *options, status=0):
    run = subprocess.run([obscura, "characterise", "--series", str(where), *options], capture_output=True, text=True, check=False)
    if run.returncode != status:
        check(f"characterise {where} ends with {status}", False, f"{run.returncode}: {run.stderr}{run.stdout}")
    return run


def report(where):
    return json.loads(characterise(where, "--json").stdout or "{}")


def pair(images):
    a, b = images
    difference = a - b
    return (a.mean() + b.mean()) / 2, difference.var() / 2


def spatial(images):
    stack = numpy.array(images)
    return stack.mean(), stack.mean(axis=0).var(ddof=1) - stack.var(axis=0, ddof=1).mean() / len(images)


def parts(images):
    """Variances from row to row, column to column and pixel to pixel: least squares over the three equations of the standard."""
    stack = numpy.array(images)
    mean, (rows, columns) = stack.mean(axis=0), stack.shape[1:]
    of = [mean.mean(axis=1).var(ddof=1), mean.mean(axis=0).var(ddof=1), mean.var(ddof=1)]
    row, column, pixel = numpy.linalg.solve([[1, 0, 1 / columns], [0, 1, 1 / rows], [1, 1, 1]], of)
    return numpy.array([row, column, pixel - stack.var(axis=0, ddof=1).mean() / len(images)])


def evaluate(measurements):
    """EMVA 1288 release 4 with numpy: pairs for the photon transfer, stacks for the patterns."""
    darks = sorted((t, *pair(images)) for t, photons, images in measurements if photons is None and len(images) == 2)
    times, means, variances = (numpy.array(v) for v in zip(*darks))
    bright = sorted(((photons, t, *pair(images)) for t, photons, images in measurements
                     if photons is not None and len(images) == 2 and times[0] <= t <= times[-1]), key=lambda b: b[0])
    photons, exposures, mean, variance = (numpy.array(v) for v in zip(*bright))
    y = mean - numpy.interp(exposures, times, means)
    s2 = variance - numpy.interp(exposures, times, variances)
    top = numpy.argmax(s2)
    fit = (y <= 0.7 * y[top]) & (photons <= photons[top])
    gain = numpy.linalg.lstsq(y[fit, None], s2[fit], rcond=None)[0][0]
    responsivity = numpy.linalg.lstsq(photons[fit, None], y[fit], rcond=None)[0][0]
    dark2 = numpy.polyfit(times, variances, 1)[1] if len(times) > 2 else variances[0]
    limited = dark2 < 0.24
    dark = 0.49 if limited else dark2 ** 0.5
    eta = responsivity / gain
    part = (y > 0.05 * y[top]) & (y < 0.95 * y[top]) & (photons <= photons[top])
    line = numpy.polyval(numpy.polyfit(photons[part], y[part], 1, w=1 / y[part]), photons[part])
    threshold = (dark / gain + 0.5) / eta
    result = {
        "quantum_efficiency": eta, "responsivity": responsivity, "gain": gain, "dark_noise_dn": dark,
        "dark_noise": (dark ** 2 - 1 / 12) ** 0.5 / gain, "snr_max": 20 * numpy.log10((eta * photons[top]) ** 0.5),
        "threshold": threshold, "saturation_photons": photons[top], "saturation": eta * photons[top],
        "dynamic_range": 20 * numpy.log10(photons[top] / threshold),
        "linearity_error": 100 * numpy.abs(y[part] / line - 1).mean()}
    if len(times) > 2:
        result["dark_current"] = 1e9 * numpy.polyfit(times, means, 1)[0] / gain
    stacks = [(p, images) for _, p, images in measurements if len(images) > 2]
    if stacks:
        level, dark_pattern = spatial(next(images for p, images in stacks if p is None))
        images = min(((p, i) for p, i in stacks if p is not None), key=lambda s: abs(s[0] - photons[top] / 2))[1]
        bright_level, bright_pattern = spatial(images)
        result["dsnu"] = dark_pattern ** 0.5 / gain
        result["prnu"] = 100 * (bright_pattern - dark_pattern) ** 0.5 / (bright_level - level)
        dark_parts = parts(next(images for p, images in stacks if p is None))
        names = ("row", "column", "pixel")
        for name, value in zip(names, numpy.maximum(0, dark_parts) ** 0.5 / gain):
            result[f"dsnu_{name}"] = value
        for name, value in zip(names, numpy.maximum(0, parts(images) - dark_parts) ** 0.5):
            result[f"prnu_{name}"] = 100 * value / (bright_level - level)
    return result


def profiles(deviations):
    """Mean, least, largest and middle line of a pattern along rows and columns."""
    return {name: {"mean": p.mean(axis=0), "min": p.min(axis=0), "max": p.max(axis=0), "middle": p[p.shape[0] // 2]}
            for name, p in (("horizontal", deviations), ("vertical", deviations.T))}


def curves(measurements, result):
    """Signal-to-noise ratio of each level, and profiles of DSNU and PRNU where there are stacks."""
    darks = sorted((t, pair(images)[0]) for t, photons, images in measurements if photons is None and len(images) == 2)
    times, means = zip(*darks)
    levels = sorted(((photons, t, images) for t, photons, images in measurements
                     if photons is not None and len(images) == 2 and times[0] <= t <= times[-1]), key=lambda b: b[0])
    snr = {name: [] for name in ("photons", "measured", "total", "model", "total_model")}
    for photons, t, images in levels:
        mean, variance = pair(images)
        signal = mean - numpy.interp(t, times, means)
        pattern = ((images[0] + images[1]) / 2).var(ddof=1) - variance / 2
        electrons = result["quantum_efficiency"] * photons
        noise2 = result["dark_noise"] ** 2 + 1 / 12 / result["gain"] ** 2 + electrons
        more2 = result.get("dsnu", 0) ** 2 + (result.get("prnu", 0) / 100 * electrons) ** 2
        with numpy.errstate(divide="ignore"):
            values = (photons, signal / variance ** 0.5, signal / (variance + max(0, pattern)) ** 0.5,
                      electrons / noise2 ** 0.5, electrons / (noise2 + more2) ** 0.5)
        for name, value in zip(snr, values):
            snr[name].append(value)
    stacks = [(p, numpy.array(images).mean(axis=0)) for _, p, images in measurements if len(images) > 2]
    if not stacks:
        return snr, {}
    dark = next(image for p, image in stacks if p is None)
    bright = min(((p, i) for p, i in stacks if p is not None), key=lambda s: abs(s[0] - result["saturation_photons"] / 2))[1]
    response = bright.mean() - dark.mean()
    return snr, {"dsnu": profiles((dark - dark.mean()) / result["gain"]), "prnu": profiles(100 * ((bright - dark) / response - 1))}


def near_all(got, expected, absolute):
    return len(got) == len(expected) and all(
        (a is None and not numpy.isfinite(b)) or (a is not None and abs(a - b) <= absolute + 1e-9 * abs(b))
        for a, b in zip(got, expected))


def check_report(name, got, expected, relative=1e-9, measurements=None):
    for quantity, value in expected.items():
        check_near(f"{name}: {quantity} is that of numpy", measured(got, quantity), value, relative)
    if measurements is None:
        return
    # Where there are no stacks the patterns come from pairs: they are what the report says.
    patterns = {key: measured(got, key) for key in ("dsnu", "prnu") if key in got["parameters"]}
    snr, lines = curves(measurements, {**patterns, **expected})
    for quantity, values in snr.items():
        check(f"{name}: SNR curve {quantity!r} is that of numpy", near_all(got["snr"][quantity], values, 1e-9),
              (got["snr"][quantity], values))
    check(f"{name}: there are profiles of both patterns", got["profiles"].keys() == {"dsnu", "prnu"}, got["profiles"].keys())
    for pattern, unit in (("dsnu", "e-"), ("prnu", "%")):
        check(f"{name}: unit of the profiles of {pattern}", got["profiles"][pattern]["unit"] == unit)
        for along in lines.get(pattern, {}):
            for line, values in lines[pattern][along].items():
                check(f"{name}: {along} {line} profile of {pattern} is that of numpy",
                      near_all(got["profiles"][pattern][along][line], values, 1e-9 * numpy.abs(values).max()))


def measured(got, quantity):
    return got.get("parameters", {}).get(quantity, {}).get("measured", float("nan"))


def noted(got, words):
    return any(words in note for note in got.get("notes", []))


# Reference set 003: one exposure time, one dark pair, stacks at the light of a level.
y, x = numpy.mgrid[0:120, 0:160]
radius2 = ((x - 80) / 80) ** 2 + ((y - 60) / 60) ** 2
pattern = random.normal(0, 1.5, x.shape) + 1.5 * numpy.sin(2 * numpy.pi * 0.04 * x) + 1.5 * numpy.sin(2 * numpy.pi * 0.2 * y)
simulated = Series("set 003", Camera(pattern_dn=pattern, nonlinearity=0.02,
                                     response=(1 + random.normal(0, 0.005, x.shape)) * (1 - 0.015 * radius2)))
for i in range(1, 51):
    simulated.add(1000000, round(1659.66 * i, 1))
simulated.add(1000000, round(1659.66 * 24, 1), 20)
simulated.add(1000000, None)
simulated.add(1000000, None, 20)
got = report(simulated.write())
expected = evaluate(simulated.measurements)
check_report("set 003", got, expected, measurements=simulated.measurements)
check("set 003: the stacks give DSNU1288 and PRNU1288", {"dsnu", "prnu"} <= expected.keys() and noted(got, "stack of 20"))
check_near("set 003: K of the description", expected["gain"], 0.1, 0.03)
check_near("set 003: quantum efficiency of the description", expected["quantum_efficiency"], 0.5, 0.03)
check_near("set 003: dark noise of the description", expected["dark_noise"], 30, 0.03)
check_near("set 003: DSNU of the description", expected["dsnu"], (1.5 ** 2 + 1.5 ** 2) ** 0.5 / 0.1, 0.03)
for part, expected_dn in (("row", 1.5 / 2 ** 0.5), ("column", 1.5 / 2 ** 0.5), ("pixel", 1.5)):
    check_near(f"set 003: DSNU of the description, {part}", measured(got, f"dsnu_{part}"), expected_dn / 0.1, 0.05)
check("set 003: one dark exposure time gives no dark current", "dark_current" not in got["parameters"])

# Order of the data sheet, in all forms of the report.
ORDER = ["quantum_efficiency", "responsivity", "gain", "dark_noise_dn", "dark_noise", "snr_max", "threshold", "saturation_photons",
         "saturation", "dynamic_range", "dsnu", "dsnu_row", "dsnu_column", "dsnu_pixel", "prnu", "prnu_row", "prnu_column",
         "prnu_pixel", "linearity_error"]
page = root / "report.html"
text = characterise(simulated.path, "-o", str(page)).stdout
check("the JSON report is in the order of the data sheet", list(got["parameters"]) == ORDER, list(got["parameters"]))
check("the text report is in that order", [line.split()[1] for line in text.splitlines()[1:20]] == ORDER, text)
places = [page.read_text().find(f"<td>{got['parameters'][name]['label']}</td>") for name in ORDER]
check("the page is in that order", min(places) > 0 and places == sorted(places), places)
shown = page.read_text()
check("the page states the test conditions", "Test conditions" in shown and "160 x 120 pixels" in shown)
check("the page has the plots of the standard",
      all(f">{title}<" in shown for title in
          ("Sensitivity", "Photon transfer", "Signal-to-noise ratio", "Deviation from linearity",
           "Horizontal profile DSNU", "Vertical profile DSNU", "Horizontal profile PRNU", "Vertical profile PRNU",
           "Horizontal spectrogram DSNU", "Vertical spectrogram PRNU", "DSNU histogram", "PRNU accumulated histogram")))
check("the page shows the total signal-to-noise ratio", ">total<" in shown and ">total, model<" in shown)
# The response falls towards the edges by 1.5 % at half the height, and a wave of 5 rows crosses the dark pattern.
along = got["profiles"]["prnu"]["vertical"]["mean"]
check("set 003: the vertical profile falls towards the edges", along[60] - (along[0] + along[-1]) / 2 > 0.9, along)
wave = numpy.array(got["profiles"]["dsnu"]["vertical"]["mean"])
expected_wave = 15 * numpy.sin(2 * numpy.pi * 0.2 * numpy.arange(120))
check_near("set 003: the vertical profile shows the wave", wave @ expected_wave / (expected_wave @ expected_wave), 1, 0.1)
check_near("set 003: the total SNR near saturation is below the temporal one as PRNU and DSNU have it",
           got["snr"]["total"][40] / got["snr"]["measured"][40], got["snr"]["total_model"][40] / got["snr"]["model"][40], 0.05)
check("symbols of the standard", got["parameters"].get("dsnu", {}).get("symbol") == "DSNU1288")

# A recorded set: exposure time varies, dark pairs at every third one and at longer ones, the stack under another light, bits
# left-aligned, CRLF, decimal commas, a descriptor with a name of its own.
recorded = Series("recorded", Camera(gain=0.28, eta=0.45, noise_e=10, dark_e_per_s=3000, offset=15,
                                     pattern_dn=random.normal(0, 0.6, x.shape), response=1 + random.normal(0, 0.008, x.shape)))
for i in range(1, 31):
    recorded.add(500000.5 * i, 1200.0 * i)
    if i % 3 == 1 or i == 30:
        recorded.add(500000.5 * i, None)
for t in (20e6, 30e6):
    recorded.add(t, None)
recorded.add(5160000.0, 19000.0, 12)
recorded.add(5160000.0, None, 12)
where = recorded.write("descriptor of my camera.txt", shift=4, end="\r\n", extra=["l InterfaceType Gigabit Ethernet"])
text = where.read_text(encoding="latin-1")
where.write_text("\r\n".join(line.replace(".", ",") if line[:1] in "bd" else line for line in text.split("\r\n")), encoding="latin-1",
                 newline="")
got = report(where)
expected = evaluate(recorded.measurements)
check_report("recorded set", got, expected, measurements=recorded.measurements)
check_near("recorded set: K of the camera", expected["gain"], 0.28, 0.03)
check_near("recorded set: DSNU of the camera", expected["dsnu"], 0.6 / 0.28, 0.05)
check_near("recorded set: PRNU of the camera", expected["prnu"], 0.8, 0.05)
check_near("recorded set: dark current of the camera", expected["dark_current"], 3000, 0.05)
check("recorded set: what was done is said", noted(got, "left-aligned") and noted(got, "interpolated"), got.get("notes"))

# Irradiance and exposure time both vary, so that levels have equal numbers of photons; no stacks; TIFF.
mixed = Series("mixed", Camera(pattern_dn=random.normal(0, 2.5, x.shape), response=1 + random.normal(0, 0.01, x.shape)))
for t in (1e6, 2e6, 3e6):
    mixed.add(t, None)
    for i in range(1, 25):
        mixed.add(t, 4000.0 * i)
got = report(mixed.write(kind="tif"))
expected = evaluate(mixed.measurements)
check_report("mixed set", got, expected, measurements=mixed.measurements)
check_near("mixed set: K of the camera", expected["gain"], 0.1, 0.03)
check_near("mixed set: DSNU from the dark pairs", measured(got, "dsnu"), 25, 0.05)
check_near("mixed set: PRNU from a bright pair", measured(got, "prnu"), 1.0, 0.05)
check("mixed set: says that the standard wants stacks", noted(got, "stacks of images"), got.get("notes"))

# 8 bits of little gain: quantisation hides the dark noise.
coarse = Series("coarse", Camera(bits=8, gain=0.02, eta=0.6, noise_e=8, offset=3.3, response=1 + random.normal(0, 0.01, x.shape)))
for i in range(1, 41):
    coarse.add(1e6, 600.0 * i)
coarse.add(1e6, None)
got = report(coarse.write(depth=8))
expected = evaluate(coarse.measurements)
check_report("8-bit set", got, expected, measurements=coarse.measurements)
noise = got["parameters"].get("dark_noise", {})
check_near("8-bit set: upper limit of the dark noise is 0.40 / K", measured(got, "dark_noise"), 0.40 / expected["gain"], 0.011)
check("8-bit set: marked as an upper limit, with a note", noise.get("upper_limit") and noted(got, "0.24"), got)
check("8-bit set: the limit is seen in the text", "<" in characterise(coarse.path).stdout)

# What is unusable ends with one line that names file and cause.
small = Series("small", Camera(shape=(8, 8)))
for i in range(1, 6):
    small.add(1e6, 5000.0 * i)
small.add(1e6, None)
small.write()
good = (small.path / "EMVA1288_Data.txt").read_text(encoding="latin-1")


def check_refused(what, text, *words):
    (small.path / "EMVA1288_Data.txt").write_text(text, encoding="latin-1")
    run = characterise(small.path, status=66)
    check(f"refused in one line: {what}", run.stderr.count("\n") == 1 and all(word in run.stderr for word in words), run.stderr)


check_refused("no size", good.replace("n 12", "# 12"), "EMVA1288_Data.txt", "BITS WIDTH HEIGHT")
check_refused("two sizes", good + "n 8 8 8\n", "second")
check_refused("17 bits", good.replace("n 12", "n 17"), "1 to 16 bits")
check_refused("unknown line", good + "q 1\n", "\"q\"")
check_refused("no photons", good.replace("b 1000000.0 5000.0", "b 1000000.0 many"), ":4:", "PHOTONS")
check_refused("an image alone", good + "d 5\ni images/m000_000.png\n", "1 image")
check_refused("the same pair twice", good + "\n".join(good.splitlines()[3:6]) + "\n", "second pair")
check_refused("no dark pair", good.split("d 1000000.0")[0], "no dark pair")
check_refused("too few levels", good.split("b 1000000.0 20000.0")[0] + "d" + good.split("\nd")[1], "at least 4 levels")
check_refused("images of another size", good.replace("8 8\n", "8 9\n"), ".png", "8 x 8", "8 x 9")
check_refused("values beyond the bits", good.replace("n 12", "n 5"), ".png", "5 bits")
check_refused("no images at all", good.replace("images\\", "nowhere\\"), "bright pair whose images are there")
(small.path / "images/broken.png").write_bytes((small.path / "images/m000_000.png").read_bytes()[:60])
check_refused("a broken image", good.replace("m000_000", "broken"), "broken.png")
dark = "".join(f"{line}\n" for line in good.splitlines() if line[:1] in "vnd" or "m005" in line)
levels = "".join(f"b 1000000.0 {1000 * i}.0\ni images/m005_000.png\ni images/m005_001.png\n" for i in range(1, 6))
check_refused("light that changes nothing", dark + levels, "K cannot be determined")

# The real set of a CCD camera. Results of its publishers, for the whole set (documentation of the emva1288 package):
PUBLISHED = {"gain": 0.280769280926, "responsivity": 0.126726922819, "quantum_efficiency": 0.451356082834, "dark_noise": 10.8980275235,
             "saturation_photons": 30957.0, "saturation": 13972.6302563, "prnu": 0.432704411062}
real = pathlib.Path(os.environ.get("OBSCURA_DATA", source.parent / "shared/data")) / "emva1288/EMVA1288_ReferenceSet_001_CCD_12Bit"
if real.exists():
    measurements = []
    for line in (real / "EMVA1288_Data.txt").read_text().splitlines():
        words = line.split()
        if line[:1] in "bd":
            measurements.append((float(words[1]), float(words[2]) if line[0] == "b" else None, []))
        elif line[:1] == "i":
            measurements[-1][2].append(real / words[1].replace("\\", "/"))
    measurements = [(t, p, [read_png(f) for f in files]) for t, p, files in measurements if all(f.exists() for f in files)]
    got = report(real)
    check_report("set 001", got, evaluate(measurements), measurements=measurements)
    for quantity, value in PUBLISHED.items():
        check_near(f"set 001: {quantity} as published", measured(got, quantity), value, 0.03)
    check("set 001: DSNU1288 is given", "dsnu" in got["parameters"], got)
else:
    print(f"SKIPPED: {real} is not there")

print(f"{len(failures)} checks failed")
sys.exit(1 if failures else 0)
