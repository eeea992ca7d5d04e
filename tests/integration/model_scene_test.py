#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Pictures with materials in SuMoL against numpy and against what is built in: bands, time, texture coordinates,
textures and emission. Usage: model_scene_test.py OBSCURA"""
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cases"))
from case_files import read_fits  # noqa: E402
from checks import check, failures  # noqa: E402

obscura = sys.argv[1]
temporary = tempfile.TemporaryDirectory(prefix="obscura-model-scene-")
folder = pathlib.Path(temporary.name)

ARGUMENTS = ("vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess, scalar t, scalar duration, "
             "vec3 uv, scalar lod_bias")
EMISSION = ("vec3 $e, vec3 $n, vec4 emission, vec4 diffuse, vec4 specular, scalar shininess, scalar t, scalar duration, "
            "vec2 uv, scalar lod_bias")


def law(name, body, before="", emission=None):
    text = f"{before}\nvec4 brdf({ARGUMENTS})\n{{ {body} }}\n"
    if emission:
        text += f"vec4 emission({EMISSION})\n{{ {emission} }}\n"
    (folder / name).write_text(text)


def png(name, values):
    """An 8-bit image, of red, green and blue if there are three planes."""
    values = np.asarray(values).astype(np.uint8)
    height, width = values.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in values)
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    header = struct.pack(">IIBBBBB", width, height, 8, 2 if values.ndim == 3 else 0, 0, 0, 0)
    (folder / name).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
    return values


def scene(name, body, bands=1, extra=""):
    lines = ["[camera]", "width = 48", "height = 48", "pixel_pitch_um = 10", "focal_length_mm = 20", "aperture_mm = 10",
             "position_m = [100, 0, 10]", "look_at_m = [0, 0, 0]", "up = [0, 0, 1]",
             "[sun]", "direction = [1, 0.5, 0.4]"]
    for k in range(bands if bands > 1 else 0):
        lines += ["[[band]]", f"from_nm = {400 + 50 * k}", f"to_nm = {450 + 50 * k}"]
    lines += ["[[body]]", 'shape = "ellipsoid"', "radii_m = [1, 1, 1]", body, extra]
    (folder / name).write_text("\n".join(lines) + "\n")


def run(*arguments):
    return subprocess.run([obscura, *arguments], capture_output=True, text=True, cwd=folder)


def render(name, *options):
    done = run("render", name, "-o", "out.fits", *options)
    if done.returncode:
        return done.stderr
    planes = read_fits(folder / "out.fits")[1][""]
    return np.asarray(planes, dtype=float).reshape((-1, 48, 48))


def compare(what, given, expected, limit=1e-6):
    if isinstance(given, str) or isinstance(expected, str):
        check(what, False, given if isinstance(given, str) else expected)
        return
    seen = np.abs(expected) > 0
    worst = np.max(np.abs(given - expected)[seen] / np.abs(expected)[seen]) if seen.any() else np.inf
    check(what, worst < limit and np.all(given[~seen] == 0), f"{worst}")


law("lambert.brdf", "return diffuse * max(0, (i|n)) * M_1_PI;")
scene("built-in.toml", 'albedo = 1.0', 6)
white = render("built-in.toml")
check("the sphere is seen", np.count_nonzero(white[0]) > 300, np.count_nonzero(white[0]))

# Bands.
law("spectral.brdf", "return diffuse * c * max(0, (i|n)) * M_1_PI;", "parameter c vec4(1);")
for numbers, expected in (([0.5], [0.5] * 6), ([0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3, 0.4, 0.1, 0.2]),
                          ([0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])):
    scene("bands.toml", f'material = {{ model = "spectral.brdf", c = {numbers if len(numbers) > 1 else numbers[0]} }}', 6)
    compare(f"{len(numbers)} numbers of a vec4 in 6 bands", render("bands.toml"), white * np.reshape(expected, (6, 1, 1)), 3e-7)
scene("bands.toml", 'material = { model = "spectral.brdf", c = [0.1, 0.2, 0.3] }', 6)
said = render("bands.toml")
check("3 numbers in 6 bands are refused", isinstance(said, str) and "c: 3 numbers: allowed are 1, 4 or one for each of the 6 bands" in said, said)
# Channels that are mixed, and reflections between two bodies: the ratio of bands depends on directions.
law("phase.brdf", "vec4 k = vec4(0.5, 1, 1.5, 2); return 0.1 * max(0, (i|n)) * exp(-k * acos(clamp((i|e), -1, 1))) * (c.x + c.y);",
    "parameter c vec4(1, 2, 3, 4);")
scene("phase.toml", 'material = { model = "phase.brdf" }', 4)
given = render("phase.toml")
if not isinstance(given, str):
    light, camera = np.array([1, 0.5, 0.4]), np.array([100, 0, 10])
    phase = np.arccos(light @ camera / np.linalg.norm(light) / np.linalg.norm(camera))
    expected = [np.mean(given[k][given[0] > 0] / given[0][given[0] > 0]) for k in range(4)]
    sun = [np.mean(white[k][white[0] > 0] / white[0][white[0] > 0]) for k in range(4)]
    worst = max(abs(expected[k] / sun[k] / np.exp(-0.5 * k * phase) - 1) for k in range(4))
    # The phase angle differs by some 1 % over the sphere.
    check("a phase slope of its own in each band", worst < 0.01, worst)
bounces = ('material = { model = "spectral.brdf", c = [0.1, 0.5, 0.9, 0.3] }\n[[body]]\nshape = "ellipsoid"\nradii_m = [1, 1, 1]\n'
           'position_m = [0, 1.8, 0.3]\n')
scene("bounce.toml", bounces + 'material = { model = "spectral.brdf", c = [0.8, 0.4, 0.2, 0.6] }', 4)
scene("coloured.toml", bounces.replace('material = { model = "spectral.brdf", c = [0.1, 0.5, 0.9, 0.3] }', "albedo = 1.0\ncolour = [0.1, 0.5, 0.9, 0.3]")
      + "albedo = 1.0\ncolour = [0.8, 0.4, 0.2, 0.6]", 4)
first, second = render("bounce.toml", "--bounces", "4", "--samples", "256"), render("coloured.toml", "--bounces", "4", "--samples", "256")
if isinstance(first, str) or isinstance(second, str):
    check("reflections in bands", False, f"{first} {second}")
else:
    ratio = first.sum(axis=(1, 2)) / second.sum(axis=(1, 2))
    check("reflections in bands are those of built-in colours", np.max(np.abs(ratio - 1)) < 2e-3, ratio)
check("bytes do not depend on threads", len({(run("render", "bounce.toml", "-o", f"t{n}.fits", "--bounces", "2", "--threads", str(n)),
                                              (folder / f"t{n}.fits").read_bytes())[1] for n in (1, 2, 7)}) == 1)

# Time.
law("time.brdf", "return diffuse * (1 + 0.25 * t + 0.5 * duration) * max(0, (i|n)) * M_1_PI * 0.2;")
scene("time.toml", 'material = { model = "time.brdf" }', 6)
for options, factor in ((("--time", "0"), 1), (("--time", "2"), 1.5), (("--time", "2", "--exposure", "1"), 2)):
    compare(f"the time of the sample, {' '.join(options)}", render("time.toml", *options), 0.2 * factor * white, 3e-7)

# Texture coordinates and textures.
rng = np.random.default_rng(1)
grey = png("map.png", rng.integers(40, 255, (32, 64)))
image = png("planes.png", rng.integers(40, 255, (32, 64, 3)))
law("map.brdf", "return lookup3DLOD(map, uv, lod_bias) * max(0, (i|n)) * M_1_PI;", "parameter texture map;")
scene("map.toml", 'material = { model = "map.brdf", map = "map.png" }')
scene("albedo.toml", 'albedo = 1.0\nalbedo_texture = "map.png"')
mapped = render("albedo.toml")
compare("an image as a texture of a model", render("map.toml"), mapped)
law("same.brdf", "return lookup3DLOD(map, vec3(uv.x * 1 + 0 * t, uv.y, 0), lod_bias) * max(0, (i|n)) * M_1_PI;", "parameter texture map;")
scene("same.toml", 'material = { model = "same.brdf", map = "map.png" }')
compare("the same at a place that is computed", render("same.toml", "--time", "1"), mapped)
law("turned.brdf", "return lookup3DLOD(map, vec3(uv.x + 0.25, uv.y, 0), lod_bias) * max(0, (i|n)) * M_1_PI;", "parameter texture map;")
scene("turned.toml", 'material = { model = "turned.brdf", map = "map.png" }')
scene("shifted.toml", 'albedo = 1.0\nalbedo_texture = "map.png"\ntexture_left_deg = 90')
compare("a map that is shifted by a quarter", render("turned.toml"), render("shifted.toml"), 1e-5)
law("level.brdf", "return lookup3DLOD(map, uv, 20) * max(0, (i|n)) * M_1_PI;", "parameter texture map;")
scene("level.toml", 'material = { model = "level.brdf", map = "map.png", map_range = [0.1, 0.6] }')
mean = 0.1 + 0.5 * grey.mean() / 255
scene("plain.toml", "albedo = 1.0")
compare("a coarse level is the mean", render("level.toml"), mean * render("plain.toml"), 1e-4)
law("planes.brdf", "vec4 p = lookup3DLOD(map, uv, lod_bias); return vec4(p.x + 2 * p.y + 3 * p.z) * 0.1 * max(0, (i|n)) * M_1_PI;",
    "parameter texture map;")
scene("planes.toml", 'material = { model = "planes.brdf", map = "planes.png" }')
sums = np.zeros((48, 48))
for k in range(3):
    png(f"plane{k}.png", image[:, :, k])
    scene("one.toml", f'albedo = 1.0\nalbedo_texture = "plane{k}.png"')
    one = render("one.toml")
    sums = sums + (k + 1) * 0.1 * one if not isinstance(one, str) else sums
compare("planes of an image are channels", render("planes.toml"), sums, 1e-5)
law("uv.brdf", "return vec4(uv.y) * max(0, (i|n)) * M_1_PI;")
scene("uv.toml", 'material = { model = "uv.brdf" }')
given = render("uv.toml")
rows = np.arange(1024)
png("down.png", np.round(255 * (np.tile(rows, (4, 1)).T + 0.5) / 1024))
scene("down.toml", 'albedo = 1.0\nalbedo_texture = "down.png"')
down = render("down.toml")
# 8 bits of the image: a share of the largest value.
check("v grows from north to south", not isinstance(given, str) and not isinstance(down, str)
      and np.max(np.abs(given - down)) < 5e-3 * np.max(down), f"{given if isinstance(given, str) else down if isinstance(down, str) else np.max(np.abs(given - down)) / np.max(down)}")
law("bad.brdf", "return lookup3DLOD(map, i, lod_bias) * (i|n);", "parameter texture map;")
scene("bad.toml", 'material = { model = "bad.brdf", map = "map.png" }')
said = render("bad.toml")
check("a texture that is read along the light is refused", isinstance(said, str) and "must not depend on directions" in said, said)

# Emission.
law("dark.brdf", "return vec4(0);", "parameter own vec4(1, 2, 3, 4);", "return own;")
scene("glow.toml", 'material = { model = "dark.brdf" }', 4)
scene("emission.toml", 'albedo = 0.0\nemission_w_m2_sr = [1, 2, 3, 4]', 4)
glow = render("emission.toml")
compare("emission() is emission_w_m2_sr", render("glow.toml"), glow)
law("factor.brdf", "return vec4(0);", "parameter own 0.5;", "return own * emission * (1 + t);")
scene("factor.toml", 'material = { model = "factor.brdf" }\nemission_w_m2_sr = [1, 2, 3, 4]\nemission_texture = "map.png"', 4)
scene("mapped.toml", 'albedo = 0.0\nemission_w_m2_sr = [1, 2, 3, 4]\nemission_texture = "map.png"', 4)
compare("emission() with an emission map", render("factor.toml", "--time", "1"), render("mapped.toml"))
scene("none.toml", 'material = { model = "factor.brdf" }', 4)
none = render("none.toml")
check("a law that passes its argument does not glow by itself", not isinstance(none, str) and np.all(none == 0), none)
law("limb.brdf", "return vec4(0);", "", "return vec4(1, 2, 3, 4) * (e|n);")
scene("limb.toml", 'material = { model = "limb.brdf" }', 4)
limb = render("limb.toml", "--samples", "64")
# The mean of the cosine over the disc of a distant sphere is 2/3.
if not isinstance(limb, str):
    ratio = limb.sum(axis=(1, 2)) / render("emission.toml", "--samples", "64").sum(axis=(1, 2))
    check("emission by the cosine", np.max(np.abs(ratio - 2 / 3)) < 5e-3, ratio)
for emission, words in (("return vec4(1 / 0);", "emission() is not finite for 100.0 % of angles"),
                        ("return vec4((e|n) - 2);", "emission() is negative for 100.0 % of angles")):
    law("wrong.brdf", "return vec4(0);", "", emission)
    scene("wrong.toml", 'material = { model = "wrong.brdf" }')
    done = run("check", "wrong.toml")
    check(f"said of emission: {words}", (done.stdout + done.stderr).count(words) == 1, done.stdout + done.stderr)


# Textures in SuMoL.
LOOK_UP = "vec4 lookup2D(texture tex, vec2 uv, scalar lod)"


def texture(name, body, before="", function=LOOK_UP):
    (folder / name).write_text(f"{before}\n{function}\n{{ {body} }}\n")


texture("same.txr", "return lookupLOD(tex, uv, lod);")
for image_name, bands in (("map.png", 1), ("planes.png", 3)):
    scene("txr.toml", f'albedo = 1.0\nalbedo_texture = {{ model = "same.txr", tex = "{image_name}" }}', bands)
    scene("image.toml", f'albedo = 1.0\nalbedo_texture = "{image_name}"', bands)
    compare(f"a texture that passes {image_name}", render("txr.toml"), render("image.toml"))
scene("txr.toml", 'albedo = 0.0\nemission_w_m2_sr = [1, 2, 3]\nemission_texture = { model = "same.txr", tex = "planes.png" }', 3)
scene("image.toml", 'albedo = 0.0\nemission_w_m2_sr = [1, 2, 3]\nemission_texture = "planes.png"', 3)
compare("a texture as emission map", render("txr.toml"), render("image.toml"))
scene("txr.toml", 'material = "minnaert"\nalbedo = 0.5\nexponent_texture = { model = "same.txr", tex = "map.png" }\nexponent_texture_range = [0.4, 1.2]')
scene("image.toml", 'material = "minnaert"\nalbedo = 0.5\nexponent_texture = "map.png"\nexponent_texture_range = [0.4, 1.2]')
compare("a texture as parameter", render("txr.toml"), render("image.toml"))
scene("txr.toml", 'material = { model = "planes.brdf", map = { model = "same.txr", tex = "planes.png" } }')
compare("a texture in a law", render("txr.toml"), render("planes.toml"))
texture("direction.txr", "vec3 d = normalize(los); vec2 uv = vec2(atan2(d.y, d.x) / (2 * M_PI) + 0.5, 0.5 - atan2(d.z, length(d.xy)) / M_PI);"
        " return lookupLOD(tex, uv, lod);", "", "vec4 lookup3D(texture tex, vec3 los, scalar lod)")
scene("txr.toml", 'albedo = 1.0\nalbedo_texture = { model = "direction.txr", tex = "map.png" }')
given = render("txr.toml")
# Footprints are long at the limb, where they are bent by the one and straight by the other.
if isinstance(given, str):
    check("a texture by direction", False, given)
else:
    difference = np.abs(given - mapped)[mapped > 0] / mapped[mapped > 0]
    shares = np.percentile(difference, [80, 95, 100])
    check("a texture by direction", np.all(shares < [1e-6, 2e-2, 0.3]), list(shares))
texture("half.txr", "return los.z > 0 ? vec4(0.5) : vec4(M_NAN);", "", "vec4 lookup3D(texture tex, vec3 los, scalar lod)")
scene("txr.toml", 'albedo = 1.0\nalbedo_texture = { model = "half.txr" }')
given, plain = render("txr.toml"), render("plain.toml")
if isinstance(given, str):
    check("no data leaves the body's own value", False, given)
else:
    ratio = given[plain > 0] / plain[plain > 0]
    check("no data leaves the body's own value", np.mean(np.isclose(ratio, 0.5) | np.isclose(ratio, 1)) > 0.9 and np.isclose(ratio, 1).any()
          and np.isclose(ratio, 0.5).any(), ratio)
scene("txr.toml", 'albedo = 1.0\nalbedo_texture = { model = "checker", across = 32, light = 0.9 }')
check("bytes with a texture do not depend on threads", len({(run("render", "txr.toml", "-o", f"t{n}.fits", "--threads", str(n)),
                                                           (folder / f"t{n}.fits").read_bytes())[1] for n in (1, 2, 7)}) == 1)


def evaluated(model, u, v, *settings):
    words = [word for setting in settings for word in ("--set", setting)]
    done = run("model", "eval", model, "--at", f"u={u}", "--at", f"v={v}", *words, "--json")
    return json.loads(done.stdout)["channels"][0] if done.returncode == 0 else done.stderr


points = rng.random((20, 2))
given = [evaluated("checker", u, v, "across=5", "down=3") for u, v in points]
check("checker is what numpy makes of its formula", given == [0.2 if (math.floor(u * 5) + math.floor(v * 3)) % 2 else 0.8 for u, v in points], given)
given = [evaluated("region", u, v, "west_deg=-100", "east_deg=60", "south_deg=-10", "north_deg=70") for u, v in points]
inside = [-100 <= 360 * u - 180 <= 60 and -10 <= 90 - 180 * v <= 70 for u, v in points]
check("region has data within its edges", given == [0.5 if there else None for there in inside], given)
for body, words in (("return vec4(1 / 0);", "is not finite for 100.0 % of the texture"), ("return vec4(M_NAN);", "gives no data anywhere"),
                    ("return vec4(uv.x - 0.25);", "negative for 25.0 %, most at uv 0.000"), ("return vec4(2 * uv.x);", "up to 2, at uv"),
                    ("return lookupLOD(tex, uv, lod);", "the image of the texture is missing")):
    texture("odd.txr", body)
    scene("odd.toml", 'albedo = 1.0\nalbedo_texture = { model = "odd.txr" }')
    done = run("check", "odd.toml")
    check(f"said of a texture: {words}", (done.stdout + done.stderr).count(words) == 1, done.stdout + done.stderr)
for keys, words in (('model = "same.txr", text = "map.png"', "did you mean \"tex\"?"), ('model = "same.txr", tex = "gone.png"', "gone.png: no such file"),
                    ('model = "map.brdf"', "a texture needs one that ends in .txr"), ('model = "same.txr", tex = 3', "allowed")):
    scene("odd.toml", f"albedo = 1.0\nalbedo_texture = {{ {keys} }}")
    said = render("odd.toml")
    check(f"refused of a texture: {words}", isinstance(said, str) and words in said, said)

# Globals.
law("global.brdf", "return level * diffuse * max(0, (i|n)) * M_1_PI;", "global level vec4(0.5);")
texture("global.txr", "return level;", "global level vec4(0.25);")
own = 'material = { model = "global.brdf" }\nalbedo_texture = { model = "global.txr" }'
scene("own.toml", own, 6)
compare("a global has the default of each model", render("own.toml"), 0.125 * white, 3e-7)
scene("set.toml", own + '\n[[global]]\nname = "level"\nvalues = [0.1, 0.2, 0.3, 0.4]', 6)
compare("a global is shared by its name", render("set.toml"), np.reshape([0.1, 0.2, 0.3, 0.4, 0.1, 0.2], (6, 1, 1)) ** 2 * white, 3e-7)
scene("wrong.toml", own + '\n[[global]]\nname = "level"\nvalues = [0.1, 0.2]', 6)
said = render("wrong.toml")
check("a global of the wrong size is refused", isinstance(said, str) and 'global "level": 2 numbers: ' in said, said)
scene("unknown.toml", own + '\n[[global]]\nname = "leven"\nvalues = [0.1]', 6)
done = run("check", "unknown.toml")
check("an unknown global is said once", (done.stdout + done.stderr).count('global "leven"') == 1, done.stdout + done.stderr)

temporary.cleanup()
sys.exit(1 if failures else 0)
