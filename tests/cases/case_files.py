# SPDX-License-Identifier: Apache-2.0
"""Files of the case studies: the data folder, FITS images and headers, PNG pictures. Needs numpy."""
import os
import pathlib
import struct
import subprocess
import sys
import zlib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
SKIP = 77  # exit status where data or programs are missing


def skip(why):
    print(f"skipped: {why}")
    sys.exit(SKIP)


def data_file(relative):
    """A file of OBSCURA_DATA (default ../shared/data); where it is missing the case says so and ends."""
    file = pathlib.Path(os.environ.get("OBSCURA_DATA", ROOT / "../shared/data")).resolve() / relative
    if not file.exists():
        skip(f"{file} is not there: the case needs it and no copy of it is in the project (OBSCURA_DATA names its folder)")
    return file


def run(obscura, *arguments):
    done = subprocess.run([obscura, *map(str, arguments)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"obscura {' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done.stdout


def renderer(obscura, folder):
    """Function render(name, scene text, further arguments) -> images of the FITS file, made in the folder."""

    def render(name, text, *arguments):
        (folder / f"{name}.toml").write_text(text)
        run(obscura, "render", folder / f"{name}.toml", "-o", folder / f"{name}.fits", *arguments)
        return read_fits(folder / f"{name}.fits")[1]

    return render


def read_fits(file):
    """Header of the first unit as a dictionary, and the images of all units by EXTNAME (the first: ''), first row first."""
    data = pathlib.Path(file).read_bytes()
    at, headers, images = 0, [], {}
    kinds = {8: "u1", 16: ">i2", 32: ">i4", 64: ">i8", -32: ">f4", -64: ">f8"}
    while at + 2880 <= len(data):
        header, end = {}, False
        while not end:
            if at + 2880 > len(data):
                sys.exit(f"{file}: a header has no end")
            for i in range(at, at + 2880, 80):
                card = data[i:i + 80].decode("latin-1")
                key, end = card[:8].strip(), end or card.startswith("END     ")
                if card[8:10] != "= ":
                    continue
                text = card[10:].strip()
                if text.startswith("'"):
                    header[key] = text[1:text.index("'", 1)].rstrip()
                else:
                    text = text.split("/")[0].strip()
                    header[key] = text == "T" if text in "TF" else float(text)
            at += 2880
        shape = [int(header[f"NAXIS{k}"]) for k in range(int(header["NAXIS"]), 0, -1)]
        kind = np.dtype(kinds[int(header["BITPIX"])])
        count = int(np.prod(shape)) if shape else 0
        if at + count * kind.itemsize > len(data):
            sys.exit(f"{file}: ends before its data do")
        if count and header.get("XTENSION", "IMAGE") == "IMAGE":
            values = np.frombuffer(data, kind, count, at).astype(float).reshape(shape)
            name = header.get("EXTNAME", "") if headers else ""
            images[name] = values * header.get("BSCALE", 1) + header.get("BZERO", 0)
        at += (count * kind.itemsize + 2879) // 2880 * 2880
        headers.append(header)
    return headers[0], images


def write_fits(file, images):
    """Writes float images: pairs of an array, first row first, and a dictionary of further cards."""
    out = b""
    for index, (values, cards) in enumerate(images):
        values = np.asarray(values, ">f4")
        head = [("SIMPLE", "T")] if index == 0 else [("XTENSION", "'IMAGE   '")]
        head += [("BITPIX", "-32"), ("NAXIS", values.ndim)]
        head += [(f"NAXIS{k + 1}", n) for k, n in enumerate(values.shape[::-1])]
        head += [("PCOUNT", 0), ("GCOUNT", 1)] if index else []
        head += cards.items()
        text = "".join(f"{key:8}= {str(value):>20}".ljust(80) for key, value in head) + "END".ljust(80)
        out += text.ljust((len(text) + 2879) // 2880 * 2880).encode()
        body = values.tobytes()
        out += body.ljust((len(body) + 2879) // 2880 * 2880, b"\0")
    pathlib.Path(file).write_bytes(out)


def grey(values, low, high, gamma=1.0):
    """8-bit grey levels from `low` (black) to `high` (white)."""
    return (255 * np.clip((values - low) / (high - low), 0, 1) ** (1 / gamma) + 0.5).astype(np.uint8)


def beside(*pictures, gap=6):
    """Pictures of the same height in a row, white between them."""
    parts = []
    for picture in pictures:
        if parts:
            parts.append(np.full((picture.shape[0], gap, *picture.shape[2:]), 255, np.uint8))
        parts.append(picture)
    return np.concatenate(parts, axis=1)


def enlarged(picture, times):
    return picture.repeat(times, axis=0).repeat(times, axis=1)


def write_png(file, picture):
    """An 8-bit picture, grey (rows x columns) or colour (rows x columns x 3)."""
    height, width = picture.shape[:2]

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = b"".join(b"\0" + row.tobytes() for row in np.ascontiguousarray(picture, np.uint8))
    header = struct.pack(">IIBBBBB", width, height, 8, 2 if picture.ndim == 3 else 0, 0, 0, 0)
    pathlib.Path(file).write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) +
                                   chunk(b"IEND", b""))
