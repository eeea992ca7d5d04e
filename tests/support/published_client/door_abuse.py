# SPDX-License-Identifier: Apache-2.0
"""What no client should send to the door of the published client; each connects to 127.0.0.1:`port` as often as it wants."""
import contextlib
import random
import socket
import struct
import time
import zlib

from . import qt_stream

PATIENCE_S = 120


def _u32(number):
    return struct.pack(">I", number)


def _text(value):
    data = value.encode("utf-16-be")
    return _u32(len(data)) + data


def _value(kind, payload=b""):
    return _u32(kind) + b"\0" + payload


def _field(payload):
    return _u32(1) + _text("x") + payload


def _message(name, /, **fields):
    return b"".join(qt_stream.message(name, fields))


MOVE = _message("setObjectPosition", object_name="ball", pos=[1.0, 2.0, 3.0])
# Streams that cannot be read on.
BROKEN = {
    "a count of 2^32-1": _u32(0xFFFFFFFF),
    "a list of 2^32-1 values": _field(_value(qt_stream.LIST, _u32(0xFFFFFFFF))),
    "bytes of 2^32-2": _field(_value(qt_stream.BYTES, _u32(0xFFFFFFFE))),
    "a string of 2^32-2 bytes": _u32(1) + _u32(0xFFFFFFFE),
    "nesting of 100,000": _field(_value(qt_stream.LIST, _u32(1)) * 100_000),
    "an odd string": _u32(1) + _u32(3) + b"abc",
    "a lone surrogate": _field(_value(qt_stream.STRING, _u32(2) + b"\xd8\x00")),
    "an unknown type": _field(_value(38, b"\0" * 8)),
}


def values(count):
    """A message with a list of so many values."""
    return _u32(2) + _u32(qt_stream.EMPTY) + _value(qt_stream.STRING, _text("setMetadata")) + _text("value") + \
        _value(qt_stream.LIST, _u32(count)) + _value(qt_stream.INVALID) * count


def zeros_packed(blocks):
    """So many times 16 MiB of zeros, compressed as textures are sent: a block that is compressed once, and repeated."""
    packed = zlib.compressobj(9)
    start = packed.compress(bytes(1 << 24)) + packed.flush(zlib.Z_FULL_FLUSH)
    adler = (blocks << 24) % 65521 << 16 | 1
    data = start[:2] + start[2:] * blocks + b"\x03\x00" + _u32(adler)
    return _u32(len(data)) + data


def connect(port):
    return socket.create_connection(("127.0.0.1", port), PATIENCE_S)


def tell(port, data):
    """Sends `data`, and returns what comes until the server ends the connection."""
    got = b""
    with contextlib.suppress(ConnectionError), connect(port) as client:
        client.sendall(data)
        while part := client.recv(1 << 16):
            got += part
    return got


def reset(port, data):
    """Sends `data` and resets the connection."""
    with contextlib.suppress(OSError), connect(port) as client:
        client.sendall(data)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def cuts(port):
    """A message that ends after any byte."""
    for end in range(len(MOVE)):
        with contextlib.suppress(OSError), connect(port) as client:
            client.sendall(MOVE[:end])
            client.shutdown(socket.SHUT_WR)
            while client.recv(1 << 16):
                pass


def resets(port, count):
    """Connections that are reset in the middle of a picture."""
    dice = random.Random(2)
    for _ in range(count):
        reset(port, _message("render") + MOVE[:dice.randrange(len(MOVE))])


def noise(port, count):
    """Random bytes, half of them such as messages are made of."""
    dice = random.Random(5)
    for _ in range(count):
        words = [_u32(dice.choice([0, 1, 2, 3, 9, 10, 12, 28, 4, 0xFFFFFFFF])) for _ in range(30)]
        reset(port, b"".join(dice.choice([word, b"\0"]) for word in words))
        reset(port, dice.randbytes(dice.randrange(1, 5000)))


def slow(port, count, pause_s):
    """So many connections that send a byte now and then."""
    with contextlib.ExitStack() as stack:
        clients = []
        for _ in range(count):
            with contextlib.suppress(OSError):
                clients.append(stack.enter_context(connect(port)))
        for byte in range(20):
            for client in clients:
                with contextlib.suppress(OSError):
                    client.sendall(MOVE[byte:byte + 1])
            time.sleep(pause_s)


def many(port, count):
    """So many connections at once, as far as the server lets them in."""
    with contextlib.ExitStack() as stack:
        for _ in range(count):
            with contextlib.suppress(OSError):
                stack.enter_context(connect(port))
