#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the manual pages and the completion from the programs that were built, and reads them with other programs:
man for the pages, bash for the completion.

Usage: manual_test.py MAKER CONFIG OBSCURA OBSCURAD OBSCURA-INSTRUMENT OBSCURA-STIMULATOR-SIM OBSCURA-WEB
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

maker, config, obscura, obscurad, instrument, simulator, web = sys.argv[1:8]
complaints = []


def make(*arguments):
    return subprocess.run([sys.executable, maker, *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout


def complete(script, *words):
    """What bash offers after `words`, the last of which is being typed."""
    lines = [
        "compopt() { :; }",
        f"source {script}",
        "COMP_WORDS=(" + " ".join(f"'{word}'" for word in words) + f") COMP_CWORD={len(words) - 1}",
        "_" + words[0].replace("-", "_"),
        'printf "%s\\n" "${COMPREPLY[@]}"',
    ]
    result = subprocess.run(["bash", "--norc", "-ec", "\n".join(lines)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return result.stdout.split()


# As they are listed at the top of --help: a word or two, then two blanks or the column's end and what it does.
listed = subprocess.run([obscura, "--help"], check=True, stdout=subprocess.PIPE, text=True).stdout.split("\nVerbs:\n")[1].split("\n\n")[0].splitlines()
width = min(len(re.match(r"  (\S+ ?\S* *)  ", line)[1]) for line in listed if re.match(r"  \S+( \S+)? {2,}", line))
verbs = [line[2:2 + width].strip() for line in listed]
pages = {
    "obscura.1": (make("man", obscura, "1"), [f"obscura {verb}" for verb in verbs] + ["--samples N", "--watch [SECONDS]", "--copy DIR", "obscurad.toml(5)"]),
    "obscura-instrument.1": (make("man", instrument, "1"), ["--lxi"]),
    "obscura-stimulator-sim.1": (make("man", simulator, "1"), []),
    "obscurad.8": (make("man", obscurad, "8"), ["--check", "--print-config"]),
    "obscura-web.8": (make("man", web, "8"), ["--new-token", "--tls-certificate"]),
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
        file.write("".join(make("completion", program) for program in (obscura, obscurad, instrument, web)))
    for words, wanted in [
        (("obscura", "re"), ["render", "release"]),
        (("obscura", "render", "--sa"), ["--samples"]),
        (("obscura", "render", "--samples", ""), []),
        (("obscurad", "--che"), ["--check"]),
        (("obscura-web", "--new"), ["--new-token"]),
        (("obscura-web", "--role", ""), ["viewer", "operator", "admin"]),
        (("obscura-instrument", "--lx"), ["--lxi"]),
        (("obscura", "scene", "sh"), ["show"]),
        (("obscura", "scene", "show", "--sock"), ["--socket"]),
        (("obscura", "fault", ""), ["list", "add", "clear"]),
        (("obscura", "clea"), []),
        (("obscura", "status", "--w"), ["--watch"]),
        (("obscura", "new", "came"), ["camera"]),
        (("obscura", "examples", "locks"), ["lockstep"]),
        (("obscura", "examples", "--co"), ["--copy"]),
    ]:
        if complete(script, *words) != wanted:
            complaints.append(f"completion of {words}: {complete(script, *words)}, wanted {wanted}")
    offered = complete(script, "obscura", "")
    for verb in verbs:
        if verb.split()[0] not in offered:
            complaints.append(f"completion does not offer '{verb}'")
    if len(verbs) < 40:
        complaints.append(f"only {len(verbs)} verbs are listed: {verbs}")

print("\n".join(complaints) or "manual and completion are good")
sys.exit(1 if complaints else 0)
