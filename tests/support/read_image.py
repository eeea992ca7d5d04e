#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An independent reader of PNG, FITS and OpenEXR files, written from the format specifications.

    read_image.py FILE EXPECTED [KEY=TEXT]...

Compares every sample of FILE with the little-endian words of EXPECTED (16-bit for PNG and 16-bit FITS, float32
for float FITS and OpenEXR; planes or channels (in alphabetical order) one behind the other) and header values with
KEY=TEXT. Says what differs and exits 1.
"""
import struct
import sys
import zlib


def read_png(data):
    assert data[:8] == b"\x89PNG\r\n\x1a\n", "signature"
    at, idat, header, width, height, depth = 8, b"", {}, 0, 0, 0
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        crc, = struct.unpack(">I", data[at + 8 + size:at + 12 + size])
        assert crc == zlib.crc32(kind + body), "CRC of %r" % kind
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", body)
            assert (depth, colour, interlace) == (16, 0, 0), "IHDR"
        elif kind == b"tEXt":
            key, text = body.split(b"\0", 1)
            header[key.decode()] = text.decode("latin-1")
        elif kind == b"sBIT":
            header["sBIT"] = str(body[0])
        elif kind == b"IDAT":
            idat += body
        at += size + 12
    raw, stride, bpp = zlib.decompress(idat), width * 2, 2
    rows, previous = [], bytearray(stride)
    for y in range(height):
        line = bytearray(raw[y * (stride + 1):(y + 1) * (stride + 1)])
        kind, row = line[0], line[1:]
        for i in range(stride):
            a = row[i - bpp] if i >= bpp else 0
            b, c = previous[i], previous[i - bpp] if i >= bpp else 0
            p = a + b - c
            paeth = min((a, b, c), key=lambda v: abs(p - v))
            row[i] = (row[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        rows.append(bytes(row))
        previous = row
    return struct.unpack(">%dH" % (width * height), b"".join(rows)), "H", header


def read_fits(data):
    header, at, end = {}, 0, False
    while not end:
        block = data[at:at + 2880].decode("ascii")
        at += 2880
        for i in range(0, 2880, 80):
            card = block[i:i + 80]
            key = card[:8].strip()
            end = end or key == "END"
            if card[8:10] == "= ":
                value = card[10:]
                header[key] = (value[value.index("'") + 1:value.rindex("'")].rstrip() if value.lstrip().startswith("'")
                               else value.split("/")[0].strip())
    count = 1
    for axis in range(int(header["NAXIS"])):
        count *= int(header["NAXIS%d" % (axis + 1)])
    if header["BITPIX"] == "16":
        values = struct.unpack(">%dh" % count, data[at:at + 2 * count])
        zero = int(float(header["BZERO"]))
        return tuple(v + zero for v in values), "H", header
    assert header["BITPIX"] == "-32", "BITPIX"
    return struct.unpack(">%df" % count, data[at:at + 4 * count]), "f", header


def read_exr(data):
    magic, version = struct.unpack("<II", data[:8])
    assert magic == 20000630 and version & 0xff == 2 and version >> 9 & 1 == 0, "not a scan line file"
    at, header, channels, window = 8, {}, [], None

    def text(at):
        end = data.index(b"\0", at)
        return data[at:end].decode(), end + 1

    while data[at] != 0:
        name, at = text(at)
        kind, at = text(at)
        size, = struct.unpack("<I", data[at:at + 4])
        body = data[at + 4:at + 4 + size]
        at += 4 + size
        if kind == "string":
            header[name] = body.decode()
        elif kind == "double":
            header[name] = repr(struct.unpack("<d", body)[0])
        elif name == "compression":
            assert body[0] == 3, "ZIP wanted"
        elif name == "dataWindow":
            window = struct.unpack("<4i", body)
        elif name == "channels":
            i = 0
            while body[i] != 0:
                end = body.index(b"\0", i)
                channels.append(body[i:end].decode())
                assert struct.unpack("<I", body[end + 1:end + 5])[0] == 2, "float wanted"
                i = end + 17
    at += 1
    width, height = window[2] - window[0] + 1, window[3] - window[1] + 1
    blocks = (height + 15) // 16
    planes = {name: [None] * height for name in channels}
    for offset in struct.unpack("<%dQ" % blocks, data[at:at + 8 * blocks]):
        first, size = struct.unpack("<iI", data[offset:offset + 8])
        rows = min(16, height - first)
        packed, length = data[offset + 8:offset + 8 + size], rows * len(channels) * width * 4
        if size < length:
            packed = bytearray(zlib.decompress(packed))
            for i in range(1, length):
                packed[i] = (packed[i - 1] + packed[i] - 128) & 255
            half = (length + 1) // 2
            block = bytearray(length)
            block[0::2], block[1::2] = packed[:half], packed[half:]
        else:
            block = packed
        i = 0
        for y in range(first, first + rows):
            for name in channels:
                planes[name][y] = struct.unpack("<%df" % width, bytes(block[i:i + 4 * width]))
                i += 4 * width
    # Y repeats the only band, under the name that other programs know.
    bands = [name for name in channels if name.startswith("irradiance.")]
    if "Y" in channels and bands:
        assert planes["Y"] == planes[bands[0]] and len(bands) == 1, "Y is not the band"
        channels.remove("Y")
    return tuple(v for name in sorted(channels) for row in planes[name] for v in row), "f", header


def main():
    file, expected, wanted = sys.argv[1], sys.argv[2], sys.argv[3:]
    with open(file, "rb") as image, open(expected, "rb") as raw:
        data, reference = image.read(), raw.read()
    reader = {b"\x89PNG": read_png, b"SIMP": read_fits, b"v/1\x01": read_exr}[data[:4]]
    values, kind, header = reader(data)
    reference = struct.unpack("<%d%s" % (len(reference) // struct.calcsize(kind), kind), reference)
    if len(values) != len(reference):
        sys.exit("%d samples, %d expected" % (len(values), len(reference)))
    for i, (a, b) in enumerate(zip(values, reference)):
        if a != b:
            sys.exit("sample %d is %r, expected %r" % (i, a, b))
    for pair in wanted:
        key, text = pair.split("=", 1)
        if header.get(key) != text:
            sys.exit("%s is %r, expected %r" % (key, header.get(key), text))


if __name__ == "__main__":
    main()
