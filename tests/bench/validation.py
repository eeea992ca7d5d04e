#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes docs/validation.md: the renderer beside Blender's Cycles and absolute values, with every figure's command.

Usage: validation.py OBSCURA [--scenes NAME,...] [--samples N] [--size PIXELS] [--rounds N] [--threads N]
                     [--output docs/validation.md]
       validation.py OBSCURA --absolute-only [--output docs/validation.md]
OBSCURA: the program in its build tree, with tests/bench/render_bench beside it. Needs Blender (Debian package blender)
and numpy (python3-numpy), also in the Python within Blender; without them nothing is written and the exit status is 77.
With --absolute-only the part on absolute values, which needs none of them, is written anew and the rest of the page stays.
Scenes that need files which are not there are skipped, and the page says so. Both programs run by turns, and medians count; even so times compare within this run only.
"""
import argparse
import importlib.util
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile

import peer_scenes
from peer_runs import ROOT, Programs, run

SCENES = {
    "asteroid": "Asteroid of 199 692 facets, direct light",
    "moon": "Moon of 2 073 600 facets, direct light",
    "moon-2-bounces": "The same Moon, two bounces",
    "limb": "The limb of that Moon from 100 km, direct light",
    "terrain": "The Moon as a planet with LDEM_4's heights, direct light; Cycles: the mesh",
    "terrain-limb": "The limb of that planet from 100 km, direct light; Cycles: the mesh",
    "cornell": "Cornell box, full solution",
}
parser = argparse.ArgumentParser()
parser.add_argument("obscura", type=pathlib.Path)
parser.add_argument("--scenes", default=",".join(SCENES))
parser.add_argument("--samples", type=int, default=128)
parser.add_argument("--size", type=int, default=512)
parser.add_argument("--rounds", type=int, default=3)
parser.add_argument("--threads", type=int, default=2)
parser.add_argument("--absolute-only", action="store_true")
parser.add_argument("--output", type=pathlib.Path, default=ROOT / "docs/validation.md")
options = parser.parse_args()
ABSOLUTE = "## Absolute values\n"
absolute_off = False


def absolute_values():
    """The last part of the page; notes whether a figure is further off than it may be."""
    global absolute_off
    done = subprocess.run([sys.executable, ROOT / "tests/bench/absolute_checks.py", options.obscura], capture_output=True, text=True,
                          check=False)
    if done.returncode not in (0, 1) or not done.stdout:
        sys.exit(f"absolute_checks.py: {done.stderr.strip()}")
    absolute_off = done.returncode == 1
    return f"""{ABSOLUTE}
Small scenes against published or closed-form values, no scale taken out. OBSCURA: `build/release/tools/obscura`.

{done.stdout.rstrip()}
"""


if options.absolute_only:
    options.output.write_text(options.output.read_text().partition(ABSOLUTE)[0].rstrip() + "\n\n" + absolute_values())
    print(f"{options.output}: absolute values{', some too far off' if absolute_off else ''}")
    sys.exit(1 if absolute_off else 0)


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


if not shutil.which("blender"):
    skip("blender is not installed (Debian package blender)")
if not importlib.util.find_spec("numpy"):
    skip("Python's numpy is not installed (Debian package python3-numpy)")
NO_NUMPY = 77
asked = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", str(NO_NUMPY), "--python-expr", "import numpy"],
                       capture_output=True, check=False)
if asked.returncode == NO_NUMPY:
    skip("the Python within Blender has no numpy (Debian package python3-numpy)")
folder = pathlib.Path(tempfile.mkdtemp(prefix="obscura-validation-"))
pictures = options.output.parent
# Bands of the Cornell box that Cycles renders as red, green and blue: 500, 600 and 700 nm.
CORNELL_BANDS = [3, 5, 7]
CORNELL_SIZE = 128
worst_blocks = []


def median_of(runs):
    return statistics.median(r.wall_s for r in runs), statistics.median(r.cpu_s for r in runs)


def rounds(*programs):
    """Runs each program once in each round, with the round's number as the seed; at least two rounds."""
    results = [[] for _ in programs]
    for seed in range(1, max(2, options.rounds) + 1):
        for program, result in zip(programs, results):
            result.append(program(seed))
            print(f"  {result[-1].wall_s:.1f} s, {result[-1].cpu_s:.1f} s of processor", flush=True)
    return results


