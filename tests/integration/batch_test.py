#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A batch of small frames is planned, rendered, stopped and killed at every stage, rendered by two processes at once and
by GNU parallel. Whatever happens, the set of (frame, SHA-256) is that of an undisturbed run, and the frames are those of
obscura render.

Usage: batch_test.py OBSCURA SOURCE-DIRECTORY
Exit status 1 if a check failed.
"""
import hashlib
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from verb_checks import VerbChecks  # noqa: E402

obscura, source = sys.argv[1], pathlib.Path(sys.argv[2])
checks = VerbChecks(obscura)
PATIENCE_S = 120
FRAMES, SHARD = 7, 3
RENDER = ["--samples", "2", "--step", "40", "--seed", "5", "--exposure", "1"]


def plan(batch, *more, frames=f"0:{FRAMES}"):
    return json.loads(checks.run("batch", "plan", scene, "--frames", frames, "--shard", SHARD, "--out", batch, "--json",
                                 *RENDER, *more))


def run(batch, *more, before=(), preexec=None):
    return subprocess.run([*before, obscura, "batch", "run", batch, "--threads", "1", *more], capture_output=True, text=True,
                          timeout=PATIENCE_S, preexec_fn=preexec)


def records(batch):
    lines = []
    for file in sorted(pathlib.Path(batch).glob("shards/*/shard.jsonl")):
        for line in file.read_text().splitlines():
            try:
                lines.append(json.loads(line))
            except ValueError:
                pass
    return lines


def hashes(batch):
    """What is on the disk, by name."""
    return {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in pathlib.Path(batch).glob("shards/*/frame_*.exr")}


def check_complete(what, batch, status=0):
    """All frames are there, as recorded and as in the undisturbed run."""
    checks.run("batch", "verify", batch, status=status)
    checks.check(f"{what}: the frames are those of the undisturbed run", hashes(batch), undisturbed)
    recorded = {(r["frame"], r["sha256"]) for r in records(batch)}
    checks.check(f"{what}: and so are their records", recorded, undisturbed_records)


def check_refused(what, done, status, *texts):
    checks.check(f"{what}: exit status ({done.stderr})", done.returncode, status)
    checks.check(f"{what}: one line: {done.stderr!r}", done.stderr.count("\n"), 1)
    for text in texts:
        checks.check(f"{what}: {done.stderr!r} has {text!r}", text in done.stderr, True)


with tempfile.TemporaryDirectory(prefix="obscura-batch-") as temporary:
    folder = pathlib.Path(temporary).resolve()
    (folder / "scene").mkdir()
    scene = folder / "scene" / "scene.toml"
    (folder / "scene" / "stars.csv").write_text("ra_deg,dec_deg,v_mag\n0.1,0.2,1\n1,1,2\n")
    text = (source / "tests" / "support" / "light_scene.toml").read_text()
    text = text.replace("focal_length_mm = 50", "focal_length_mm = 15\nwidth = 16\nheight = 16\npixel_pitch_um = 100")
    scene.write_text(f'[stars]\ncatalogue = "stars.csv"\n{text}\nspin_rate_deg_per_s = 1\n')

    # The undisturbed run, and the same frames by obscura render.
    whole = folder / "whole"
    told = plan(whole)
    checks.check("shards", (told["frames"], told["shards"], told["assets"]), (FRAMES, 3, 1))
    checks.run("batch", "status", whole, status=1)
    ran = json.loads(checks.run("batch", "run", whole, "--json"))
    checks.check("an undisturbed run renders every frame once", (ran["rendered"], ran["present"]), (FRAMES, 0))
    undisturbed = hashes(whole)
    undisturbed_records = {(r["frame"], r["sha256"]) for r in records(whole)}
    checks.check("one record for each frame", len(records(whole)), FRAMES)
    checks.check("a record has these members", sorted(records(whole)[0]),
                 ["bytes", "file", "finished_s", "frame", "host", "plan", "seconds", "sha256", "version"])
    (folder / "rendered").mkdir()
    checks.run("render", scene, "-o", folder / "rendered" / "frame_%06d.exr", "--frames", FRAMES, *RENDER)
    rendered = {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in (folder / "rendered").iterdir()}
    checks.check("frames of a batch are those of obscura render", undisturbed, rendered)
    checks.check("frames differ from each other", len(set(undisturbed.values())), FRAMES)
    state = json.loads(checks.run("batch", "status", whole, "--json"))
    checks.check("status of a complete batch", (state["done"], state["shards_done"], state["left_s"]), (FRAMES, 3, 0.0))
    again = json.loads(checks.run("batch", "run", whole, "--json"))
    checks.check("a second run renders nothing", (again["rendered"], again["present"]), (0, FRAMES))
    checks.run("batch", "plan", scene, "--frames", f"0:{FRAMES}", "--shard", SHARD, "--out", whole, *RENDER)
    checks.check_refused(["batch", "plan", scene, "--frames", "0:8", "--out", whole], 74, "there is another plan already")

    # A part of a sequence has its numbers and its bytes; so have FITS files with layers, on two threads.
    part = folder / "part"
    plan(part, frames="4:6")
    checks.run("batch", "run", part)
    checks.check("part of a sequence", hashes(part), {k: undisturbed[k] for k in ("frame_000005.exr", "frame_000006.exr")})
    fits = folder / "fits"
    plan(fits, "--format", "fits", "--layers", "--window", "2,3,8x9", frames="1")
    checks.run("batch", "run", fits, "--threads", "2")
    checks.run("render", scene, "-o", folder / "one.fits", "--layers", "--window", "2,3,8x9", "--threads", "1", *RENDER)
    checks.check("FITS files with layers", (fits / "shards/00000/frame_000001.fits").read_bytes(),
                 (folder / "one.fits").read_bytes())

    # Killed at each of these calls, with and without strace's help; then run to the end.
    traceable = subprocess.run(["strace", "-o", "/dev/null", "true"], capture_output=True).returncode == 0 \
        if shutil.which("strace") else False
    if not traceable:
        print("skipped: killing at a call needs strace and the right to trace")
    stages = [(call, n) for call in ("fsync", "rename") for n in (1, 2, 3)] + [("write", n) for n in (1, 2, 3, 5, 8)]
    killed = 0
    for call, n in stages if traceable else []:
        batch = folder / f"killed-{call}-{n}"
        plan(batch)
        done = run(batch, before=["strace", "-f", "-o", "/dev/null", "-e", f"trace={call}",
                                  "-e", f"inject={call}:signal=SIGKILL:when={n}"])
        killed += done.returncode in (-signal.SIGKILL, 128 + signal.SIGKILL)
        checks.check(f"killed at {call} {n}: no frame has its name without being whole",
                     {k: v for k, v in hashes(batch).items() if undisturbed[k] != v}, {})
        checks.check(f"killed at {call} {n}: the next run ends well", run(batch).returncode, 0)
        check_complete(f"killed at {call} {n}", batch)
    if traceable:
        checks.check("runs were killed", killed >= len(stages) - 3, True)

    # The plan lists every file that rendering opens, also those that the files of the scene name.
    (folder / "scene" / "mesh.mtl").write_text("newmtl a\nKd 0.1 0.2 0.3\n")
    (folder / "scene" / "mesh.obj").write_text("mtllib mesh.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n")
    (folder / "scene" / "all.tm").write_text("KPL/MK\n\\begindata\nKERNELS_TO_LOAD = ('radii.tpc')\n\\begintext\n")
    (folder / "scene" / "radii.tpc").write_text("KPL/PCK\n\\begindata\nBODY301_RADII = (1737.4 1737.4 1737.4)\n\\begintext\n")
    assets = folder / "scene" / "assets.toml"
    assets.write_text(f'kernels = ["all.tm"]\nepoch = "2020-01-01T00:00:00"\n{scene.read_text()}\n[[body]]\nname = "mesh"\nshape = "mesh"\nfile = "mesh.obj"\n')
    checks.run("batch", "plan", assets, "--frames", "1", "--out", folder / "listing")
    planned = json.loads((folder / "listing" / "plan.json").read_text())
    checks.check("files of the scene", sorted(pathlib.Path(asset["file"]).name for asset in planned["assets"]),
                 ["all.tm", "mesh.mtl", "mesh.obj", "radii.tpc", "stars.csv"])
    if traceable:
        subprocess.run(["strace", "-f", "-e", "trace=open,openat", "-o", folder / "trace", obscura, "render", assets, "-o",
                        folder / "traced.exr"], capture_output=True, timeout=PATIENCE_S)
        opened = set(re.findall(rf'"({folder}/scene/[^"]+)", O_RDONLY[^)]*\) = \d', (folder / "trace").read_text()))
        opened = {str(pathlib.Path(name).resolve()) for name in opened if pathlib.Path(name).is_file()}
        checks.check("files that obscura render opens", opened,
                     {planned["scene"]["file"], *(asset["file"] for asset in planned["assets"])})

    # SIGTERM during a frame: exit 75, and the frame in progress leaves nothing.
    for stop in (signal.SIGTERM, signal.SIGINT):
        slow = folder / stop.name
        checks.run("batch", "plan", scene, "--frames", "3", "--out", slow, "--samples", "60000")
        started = subprocess.Popen([obscura, "batch", "run", slow, "--threads", "1"], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True)
        end = time.monotonic() + PATIENCE_S
        while not (slow / "shards/00000").exists() and time.monotonic() < end:
            time.sleep(0.01)
        started.send_signal(stop)
        _, errors = started.communicate(timeout=PATIENCE_S)
        checks.check(f"{stop.name}: exit status", started.returncode, 75)
        checks.check(f"{stop.name}: one line", errors.count("\n"), 1)
        checks.check(f"{stop.name}: the frame in progress leaves nothing", len([*(slow / "shards/00000").glob("*.tmp*")]), 0)

    # A full disk, by a limit on the size of files: wherever a write fails, one line and no frame.
    size = (whole / "shards/00000/frame_000001.exr").stat().st_size
    full = folder / "full"
    plan(full)
    for limit in sorted({0, 1, 100, size // 2, *range(size - 40, size, 5), size - 1}):
        done = run(full, preexec=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        check_refused(f"at most {limit} bytes a file", done, 74, "cannot be written: File too large")
        left = [p.name for p in full.glob("shards/*/*")]
        checks.check(f"at most {limit} bytes a file: nothing is left", left, [])
    (full / "shards/00000/shard.jsonl").write_text("\n" * (size + 20))
    done = run(full, preexec=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size + 40, size + 40)))
    check_refused("no room for a record", done, 74, "shard.jsonl: cannot be written")
    checks.check("the next run ends well", run(full).returncode, 0)
    check_complete("full disk", full)
    small = folder / "small"
    small.mkdir()
    mounted = os.geteuid() == 0 and subprocess.run(["mount", "-t", "tmpfs", "-o", "size=24k", "none", small],
                                                   capture_output=True).returncode == 0
    if mounted:
        try:
            plan(small)
            done = run(small)
            check_refused("a full file system", done, 74, "cannot be written: No space left on device")
            checks.check("a full file system: what has its name is whole",
                         {k: v for k, v in hashes(small).items() if undisturbed[k] != v}, {})
            subprocess.run(["mount", "-o", "remount,size=1m", small], check=True)
            checks.check("a file system with room again", run(small).returncode, 0)
            check_complete("a full file system", small)
        finally:
            subprocess.run(["umount", small], check=True)
    else:
        print("skipped: a full file system needs the right to mount one")

    # Two runners of one shard.
    both = folder / "both"
    plan(both)
    started = [subprocess.Popen([obscura, "batch", "run", both, "--threads", "1"], stdout=subprocess.DEVNULL)
               for _ in range(2)]
    checks.check("two runners end well", [p.wait(timeout=PATIENCE_S) for p in started], [0, 0])
    check_complete("two runners", both)

    # A frame that was damaged, truncated or removed, and a record that was cut short.
    frame = both / "shards/00001/frame_000005.exr"
    for what, damage in (("damaged", lambda: frame.write_bytes(bytes([frame.read_bytes()[0] ^ 1]) + frame.read_bytes()[1:])),
                         ("truncated", lambda: os.truncate(frame, 100)), ("removed", frame.unlink)):
        damage()
        checks.check(f"a {what} frame is found", str(frame) in checks.run("batch", "verify", both, status=1), True)
        checks.run("batch", "run", both, "--shard", "1")
        check_complete(f"a {what} frame", both)
    lines = both / "shards/00001/shard.jsonl"
    os.truncate(lines, lines.stat().st_size - 20)
    checks.run("batch", "run", both, "--shard", "0-2")
    check_complete("a record cut short", both)

    # Scene and assets are those of the plan.
    moved = folder / "moved"
    shutil.copytree(folder / "scene", moved)
    batch = folder / "assets"
    checks.run("batch", "plan", moved / "scene.toml", "--frames", "4", "--shard", "2", "--out", batch, *RENDER)
    checks.run("batch", "run", batch, "--shard", "0")
    with open(moved / "stars.csv", "a", encoding="utf-8") as stars:
        stars.write("2,2,3\n")
    check_refused("a changed asset", run(batch), 66, str(moved / "stars.csv"), "changed since the batch was planned")
    checks.check_refused(["batch", "verify", batch, "--inputs"], 66, "changed since the batch was planned")
    (moved / "stars.csv").unlink()
    check_refused("a missing asset", run(batch), 66, str(moved / "stars.csv"), "No such file")
    shutil.copy(folder / "scene" / "stars.csv", moved)
    (moved / "scene.toml").write_text((moved / "scene.toml").read_text() + "\n")
    check_refused("a changed scene", run(batch), 66, str(moved / "scene.toml"), "changed since the batch was planned")
    checks.check("nothing was rendered meanwhile", len(hashes(batch)), 2)
    checks.run("batch", "run", batch, "--shard", "0")  # nothing is missing: the scene is not looked at

    # Bad plans.
    good = json.loads((whole / "plan.json").read_text())
    bad = folder / "bad"
    bad.mkdir()
    checks.check_refused(["batch", "run", bad], 66, "plan.json: cannot be opened: No such file or directory")
    for change, words in (({"version": "0.0.1"}, "made by Obscura 0.0.1, this is"),
                          ({"format_version": 9}, "format_version: 9: allowed is 1"),
                          ({"scene": dict(good["scene"], file=str(folder / "scene/../scene/scene.toml"))}, 'without "." and'),
                          ({"scene": dict(good["scene"], file="/a\0b")}, "has a NUL character"),
                          ({"frames": {"first": 1, "last": 10**9}}, "frames.last: 1000000000: allowed is"),
                          ({"render": dict(good["render"], window="9,9,9x9")}, "--window")):
        (bad / "plan.json").write_text(json.dumps({**good, **change}))
        done = run(bad)
        checks.check(f"{change}: refused", done.returncode in (64, 66), True)
        check_refused(f"{change}", done, done.returncode, words, str(bad / "plan.json"))
    (bad / "plan.json").write_text(json.dumps(good)[:200])
    checks.check_refused(["batch", "status", bad], 66, "plan.json:1:201: not valid JSON")
    for words, message in ((["plan", scene, "--out", bad], "--frames is missing"),
                           (["plan", scene, "--frames", "7:7", "--out", bad], "allowed is A:B with A < B"),
                           (["plan", scene, "--frames", "a", "--out", bad], "allowed is A:B with A < B"),
                           (["plan", scene, "--frames", "9", "--trajectory", "--out", bad], "trajectory has 1 samples"),
                           (["run", whole, "--shard", "3"], "allowed are numbers from 0 to 2"),
                           (["submit", whole], "allowed is one of --slurm and --parallel")):
        checks.check_refused(["batch", *words], 64, message)

    # Commands: an sbatch of our own that does what Slurm does with a job of an array.
    jobs = folder / "jobs"
    plan(jobs)
    command = checks.run("batch", "submit", jobs, "--slurm", "--dry-run", "--with=--time=1:00:00")
    checks.check("a dry run submits nothing", (command.count("\n"), "--array=0-2 " in command, hashes(jobs)), (1, True, {}))
    (folder / "bin").mkdir()
    (folder / "bin" / "sbatch").write_text("""#!/bin/sh
for word; do case "$word" in --wrap=*) job=${word#--wrap=} ;; esac; done
for SLURM_ARRAY_TASK_ID in 0 1 2; do export SLURM_ARRAY_TASK_ID; sh -c "$job" || exit; done
""")
    (folder / "bin" / "sbatch").chmod(0o755)
    path = dict(os.environ, PATH=f"{folder / 'bin'}:{os.environ['PATH']}")
    done = subprocess.run([obscura, "batch", "submit", jobs, "--slurm"], capture_output=True, text=True, env=path)
    checks.check(f"jobs of an array ({done.stderr})", done.returncode, 0)
    check_complete("jobs of an array", jobs)
    checks.check("nothing is left to submit", checks.run("batch", "submit", jobs, "--slurm"), "every frame is done\n")
    if shutil.which("parallel") and "GNU" in subprocess.run(["parallel", "--version"], capture_output=True, text=True).stdout:
        batch = folder / "parallel batch"
        plan(batch)
        checks.run("batch", "submit", batch, "--parallel", "--jobs", "2")
        check_complete("GNU parallel", batch)
    else:
        print("skipped: GNU parallel is not installed")

checks.end()
