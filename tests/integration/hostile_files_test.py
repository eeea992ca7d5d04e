#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Files that nobody wants: names that cannot be opened, contents that a terminal would obey, disks that are full. A verb
says one line and never "internal error" (70), and replaces no file by one that it cannot read again.

Usage: hostile_files_test.py OBSCURA
Exit status 1 if a check failed.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

obscura = sys.argv[1]
failures = []
HANG_S = 120


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def run(*words, **options):
    options.setdefault("stdin", subprocess.DEVNULL)
    return subprocess.run([obscura, *map(str, words)], cwd=folder, stdout=options.pop("stdout", subprocess.PIPE),
                          stderr=subprocess.PIPE, timeout=HANG_S, **options)


with tempfile.TemporaryDirectory(prefix="obscura-hostile-") as name:
    folder = pathlib.Path(name)
    (folder / "loop").symlink_to("loop")
    (folder / "file").write_text("no folder")
    # Verbs that wait for daemons, cameras or the terminal would wait here too: they get no input file.
    verbs = re.findall(r"^  ([a-z]+(?: [a-z-]+)?)  ", run("--help").stdout.decode(), re.MULTILINE)
    check("the help lists the verbs", len(verbs) > 30, verbs)
    for verb in verbs:
        text = run(*verb.split(), "--help").stdout.decode()
        takes_output = "--output" in text
        positional = re.search(r"^Usage: obscura " + verb + r"((?: [A-Z_.\[\]]+)+)", text, re.MULTILINE)
        for odd in ("loop/x", "a" * 300, "file/x"):
            tries = [[odd]] if positional else []
            if takes_output and verb not in ("grab", "frame", "serve", "monitor", "events", "timing"):
                tries.append((["demo"] if positional else []) + ["--output", odd])
            for words in tries:
                if verb in ("serve", "new scene", "new camera"):
                    continue
                try:
                    done = run(*verb.split(), *words)
                except subprocess.TimeoutExpired:
                    check(f"obscura {verb} {words[0][:10]} ends", False)
                    continue
                check(f"obscura {verb} {' '.join(words)[:40]} is no bug", done.returncode != 70, done.stderr[-300:])

    (folder / "stars.csv").write_text("ra_deg,dec_deg,v_mag,b_v,spectral_type\n1,1,1,0,A0\n\033]0;title\007\033[31m9x,2,1,0,A0\n")
    told = run("import", "stars", "stars.csv", "-o", "stars.obstars").stderr
    check("what a terminal would obey is escaped", b"\033" not in told and b"\\x1B]0;title\\x07" in told, told)

    # A quaternion that is none: the kernel that was there stays. Values in hexadecimal with an exponent of 16.
    (folder / "bad.xc").write_text("\n".join([
        "DAFETF NAIF DAF ENCODED TRANSFER FILE", "'DAF/CK  '", "'2'", "'6'", "' < bad >" + " " * 51 + "'", "BEGIN_ARRAY 1 13",
        "'bad" + " " * 37 + "'", "'1^3'", "'2^3'", "'-17ED0'", "'1'", "'3'", "'0'", "13",
        *["'3^1'", "'0'", "'0'", "'0'"], *["'1^1'", "'0'", "'0'", "'0'"], "'1^3'", "'2^3'", "'1^3'", "'1^1'", "'2^1'",
        "END_ARRAY 1 13", "TOTAL_ARRAYS 1", ""]))
    (folder / "old.bc").write_bytes(b"the kernel that was there")
    done = run("import", "ephemeris", "bad.xc", "-o", "old.bc")
    check("a kernel that cannot be read again is refused by the name of its source",
          done.returncode == 66 and done.stderr.startswith(b"bad.xc: ") and done.stderr.count(b"\n") == 1, done.stderr)
    check("and the one that was there stays", (folder / "old.bc").read_bytes() == b"the kernel that was there")
    check("without a temporary file", not list(folder.glob(".*.tmp")))

    with open("/dev/full", "wb") as full:
        for words in (["--help"], ["sensor", "show", "has2"], ["sensor", "list"], ["render", "--help"]):
            done = run(*words, stdout=full)
            check(f"obscura {' '.join(words)} says that its output is lost",
                  done.returncode == 74 and b"standard output: cannot be written" in done.stderr, (done.returncode, done.stderr))

sys.exit(1 if failures else 0)