def at_equal_error(programs, scene, noise):
    """The settings of adaptive sampling, least first, that reach this noise, and three runs with them."""
    error = 0.04 * noise
    while error > 0.0005 * noise:
        settings = ["--samples", 16, "--error", f"{error:.2g}", "--max-samples", 2048]
        pair = [programs.ours(scene, seed, *settings) for seed in (1, 2)]
        reached = programs.noise_percent(pair[0].file, pair[1].file, 0)
        print(f"  --error {error:.2g}: noise {reached:.3f} %, aim {noise:.3f} %", flush=True)
        if reached <= noise:
            return settings, reached, [*pair, programs.ours(scene, 3, *settings)]
        error /= 1.1
    sys.exit(f"{scene}: adaptive sampling does not reach a noise of {noise} %")


def direct_scene(name):
    """Compares a scene of one band under the Sun; returns its part of the page and its row of the table."""
    programs = Programs(options.obscura, folder, options.size, options.threads)
    scene, peer = peer_scenes.write(folder, name, options.size, options.obscura.parent.parent / "tests/bench/render_bench")
    ours, cycles = rounds(lambda seed: programs.ours(scene, seed, "--samples", options.samples),
                          lambda seed: programs.cycles(peer, [1], options.samples, seed))
    picture = pictures / f"validation-{name}.png"
    both = programs.compare(ours[0].file, cycles[0].file, 0, "R", "--blocks", 16, "--picture", picture)
    if peer == scene:  # otherwise surfaces differ between the samples of the heights
        worst_blocks.append(both["block_worst_percent"])
    noise = [programs.noise_percent(ours[0].file, ours[1].file, 0),
             programs.noise_percent(cycles[0].file, cycles[1].file, "R")]
    settings, reached, equal = at_equal_error(programs, scene, noise[1])
    (ours_wall, ours_cpu), (cycles_wall, cycles_cpu) = median_of(ours), median_of(cycles)
    equal_wall, equal_cpu = median_of(equal)
    same = noise[1] ** 2 / noise[0] ** 2
    rates = [options.size**2 * options.samples / t * 1e-6 for t in (ours_cpu, cycles_cpu)]
    words = " ".join(map(str, settings))
    text = f"""Scale over the Sun's irradiance aside, the worst block of 16 x 16 pixels is {both['block_worst_percent']:.2f} % off, the median
one {both['block_median_percent']:.2f} %; correlation {both['correlation']:.5f}.

| | noise | seconds, clock | seconds, processor | M samples/s per core |
|---|---|---|---|---|
| ours, {options.samples} samples | {noise[0]:.3f} % | {ours_wall:.2f} | {ours_cpu:.2f} | {rates[0]:.2f} |
| Cycles, {options.samples} samples | {noise[1]:.3f} % | {cycles_wall:.2f} | {cycles_cpu:.2f} | {rates[1]:.2f} |
| ours, `{words}` | {reached:.3f} % | {equal_wall:.2f} | {equal_cpu:.2f} | {equal[0].samples / equal_cpu * 1e-6:.2f} of those taken |

Ours, Cycles, difference:

![]({picture.name})
"""
    row = (f"| {SCENES[name]} | {cycles_cpu / ours_cpu * same:.1f} | {cycles_cpu / equal_cpu:.1f} | "
           f"{cycles_wall / equal_wall:.1f} |\n")
    return text, row


