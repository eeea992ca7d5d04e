# SPDX-License-Identifier: Apache-2.0
"""Runs both programs on a scene file and compares pictures, for validation.py."""
import json
import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: status {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.stdout


def cpu_seconds(pid):
    """Processor time of a living process."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Run:
    """A picture and what it took, without reading meshes and building trees: seconds by the clock and of processor."""

    def __init__(self, file, wall_s, cpu_s, samples):
        self.file, self.wall_s, self.cpu_s, self.samples = file, wall_s, cpu_s, samples


class Programs:
    def __init__(self, obscura, folder, size, threads):
        self.obscura, self.folder, self.size, self.threads = obscura, folder, size, threads
        self.count = 0

    def ours(self, scene, seed, *settings):
        self.count += 1
        file = self.folder / f"ours-{self.count}.fits"
        report = json.loads(run(self.obscura, "render", scene, "-o", file, "--size", f"{self.size}x{self.size}", "--seed",
                                seed, "--threads", self.threads, "--json", *settings))
        return Run(file, report["render_s"], report["render_cpu_s"], report["samples"])

    def cycles(self, scene, bands, samples, seed):
        self.count += 1
        out = self.folder / f"cycles-{self.count}"
        command = ["blender", "-b", "--factory-startup", "-P", ROOT / "tests/bench/cycles_scene.py", "--", scene,
                   ",".join(map(str, bands)), samples, self.size, seed, self.threads, out]
        began = ended = None
        text = ""
        with subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              text=True) as blender:
            for line in blender.stdout:
                text += line
                if "Sample 0/" in line and began is None:
                    began = time.monotonic(), cpu_seconds(blender.pid)
                if "| Finished" in line and ended is None:
                    ended = time.monotonic(), cpu_seconds(blender.pid)
        file = pathlib.Path(f"{out}-{seed}.exr")
        if blender.returncode or began is None or ended is None or not file.exists():
            sys.exit(f"blender rendered nothing:\n{text[-2000:]}")
        return Run(file, ended[0] - began[0], ended[1] - began[1], self.size**2 * samples)

    def compare(self, reference, image, reference_plane, image_plane, *more):
        return json.loads(run(self.obscura, "compare", reference, image, "--reference-plane", reference_plane,
                              "--image-plane", image_plane, "--max-shift", 0, "--no-offset", "--json", *more))

    def noise_percent(self, a, b, plane):
        """Rms deviation of one picture over its rms, from two with different seeds: half of the variance of their
        difference is that of one."""
        return self.compare(a, b, plane, plane)["residual_percent"] / 2**0.5
