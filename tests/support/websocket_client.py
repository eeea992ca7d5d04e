# SPDX-License-Identifier: Apache-2.0
"""A small WebSocket client, written from RFC 6455, with ways to send what the RFC forbids."""
import base64
import hashlib
import json
import os
import select
import socket
import struct

GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Refused(Exception):
    """The answer to the handshake was not 101: `status`, `text`."""

    def __init__(self, status, text):
        super().__init__(f"{status} {text[:200]}")
        self.status, self.text = status, text


class Closed(Exception):
    """The server has ended the connection: `code` of its close frame, None without one."""

    def __init__(self, code=None, why=""):
        super().__init__(f"{code} {why}")
        self.code, self.why = code, why


def frame(payload, opcode=TEXT, final=True, masked=True, key=None):
    """The bytes of one frame of a client."""
    head = bytes([opcode | (0x80 if final else 0)])
    length, mask_bit = len(payload), 0x80 if masked else 0
    if length < 126:
        head += bytes([length | mask_bit])
    elif length < 65536:
        head += bytes([126 | mask_bit]) + struct.pack(">H", length)
    else:
        head += bytes([127 | mask_bit]) + struct.pack(">Q", length)
    if not masked:
        return head + payload
    key = key or os.urandom(4)
    return head + key + bytes(b ^ key[i % 4] for i, b in enumerate(payload))


class WebSocket:
    """A connection after its handshake. Raises Refused, Closed, TimeoutError."""

    def __init__(self, port, path, protocol="obscura.v1", timeout=60, source="127.0.0.1", **headers):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout, (source, 0))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.input = b""
        key = base64.b64encode(os.urandom(16)).decode()
        lines = {"Host": f"localhost:{port}", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": key,
                 "Sec-WebSocket-Version": "13", **({"Sec-WebSocket-Protocol": protocol} if protocol else {}), **headers}
        self.socket.sendall((f"GET {path} HTTP/1.1\r\n" + "".join(f"{k}: {v}\r\n" for k, v in lines.items()) + "\r\n").encode())
        while b"\r\n\r\n" not in self.input:
            self._more()
        head, _, self.input = self.input.partition(b"\r\n\r\n")
        status = int(head.split()[1])
        if status != 101:
            raise Refused(status, head.decode())
        answer = {k.strip().lower(): v.strip() for k, v in (line.split(":", 1) for line in head.decode().split("\r\n")[1:])}
        expected = base64.b64encode(hashlib.sha1((key + GUID).encode()).digest()).decode()
        assert answer["sec-websocket-accept"] == expected, answer
        assert answer.get("sec-websocket-protocol") == protocol, answer

    def _more(self):
        part = self.socket.recv(1 << 20)
        if not part:
            raise Closed()
        self.input += part

    def _take(self, count):
        while len(self.input) < count:
            self._more()
        part, self.input = self.input[:count], self.input[count:]
        return part

    def send(self, payload, opcode=TEXT):
        self.socket.sendall(frame(payload, opcode))

    def send_json(self, message):
        self.send(json.dumps(message).encode())

    def receive(self, timeout=60, tell_pings=False):
        """(opcode, payload) of the next text or binary message; answers pings, and returns them too if they are to be told."""
        self.socket.settimeout(timeout)
        message, kind = b"", None
        while True:
            first, second = self._take(2)
            assert first & 0x70 == 0, "reserved bits"
            assert second & 0x80 == 0, "a server does not mask"
            length = second & 0x7F
            if length == 126:
                length, = struct.unpack(">H", self._take(2))
            elif length == 127:
                length, = struct.unpack(">Q", self._take(8))
            payload, opcode = self._take(length), first & 0x0F
            if opcode == PING:
                self.send(payload, PONG)
                if tell_pings and kind is None:
                    return PING, payload
            elif opcode == CLOSE:
                code = struct.unpack(">H", payload[:2])[0] if payload else None
                raise Closed(code, payload[2:].decode())
            elif opcode != PONG:
                kind = kind or opcode
                message += payload
                if first & 0x80:
                    return kind, message

    def close(self):
        self.socket.close()


HEADER = struct.Struct("<4sHHIIQQqHHHHHBBBxHIHHQq")
NAMES = ("magic version header_bytes camera flags frame trigger edge_tai_ns x y w h bin reduce encoding bits rows skipped width height id made_tai_ns").split()


class Viewer(WebSocket):
    """A client of /api/v1/live that has sent its token."""

    def __init__(self, port, token, **options):
        super().__init__(port, "/api/v1/live", **options)
        self.texts = []
        self.send_json({"token": token})

    def view(self, camera, **fields):
        self.send_json({"view": {"camera": camera, **fields}})

    def ready(self):
        self.send_json({"ready": True})

    def picture(self, timeout=60):
        """(header as a dictionary, pixels as a tuple) of the next picture; texts before it go to `texts`."""
        while not (picture := self._take_message(timeout)):
            pass
        return picture

    def picture_within(self, seconds):
        """The next picture, if messages up to it begin to come within that time each; else None, and nothing of it is lost."""
        while self.input or select.select([self.socket], [], [], seconds)[0]:
            if picture := self._take_message(60, tell_pings=True):
                return picture
        return None

    def _take_message(self, timeout, tell_pings=False):
        kind, message = self.receive(timeout, tell_pings)
        if kind == PING:
            return None
        if kind == TEXT:
            self.texts.append(json.loads(message))
            return None
        header = dict(zip(NAMES, HEADER.unpack_from(message)))
        assert header["magic"] == b"OBSV" and header["version"] == 1 and header["header_bytes"] == HEADER.size == 80, header
        count = -(-header["w"] // header["bin"]) * -(-header["h"] // header["bin"])
        assert len(message) == HEADER.size + 2 * count, (header, len(message))
        return header, struct.unpack_from(f"<{count}H", message, HEADER.size)

    def text(self, kind, timeout=60):
        """The next text of that kind, of those that came before or come; pictures are passed over."""
        while True:
            for i, text in enumerate(self.texts):
                if kind in text:
                    return self.texts.pop(i)[kind]
            opcode, message = self.receive(timeout)
            if opcode == TEXT:
                self.texts.append(json.loads(message))
