#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Shipped sensors, scenes and star catalogues are found by their names, in the source tree and installed.
Usage: shipped_names_test.py OBSCURA OBSCURAD"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
obscura, obscurad = sys.argv[1:3]
folder = pathlib.Path(tempfile.mkdtemp())
failures = []


def run(*command, status=0, has=""):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=folder)
    said = done.stdout + done.stderr
    if done.returncode != status or has not in said:
        failures.append(f"{command}: exit {done.returncode}, wanted {status} and \"{has}\": {said[:500]}")
        print("FAILED:", failures[-1])
    return said


BODY = '[[body]]\nname = "rock"\nshape = "ellipsoid"\nradii_m = [1, 1, 1]\nalbedo = 0.5\n'
config = folder / "c.toml"


def configure(sensor="has2", scene="demo"):
    config.write_text(f'[scene]\nfile = "{scene}"\n[sensor]\nfile = "{sensor}"\n[camera]\nexposure_us = 20000\n')


configure()
run(obscurad, "--config", config, "--check")
run(obscurad, "--config", config, "--print-config", has=f'file = "{ROOT}/config/scenes/demo.toml"')
run(obscura, "pose", "demo", has="asteroid")
run(obscura, "render", "demo", "-o", "demo.png", "--size", "64x48")
run(obscura, "sensor", "show", "has2", has="HAS2")

# Errors name what there is, at the value.
sensors = ", ".join(sorted(f.stem for f in (ROOT / "config/sensors").glob("*.toml")))
scenes = ", ".join(sorted(f.stem for f in (ROOT / "config/scenes").glob("*.toml")))
configure(sensor="has9")
run(obscurad, "--config", config, "--check", status=78, has=f"c.toml:4:8: sensor.file: {folder}/has9: no such file, "
    f"and no shipped sensor: there are {sensors}")
configure(scene="dmo")
run(obscurad, "--config", config, "--check", status=78, has=f"c.toml:2:8: scene.file: {folder}/dmo: no such file, "
    f"and no shipped scene: there are {scenes}")
configure(scene="dmo.toml")
run(obscurad, "--config", config, "--check", status=78, has="dmo.toml: no such file\n")
run(obscura, "check", "demo", "--quick", has="scenes/demo.toml: good")
run(obscura, "check", "imx-3.45um", has="sensors/imx-3.45um.toml: good")
run(obscura, "render", "dmo", "-o", "x.png", status=66,
    has=f'no shipped scene: there are {scenes}; did you mean "demo"?')
run(obscura, "check", "has9", status=66, has="has9: no such file, and no shipped sensor or scene: there are sensors "
    f"{sensors}; scenes {scenes}; did you mean \"has2\"?\n")
run(obscura, "check", "quite-another", status=66, has=f"; scenes {scenes}\n")
run(obscura, "check", "has9.toml", status=66, has="has9.toml: no such file\n")
run(obscura, "sensor", "show", "has9", status=66, has=f"no shipped sensor: there are {sensors}")
(folder / "stars.toml").write_text(BODY + '[stars]\ncatalogue = "bright"\nlimiting_magnitude = 1\n')
run(obscura, "check", "--scene", "stars.toml", has="15 stars")
(folder / "stars.toml").write_text(BODY + '[stars]\ncatalogue = "dim"\n')
run(obscura, "check", "--scene", "stars.toml", status=78, has="no shipped star catalogue: there are bright")

# Tables of keys by name.
run(obscura, "keys", "gigge", status=64, has='no table "gigge"; did you mean "gige"?')
run(obscura, "keys", "lambrt", status=64, has='did you mean "lambert"?')
run(obscura, "keys", "trajectories", status=64, has="allowed scene, daemon, render, ")

# A file of the name beside the configuration, or where the program runs, counts more.
(folder / "demo").write_text(BODY)
configure()
run(obscurad, "--config", config, "--print-config", has=f'file = "{folder}/demo"')
run(obscura, "pose", "demo", has="rock")
(folder / "demo").unlink()

# Installed: beside the program, whatever the source tree has.
installed = folder / "prefix"
shutil.copytree(ROOT / "config/sensors", installed / "share/obscura/sensors")
(installed / "share/obscura/scenes").mkdir()
(installed / "share/obscura/scenes/elsewhere.toml").write_text(BODY)
(installed / "bin").mkdir()
for program in (obscura, obscurad):
    shutil.copy(program, installed / "bin")
run(installed / "bin/obscura", "pose", "elsewhere", has="rock")
run(installed / "bin/obscura", "pose", "demo", status=66, has="no shipped scene: there are elsewhere")
configure(scene="elsewhere")
run(installed / "bin/obscurad", "--config", config, "--print-config",
    has=f'file = "{installed}/share/obscura/scenes/elsewhere.toml"')
shutil.rmtree(folder)
sys.exit(1 if failures else print("shipped files are found by name") or 0)