def cornell():
    programs = Programs(options.obscura, folder, CORNELL_SIZE, options.threads)
    scene, _ = peer_scenes.write(folder, "cornell", CORNELL_SIZE, None)
    three = peer_scenes.with_bands(scene, CORNELL_BANDS, folder)
    samples = 2 * options.samples
    cube, ours, cycles = rounds(lambda seed: programs.ours(scene, seed, "--samples", samples),
                                lambda seed: programs.ours(three, seed, "--samples", samples),
                                lambda seed: programs.cycles(scene, CORNELL_BANDS, samples, seed))
    text = """| wavelength | scale | worst block | median block | noise, ours | noise, Cycles |
|---|---|---|---|---|---|
"""
    shown = ""
    same = []
    for plane, (band, channel) in enumerate(zip(CORNELL_BANDS, "RGB")):
        wavelength = 350 + 50 * band
        picture = pictures / f"validation-cornell-{wavelength}nm.png"
        both = programs.compare(cube[0].file, cycles[0].file, band - 1, channel, "--blocks", 16, "--picture", picture)
        worst_blocks.append(both["block_worst_percent"])
        noise = [programs.noise_percent(ours[0].file, ours[1].file, plane),
                 programs.noise_percent(cycles[0].file, cycles[1].file, channel)]
        same.append(noise[1] ** 2 / noise[0] ** 2)
        text += (f"| {wavelength} nm | {both['scale']:.4f} | {both['block_worst_percent']:.2f} % | "
                 f"{both['block_median_percent']:.2f} % | {noise[0]:.2f} % | {noise[1]:.2f} % |\n")
        shown += f"{wavelength} nm: ours, Cycles, difference\n\n![]({picture.name})\n\n"
    (cube_wall, cube_cpu), (ours_wall, ours_cpu), (cycles_wall, cycles_cpu) = map(median_of, (cube, ours, cycles))
    gain = statistics.mean(same)
    text += f"""
| {CORNELL_SIZE} x {CORNELL_SIZE} pixels, {samples} samples | seconds, clock | seconds, processor | M samples/s per core |
|---|---|---|---|
| ours, those three bands | {ours_wall:.2f} | {ours_cpu:.2f} | {CORNELL_SIZE**2 * samples / ours_cpu * 1e-6:.3f} |
| ours, all seven | {cube_wall:.2f} | {cube_cpu:.2f} | {CORNELL_SIZE**2 * samples / cube_cpu * 1e-6:.3f} |
| Cycles, three bands | {cycles_wall:.2f} | {cycles_cpu:.2f} | {CORNELL_SIZE**2 * samples / cycles_cpu * 1e-6:.3f} |

{shown}"""
    row = (f"| {SCENES['cornell']}, three bands | {cycles_cpu / ours_cpu * gain:.2f} | | "
           f"{cycles_wall / ours_wall * gain:.2f} |\n"
           f"| the same, all seven: three runs of Cycles | {3 * cycles_cpu / cube_cpu * gain:.2f} | | "
           f"{3 * cycles_wall / cube_wall * gain:.2f} |\n")
    return text, row


chosen = options.scenes.split(",")
parts, table = "", ""
for name, title in SCENES.items():
    if name not in chosen:
        continue
    print(name, flush=True)
    try:
        text, row = cornell() if name == "cornell" else direct_scene(name)
        table += row
    except peer_scenes.Skipped as reason:
        print(f"skipped: {reason}")
        text = f"Skipped: {reason}.\n"
    parts += f"## {title}\n\n{text.rstrip()}\n\n"

load = os.getloadavg()[2]
version = run("blender", "--version").splitlines()[0]
arguments = (f"--scenes {options.scenes} --samples {options.samples} --size {options.size} --rounds {options.rounds} "
             f"--threads {options.threads}")
text = f"""# Validation

Generated by `tests/bench/validation.py build/release/tools/obscura {arguments}`;
the part on absolute values, at the end, by the same with `--absolute-only` alone. Do not edit.
Peer: {version} (Cycles on the processor, box filter, no adaptive sampling, no denoising, no clamping). Both programs get
the same geometry, Sun, camera, Lambert materials, bounces and samples; `tests/bench/peer_scenes.py` writes the scenes.

Noise is the rms deviation of one picture, from two with different seeds, over the rms of the picture. Times are those of the
rendering proper, without reading meshes and building trees, medians of {max(2, options.rounds)} runs by turns. The machine's load was {load:.0f} on {os.cpu_count()} cores:
where that is more than the threads, other programs were at work, times by the clock mean nothing, and those of the processor
are upper bounds. Pictures are compared by `obscura compare --no-offset --max-shift 0 --blocks
16`, which takes out one common scale; in pictures of the difference grey is none, four times its rms black or white.

## Time to equal error, Cycles over ours

At the same number of samples: the ratio of (processor time x noise^2). To the noise of Cycles: its time over ours with
adaptive sampling, set so that our noise, measured in the same way, is at most that of Cycles.

| scene | same samples, processor time | to the noise of Cycles, processor time | by the clock |
|---|---|---|---|
{table}
{parts}"""
options.output.write_text(text.rstrip() + "\n\n" + absolute_values())
shutil.rmtree(folder)
print(f"{options.output}: worst block {max(worst_blocks, default=0):.2f} %")
sys.exit(0 if max(worst_blocks, default=0) < 2 and not absolute_off else 1)
