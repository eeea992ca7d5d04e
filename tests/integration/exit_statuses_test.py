#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Exit statuses of paths that lead nowhere, as sysexits.h has them: 66 for an input that cannot be read, 73 for an output that
cannot be created, 77 for what belongs to somebody else; each with one line that has the name. Every verb that reads a file is
asked to read loops of links, names that are too long, folders and files below files; those that write to write there.

Usage: exit_statuses_test.py OBSCURA OBSCURAD
Exit status 1 if a check failed. Permissions are tried as the user nobody by root, else by files of mode 0.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

obscura, obscurad = (str(pathlib.Path(p).resolve()) for p in sys.argv[1:3])
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from checks import check, failures  # noqa: E402

HANG_S = 120
NO_INPUT, NO_OUTPUT, NO_PERMISSION = 66, 73, 77
NOBODY = {"user": 65534, "group": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
LONG = "a" * 300


def run(words, program=None, **options):
    return subprocess.run([program or obscura, *map(str, words)], cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=HANG_S, **options)


def told(done, status, name):
    """Whether it ends so, with one line that has the name (a long one is cut in messages)."""
    lines = [line for line in done.stderr.splitlines() if "warning:" not in line and "starting with" not in line]
    return done.returncode == status and len(lines) == 1 and name[:20] in lines[0]


def inputs():
    """The verbs that say 66 of a file that is not there say so of all others, too."""
    verbs = re.findall(r"^  ([a-z]+(?: [a-z-]+)?)  ", run(["--help"]).stdout, re.MULTILINE)
    readers = 0
    for verb in verbs:
        if verb.split()[0] in ("serve", "new", "top", "watch", "monitor", "events"):
            continue
        help_text = run([*verb.split(), "--help"]).stdout
        usage = re.search(r"^Usage: obscura " + verb + r"((?: [A-Z_.\[\]]+)+)", help_text, re.MULTILINE)
        if not usage:
            continue
        choices = re.search(r"ACTION|TOPIC|KIND", usage[1])
        first = ["show"] if choices and verb == "sensor" else []
        more = ["-o", "made"] if "--output" in help_text else []
        try:
            done = run([*verb.split(), *first, "missing.toml", *more])
        except subprocess.TimeoutExpired:
            check(f"obscura {verb} ends", False)
            continue
        if done.returncode != NO_INPUT:
            continue
        readers += 1
        end = ".brdf" if verb.startswith("model") else ".toml"  # the ending says what a model is of
        for odd in ("loop" + (end if end == ".brdf" else ""), f"loop/x{end}", LONG + (end if end == ".brdf" else ""), f"{LONG}/x{end}", f"file/x{end}"):
            done = run([*verb.split(), *first, odd, *more])
            check(f"obscura {verb} {odd[:12]}: cannot be read", told(done, NO_INPUT, odd), (done.returncode, done.stderr))
        done = run([*verb.split(), *first, "folder" + end, *more])
        check(f"obscura {verb} of a folder: cannot be read", done.returncode == NO_INPUT, (done.returncode, done.stderr))
        for odd in ("secret" + end, "locked/x" + end):
            done = run([*verb.split(), *first, odd, *more], **NOBODY)
            # A batch is a folder, which a file is not.
            wanted = NO_INPUT if verb.startswith("batch") and odd == "secret.toml" else NO_PERMISSION
            check(f"obscura {verb} {odd}: no permission", told(done, wanted, odd), (done.returncode, done.stderr))
    check("there are verbs that read files", readers >= 5, readers)


def named_files():
    """Files that scenes, cameras and command lines name, in a folder that must not be entered and of another user, whatever library reads them."""
    body = '[camera]\nwidth = 8\nheight = 8\n{}\n[[body]]\nposition_m = [0, 0, 9]\n{}\n'
    sphere = 'shape = "ellipsoid"\nradii_m = [1, 1, 1]\n'
    camera = '[scene]\nfile = "scene.toml"\n[sensor.readout]\nwidth = 8\nheight = 8\n[sensor.detector]\n{} = "{}"\n'
    scenes = {end: ("", f'shape = "mesh"\nfile = "{{}}.{end}"\nalbedo = 0.5') for end in ("obj", "stl", "ply", "3ds", "glb", "dae", "tab")}
    scenes |= {f"albedo {end}": ("", sphere + f'albedo = 0.5\nalbedo_texture = "{{}}.{end}"') for end in ("exr", "fits", "png", "tif", "jpg")}
    scenes["psf"] = ('psf = "table"\npsf_file = "{}.fits"', sphere + "albedo = 0.5")
    for folder_of, stem in (("locked", "x"), ("owned", "secret")):
        path = f"{folder_of}/{stem}"
        for name, (head, lines) in scenes.items():
            file = f"{folder_of}-{name.replace(' ', '-')}.toml"
            (folder / file).write_text(body.format(head, lines).replace("{}", path))
            done = run(["check", file], **NOBODY)
            check(f"a scene's {name} in {path}: no permission", told(done, NO_PERMISSION, path), (done.returncode, done.stderr))
        (folder / f"{folder_of}-map.toml").write_text(camera.format("response_map", f"{path}.fits"))
        for words in (["check", f"{folder_of}-map.toml"], ["truth", f"{path}.fits"], ["truth", f"{path}.exr"], ["truth", f"{path}.png"],
                      ["import", "stars", f"{path}.fits", "-o", "made"], ["import", "flight-image", f"{path}.fits", "--shape", "file.obj", "-o", "made"]):
            done = run(words, **NOBODY)
            check(f"obscura {' '.join(words[:3])}: no permission", told(done, NO_PERMISSION, path), (done.returncode, done.stderr))


def outputs():
    writers = {
        "render": ["render", "scene.toml", "-o", "{}.png"],
        "capture": ["capture", "camera.toml", "-n", "1", "-o", "{}"],
        "new scene": ["new", "scene", "{}.toml"],
        "sensor maps": ["sensor", "maps", "generic", "-o", "{}"],
        "sensor plan --svg": ["sensor", "plan", "generic", "--svg", "{}.svg"],
        "import stars": ["import", "stars", "stars.csv", "-o", "{}.obstars"],
        "examples --copy": ["examples", "gpio", "--copy", "{}"],
    }
    for name, words in writers.items():
        good = run([word.format("good-" + name.replace(" ", "-")) for word in words])
        if not pathlib.Path(folder / "good").exists() and name in ("capture", "sensor maps") and good.returncode == NO_OUTPUT:
            (folder / ("good-" + name.replace(" ", "-"))).mkdir()
            good = run([word.format("good-" + name.replace(" ", "-")) for word in words])
        check(f"obscura {name} writes what it can", good.returncode == 0, (good.returncode, good.stderr))
        if good.returncode != 0:
            continue
        for odd in ("loop/x", LONG, "file/x"):
            done = run([word.format(odd) for word in words])
            check(f"obscura {name} to {odd[:12]}: cannot be created", told(done, NO_OUTPUT, odd.split("/")[0]), (done.returncode, done.stderr))
        done = run([word.format("locked/x") for word in words], **NOBODY)
        check(f"obscura {name} to a locked folder: no permission", told(done, NO_PERMISSION, "locked"), (done.returncode, done.stderr))


def daemon():
    for odd, status, options in (("missing.toml", NO_INPUT, {}), ("loop", NO_INPUT, {}), (LONG, NO_INPUT, {}), ("folder.toml", NO_INPUT, {}), ("secret.toml", NO_PERMISSION, NOBODY)):
        done = run(["--config", odd], obscurad, **options)
        check(f"obscurad --config {odd[:12]}: {status}", told(done, status, odd), (done.returncode, done.stderr))
    (folder / "bad.toml").write_text("[camera]\nexposure_us = -1\n")
    done = run(["--config", "bad.toml"], obscurad)
    check("what is wrong within a configuration stays 78", done.returncode == 78, (done.returncode, done.stderr))


with tempfile.TemporaryDirectory(prefix="obscura-statuses-") as name:
    folder = pathlib.Path(name)
    (folder / "loop").symlink_to("loop")
    (folder / "loop.brdf").symlink_to("loop.brdf")
    (folder / "folder.brdf").mkdir()
    (folder / "secret.brdf").write_text("")
    (folder / "secret.brdf").chmod(0)
    (folder / "file").write_text("no folder")
    (folder / "folder.toml").mkdir()
    (folder / "secret.toml").write_text("")
    (folder / "secret.toml").chmod(0)
    (folder / "locked").mkdir()
    (folder / "owned").mkdir()
    (folder / "file.obj").write_text("")
    for end in ("obj", "stl", "ply", "3ds", "glb", "dae", "tab", "exr", "fits", "png", "tif", "jpg"):
        (folder / "owned" / f"secret.{end}").write_text("")
        (folder / "owned" / f"secret.{end}").chmod(0)
    (folder / "scene.toml").write_text('[camera]\nwidth = 8\nheight = 8\n[[body]]\nshape = "ellipsoid"\nradii_m = [1, 1, 1]\nalbedo = 0.5\nposition_m = [0, 0, 9]\n')
    (folder / "camera.toml").write_text('[scene]\nfile = "scene.toml"\n[sensor.readout]\nwidth = 8\nheight = 8\n')
    (folder / "stars.csv").write_text("ra_deg,dec_deg,v_mag\n1,1,1\n")
    folder.chmod(0o755)
    (folder / "locked").chmod(0o700 if NOBODY else 0)
    inputs()
    named_files()
    outputs()
    daemon()
    (folder / "locked").chmod(0o700)
sys.exit(1 if failures else 0)
