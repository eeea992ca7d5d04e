#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs docs/first-hour.md: its sh blocks in one shell, line by line, as a reader would. Every command succeeds, prints the
lines of the text block below it, and makes the pictures of the page.

In text blocks … stands for anything, a number with a decimal point for any number. A picture's title is the file that the
reader has; what the camera makes differs by its noise.
Usage: first_hour_test.py OBSCURA OBSCURAD SOURCE [--update]     with --update the page's pictures are written anew
"""
import pathlib
import re
import shutil
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import transcript  # noqa: E402

obscura, obscurad, source = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
update = "--update" in sys.argv
page = source / "docs/first-hour.md"
text = page.read_text()
failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def commands_of(block):
    """Lines of a block, those of a here-document or of a continued line as one."""
    commands, lines = [], iter(block.splitlines())
    for line in lines:
        command, end = line, re.search(r"<<'(\w+)'", line)
        while command.endswith("\\"):
            command += "\n" + next(lines)
        if end:
            for more in lines:
                command += "\n" + more
                if more == end[1]:
                    break
        commands.append(command)
    return commands


def pixels(file):
    """Width, height and values of an 8-bit PNG, grey or in colour."""
    import struct
    import zlib
    data, at, packed = file.read_bytes(), 8, b""
    width, height, depth, colour = struct.unpack(">IIBB", data[16:26])
    if depth != 8 or colour not in (0, 2):
        raise ValueError(f"{file}: {depth} bits, colour type {colour}: not 8-bit grey or colour")
    samples = 3 if colour == 2 else 1
    stride = width * samples
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        packed += data[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    raw, rows = zlib.decompress(packed), [[0] * stride]
    for y in range(height):
        kind, line = raw[y * (stride + 1)], list(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        above = rows[-1]
        for x in range(stride):
            left, up, corner = (line[x - samples] if x >= samples else 0), above[x], (above[x - samples] if x >= samples else 0)
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda v: abs(guess - v))
            line[x] = (line[x] + (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        rows.append(line)
    return width, height, [value for row in rows[1:] for value in row]


blocks = [(kind, body) for kind, body in re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL) if kind in ("sh", "text")]
check("the page has blocks of commands and of what they print", sum(kind == "sh" for kind, _ in blocks) >= 9 and blocks[0][0] == "sh")
commands, belongs = [], []  # and the number of the block of each
for number, (kind, body) in enumerate(blocks):
    if kind == "sh":
        for command in commands_of(body):
            commands.append(command)
            belongs.append(number)

with tempfile.TemporaryDirectory(prefix="obscura-first-hour-") as temporary:
    work, tools = pathlib.Path(temporary) / "work", pathlib.Path(temporary) / "tools"
    work.mkdir()
    tools.mkdir()
    results = transcript.Shell(obscura, obscurad, work, tools).run(commands, timeout_s=900)
    check("all commands are run", len(results) == len(commands), f"{len(results)} of {len(commands)}")
    said = {}
    for command, number, (output, status) in zip(commands, belongs, results):
        check(f"$ {command.splitlines()[0]}", status == 0, f"status {status}\n{output}")
        said[number] = said.get(number, "") + "\n" + output
    for number, (kind, body) in enumerate(blocks):
        if kind == "text":
            missing = transcript.missing_lines(body.splitlines(), said.get(number - 1, ""), loose_numbers=True)
            check(f"prints: {body.splitlines()[0]}", not missing, f"not found: {missing}\n{said.get(number - 1, '')}")

    folder = work / "first-hour"
    pictures = re.findall(r'^!\[[^\]]+\]\((first-hour/\S+) "(\S+)"\)$', text, re.MULTILINE)
    check("the page has pictures", len(pictures) >= 5, pictures)
    shown = {name for name, _ in pictures}
    check("all of the folder's", {f"first-hour/{file.name}" for file in (page.parent / "first-hour").iterdir()} == shown or update)
    for name, made in pictures:
        if not (folder / made).is_file():
            check(f"{made} is made", False)
            continue
        kept = page.parent / name
        if update:
            shutil.copy(folder / made, kept)
        if name.endswith(".svg"):
            check(f"{name} is a picture", kept.read_text().startswith("<svg") and (folder / made).read_text().startswith("<svg"))
            continue
        width, height, before = pixels(kept)
        new_width, new_height, after = pixels(folder / made)
        check(f"{name} has the size of what is made", (width, height) == (new_width, new_height), (width, height, new_width, new_height))
        if len(before) == len(after):
            difference = sum(abs(a - b) for a, b in zip(before, after)) / len(before)
            # Noise of single pixels: 3 at most; another picture: tens.
            check(f"{name} looks like it", difference < 6, f"mean difference of levels {difference:.1f}")
        check(f"{name} is small", kept.stat().st_size < 100_000, kept.stat().st_size)

sys.exit(1 if failures else 0)
