#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the manual pages and the completion from the programs that were built, and reads them with other programs:
man for the pages, bash for the completion.

Usage: manual_test.py MAKER OBSCURA OBSCURAD CONFIG
"""
import os
import shutil
import subprocess
import sys
import tempfile

maker, obscura, obscurad, config = sys.argv[1:5]
complaints = []


def make(*arguments):
    return subprocess.run([sys.executable, maker, *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout


def complete(script, *words):
    """What bash offers after `words`, the last of which is being typed."""
    lines = [
        "compopt() { :; }",
        f"source {script}",
        "COMP_WORDS=(" + " ".join(f"'{word}'" for word in words) + f") COMP_CWORD={len(words) - 1}",
        f"_{words[0]}",
        'printf "%s\\n" "${COMPREPLY[@]}"',
    ]
    result = subprocess.run(["bash", "--norc", "-ec", "\n".join(lines)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.stdout.split()


pages = {
    "obscura.1": (make("man", obscura, "1"), ["obscura render", "--samples N", "obscura new", "obscura examples", "--copy DIR", "obscurad.toml(5)"]),
    "obscurad.8": (make("man", obscurad, "8"), ["--check", "--print-config"]),
    "obscurad.toml.5": (make("keys", obscura),
                        ["[sensor.detector]", "full_well_e", "[[gige.faults]]", "burst_packets", "[[camera.window]]",
                         "[trigger.line1]", "[camera.view]", "One of", "Required."]),
}
with tempfile.TemporaryDirectory() as folder:
    for name, (text, wanted) in pages.items():
        path = os.path.join(folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        if os.path.dirname(config) in text:
            complaints.append(f"{name}: names a folder of the build")
        if not shutil.which("man"):
            print("man is not installed: pages made, not read")
            continue
        read = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", path], capture_output=True, text=True,
                              env={**os.environ, "MANPAGER": "cat", "MANWIDTH": "200", "LC_ALL": "C.UTF-8"})
        if read.returncode != 0 or read.stderr:
            complaints.append(f"{name}: {read.stderr}")
        for word in wanted:
            if word not in read.stdout:
                complaints.append(f"{name}: does not say '{word}'")
    script = os.path.join(folder, "completion")
    with open(script, "w", encoding="utf-8") as file:
        file.write(make("completion", obscura, obscurad))
    for words, wanted in [
        (("obscura", "re"), ["render", "release"]),
        (("obscura", "render", "--sa"), ["--samples"]),
        (("obscura", "render", "--samples", ""), []),
        (("obscurad", "--che"), ["--check"]),
        (("obscura", "new", "came"), ["camera"]),
        (("obscura", "examples", "locks"), ["lockstep"]),
        (("obscura", "examples", "--co"), ["--copy"]),
    ]:
        if complete(script, *words) != wanted:
            complaints.append(f"completion of {words}: {complete(script, *words)}, wanted {wanted}")
    if "grab" not in complete(script, "obscura", ""):
        complaints.append("completion does not offer 'grab'")

print("\n".join(complaints) or "manual and completion are good")
sys.exit(1 if complaints else 0)
