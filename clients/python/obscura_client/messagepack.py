# SPDX-License-Identifier: Apache-2.0
"""MessagePack of message heads: None, bool, int, float, str, list and dict with str keys."""
from __future__ import annotations

import struct
from typing import Any, List, Tuple, Union

import numpy

Buffer = Union[bytes, bytearray, memoryview]
DEEPEST = 16


def pack(value: Any) -> bytes:
    """The value as MessagePack. Arrays and numbers of numpy are taken, too. Raises TypeError for anything else."""
    out: List[bytes] = []
    _pack(value, out, 0)
    return b"".join(out)


def unpack(data: Buffer) -> Any:
    """The one value that `data` holds. Raises ValueError if it is not whole, goes on behind it, or is too deep."""
    try:
        value, at = _unpack(memoryview(data), 0, 0)
    except (IndexError, struct.error, UnicodeDecodeError) as error:
        raise ValueError(f"not MessagePack: {error}") from None
    if at != len(data):
        raise ValueError(f"not MessagePack: {len(data) - at} bytes behind its end")
    return value


def _size(out: List[bytes], count: int, fix: int, fix_most: int, codes: Tuple[int, ...]) -> None:
    """Head of a string, array or map of `count`; `codes`: of 8 (where there is one), 16 and 32 bits."""
    if count <= fix_most:
        out.append(bytes([fix | count]))
        return
    for code, form, most in zip(codes, (">BB", ">BH", ">BI")[3 - len(codes):], (0xFF, 0xFFFF, 0xFFFFFFFF)[3 - len(codes):]):
        if count <= most:
            out.append(struct.pack(form, code, count))
            return
    raise ValueError(f"{count} elements or bytes are too many")


def _pack(value: Any, out: List[bytes], depth: int) -> None:
    if depth > DEEPEST:
        raise ValueError(f"more than {DEEPEST} levels")
    if isinstance(value, (numpy.ndarray, numpy.generic)):
        value = value.tolist()
    if value is None:
        out.append(b"\xc0")
    elif isinstance(value, bool):
        out.append(b"\xc3" if value else b"\xc2")
    elif isinstance(value, int):
        out.append(bytes([value]) if 0 <= value < 128 else struct.pack(">Bq", 0xD3, value))
    elif isinstance(value, float):
        out.append(struct.pack(">Bd", 0xCB, value))
    elif isinstance(value, str):
        data = value.encode()
        _size(out, len(data), 0xA0, 31, (0xD9, 0xDA, 0xDB))
        out.append(data)
    elif isinstance(value, (list, tuple)):
        _size(out, len(value), 0x90, 15, (0xDC, 0xDD))
        for item in value:
            _pack(item, out, depth + 1)
    elif isinstance(value, dict):
        _size(out, len(value), 0x80, 15, (0xDE, 0xDF))
        for key, item in value.items():
            if not isinstance(key, str):
                raise TypeError(f"the key {key!r} is no string")
            _pack(key, out, depth + 1)
            _pack(item, out, depth + 1)
    else:
        raise TypeError(f"{type(value).__name__} cannot be sent")


# Numbers by their first byte: format and bytes.
_NUMBERS = {0xCA: (">f", 4), 0xCB: (">d", 8), 0xCC: (">B", 1), 0xCD: (">H", 2), 0xCE: (">I", 4), 0xCF: (">Q", 8),
            0xD0: (">b", 1), 0xD1: (">h", 2), 0xD2: (">i", 4), 0xD3: (">q", 8)}
# Strings, arrays and maps: kind and format of the count.
_SIZED = {0xD9: ("str", ">B", 1), 0xDA: ("str", ">H", 2), 0xDB: ("str", ">I", 4), 0xDC: ("list", ">H", 2),
          0xDD: ("list", ">I", 4), 0xDE: ("dict", ">H", 2), 0xDF: ("dict", ">I", 4)}
_WORDS = {0xC0: None, 0xC2: False, 0xC3: True}


def _unpack(data: memoryview, at: int, depth: int) -> Tuple[Any, int]:
    if depth > DEEPEST:
        raise ValueError(f"not MessagePack: more than {DEEPEST} levels")
    code = data[at]
    at += 1
    if code < 0x80:
        return code, at
    if code >= 0xE0:
        return code - 256, at
    if code in _WORDS:
        return _WORDS[code], at
    if code in _NUMBERS:
        form, size = _NUMBERS[code]
        return struct.unpack_from(form, data, at)[0], at + size
    if code in _SIZED:
        kind, form, size = _SIZED[code]
        count = struct.unpack_from(form, data, at)[0]
        at += size
    elif code < 0x90:
        kind, count = "dict", code & 15
    elif code < 0xA0:
        kind, count = "list", code & 15
    elif code < 0xC0:
        kind, count = "str", code & 31
    else:
        raise ValueError(f"not MessagePack of a head: code {code:#x}")
    if kind == "str":
        if count > len(data) - at:
            raise IndexError("a string ends early")
        return str(data[at:at + count], "utf-8"), at + count
    if kind == "list":
        items = []
        for _ in range(count):
            item, at = _unpack(data, at, depth + 1)
            items.append(item)
        return items, at
    members = {}
    for _ in range(count):
        key, at = _unpack(data, at, depth + 1)
        if not isinstance(key, str):
            raise ValueError("not MessagePack of a head: a key that is no string")
        members[key], at = _unpack(data, at, depth + 1)
    return members, at
