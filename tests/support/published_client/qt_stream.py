# SPDX-License-Identifier: Apache-2.0
"""Messages of the published client: a hash of names and values in the encoding of Qt's QDataStream, big-endian, nothing in front.

Written from the description of the wire alone, beside the server's own codec: the two must agree.
"""
import struct

INVALID, BOOL, INT, UINT, ULONG, DOUBLE, MAP, LIST, STRING, BYTES, HASH = 0, 1, 2, 3, 5, 6, 8, 9, 10, 12, 28
EMPTY = 0xFFFFFFFF


class Undecodable(Exception):
    """Bytes that are no message."""


def _u32(number):
    return struct.pack(">I", number)


def _string(text):
    data = text.encode("utf-16-be")
    return [_u32(len(data)), data] if data else [_u32(EMPTY)]


def _integer(number):
    if -2**31 <= number < 2**31:
        return INT, [struct.pack(">i", number)]
    if 0 <= number < 2**32:
        return UINT, [_u32(number)]
    if 0 <= number < 2**64:
        return ULONG, [struct.pack(">Q", number)]
    return DOUBLE, [struct.pack(">d", number)]


def _payload(value):
    """(type, scalars)."""
    if value is None:
        return INVALID, []
    if isinstance(value, bool):
        return BOOL, [struct.pack(">B", value)]
    if isinstance(value, int):
        return _integer(value)
    if isinstance(value, float):
        return DOUBLE, [struct.pack(">d", value)]
    if isinstance(value, str):
        return STRING, _string(value)
    if isinstance(value, (bytes, bytearray)):
        return BYTES, [_u32(len(value)), bytes(value)] if value else [_u32(EMPTY)]
    if isinstance(value, dict):
        return HASH, _hash(value)
    scalars = [_u32(len(value))]  # list, tuple, numpy array
    for element in value:
        scalars += _value(element.item() if hasattr(element, "item") and not getattr(element, "shape", ()) else element)
    return LIST, scalars


def _value(value):
    kind, scalars = _payload(value)
    return [_u32(kind), b"\0", *scalars]


def _hash(fields):
    scalars = [_u32(len(fields))]
    for key, value in fields.items():
        scalars += _string(key) + _value(value)
    return scalars


def message(name, fields):
    """A message as its scalars, each of which the published client sends on its own."""
    return _hash({"": name, **fields})


class Reader:
    """Decodes what `receive(bytes)` yields."""

    def __init__(self, receive):
        self._receive, self._buffer, self._at = receive, bytearray(), 0

    def _take(self, count):
        if self._at > 1 << 20:
            del self._buffer[:self._at]
            self._at = 0
        while len(self._buffer) - self._at < count:
            piece = self._receive(1 << 20)
            if not piece:
                raise ConnectionError("the server has ended the connection")
            self._buffer += piece
        self._at += count
        return memoryview(self._buffer)[self._at - count:self._at].tobytes()

    def _scalar(self, letter):
        return struct.unpack(">" + letter, self._take(struct.calcsize(letter)))[0]

    def _bytes(self):
        size = self._scalar("I")
        return b"" if size == EMPTY else self._take(size)

    def _string(self):
        data = self._bytes()
        if len(data) % 2:
            raise Undecodable(f"a string of {len(data)} bytes")
        return data.decode("utf-16-be")

    def _value(self):
        kind, null = self._scalar("I"), self._scalar("B")
        if null:
            raise Undecodable("a value that is null")
        if kind == INVALID:
            return None
        if kind == BOOL:
            return bool(self._scalar("B"))
        if kind in (INT, UINT, ULONG, DOUBLE):
            return self._scalar({INT: "i", UINT: "I", ULONG: "Q", DOUBLE: "d"}[kind])
        if kind in (MAP, HASH):
            return self.read()
        if kind == LIST:
            return [self._value() for _ in range(self._scalar("I"))]
        if kind == STRING:
            return self._string()
        if kind == BYTES:
            return self._bytes()
        raise Undecodable(f"a value of type {kind}")  # the published client reads no other

    def read(self):
        """The next hash."""
        fields = {}
        for _ in range(self._scalar("I")):
            key = self._string()
            if key in fields:
                raise Undecodable(f"the key {key!r} twice")
            fields[key] = self._value()
        return fields
