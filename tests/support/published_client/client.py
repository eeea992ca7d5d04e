# SPDX-License-Identifier: Apache-2.0
"""Stand-in for the published client, version 8: its 154 commands as methods, and its habits, wise or not.

It sends each scalar on its own (or all together, `separate_sends` = False), does not read the answers of setters, skips whatever
does not bear the name of the command that it waits for, and raises the first line of error that it meets.
"""
import collections
import hashlib
import pathlib
import socket
import zlib

import numpy

from . import qt_stream

Argument = collections.namedtuple("Argument", "name type optional")
Command = collections.namedtuple("Command", "group name arguments results waits")
LEVELS = ("[error]", "[warning]", "[info]", "[debug]")
FILE_PIECE = 1 << 20
# Values a pixel and their type, of pictures.
PICTURES = {"getImage": ("<f4", 4), "getImageRGBA8": ("u1", 4), "getImageGray32F": ("<f4", 1), "getImageGray8": ("u1", 1),
            "getImageSpectrumProjection": ("<f4", 1), "getDepthMap": ("<f8", 1), "getNormalMap": ("<f4", 3),
            "getLOSMap": ("<f4", 3), "getTimeMap": ("<f4", 1)}


def _read_table(file):
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    for line in lines[1:]:
        group, name, arguments, results, waits = line.split("\t")
        yield Command(group, name, [Argument(*word.strip("[]").split(":"), word.startswith("["))
                                    for word in arguments.split() if word != "-"],
                      [word.strip("[]") for word in results.split() if word != "-"], waits)


TABLE = {command.name: command for command in _read_table(pathlib.Path(__file__).with_name("commands.tsv"))}


def pack(data, level):
    """What the client calls compressed: the size of the compressed bytes, and these."""
    packed = zlib.compress(data, level)
    return len(packed).to_bytes(4, "big") + packed


def _doubles(values):
    return [float(value) for value in values]


CONVERSIONS = {"s": str, "d": float, "i": int, "b": bool, "v": _doubles, "v2": lambda rows: [_doubles(row) for row in rows],
               "m44": lambda rows: [_doubles(row) for row in rows], "bytes": bytes, "packed": bytes, "list": list,
               "any": lambda value: value}


class PublishedClient:
    """One connection. `asynchronous` = False: read the answers of setters too. `raises` = False: keep lines of error in `log`
    as any other."""

    def __init__(self, host, port, timeout=120, separate_sends=False):
        self._socket = socket.create_connection((host, port), timeout)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader = qt_stream.Reader(self._socket.recv)
        self.separate_sends, self.asynchronous, self.raises = separate_sends, True, True
        self.log, self.skipped, self.called = [], 0, set()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def send(self, name, fields):
        scalars = qt_stream.message(name, fields)
        if not self.separate_sends:
            scalars = [b"".join(scalars)]
        for scalar in scalars:
            self._socket.sendall(scalar)

    def send_bytes(self, data):
        self._socket.sendall(data)

    def wait(self, name):
        """The next answer of that name, whichever request it belongs to."""
        while True:
            answer = self._reader.read()
            if not answer.get(""):
                self._take_line(answer["data"].decode("utf-8"))
            elif answer[""] == name:
                return answer
            else:
                self.skipped += 1

    def _take_line(self, text):
        self.log.append(text)
        if self.raises and next((level for level in LEVELS if level in text), "") == "[error]":
            raise RuntimeError(text)

    def command(self, name, *values, **named):
        """Sends a command of the table, and gives its result if it is waited for."""
        row = TABLE[name]
        given = dict(zip((argument.name for argument in row.arguments), values), **named)
        fields = {}
        for argument in row.arguments:
            if argument.name in given or not argument.optional:
                fields[argument.name] = CONVERSIONS[argument.type](given.pop(argument.name))
        if given:
            raise TypeError(f"{name} has no argument {', '.join(given)}")
        self.called.add(name)
        self.send(name, fields)
        if row.waits == "never" or (row.waits == "no" and self.asynchronous):
            return None
        return self._result(row, self.wait(name))

    @staticmethod
    def _result(row, answer):
        exact = row.name != "syncDir" and row.group != "removed"
        if set(answer) != {"", *row.results} and exact:
            raise KeyError(f"{row.name}: fields {sorted(answer)}, wanted {row.results}")
        if row.name in PICTURES:
            return _picture(row, answer)
        if row.name == "getPSF":
            return numpy.frombuffer(answer["psf"], "<f4").reshape(answer["height"], answer["width"])
        return answer.get("files2update") if row.name == "syncDir" else answer[row.results[0]] if row.results else None

    def close(self):
        try:
            self.send("close", {})
            self.called.add("close")
        except OSError:
            pass  # the server has ended the connection
        self._socket.close()

    def updateUserDataTexture(self, name, values, level=-1):
        """`values`: a numpy array of float32 or uint8."""
        return self.command("updateUserDataTexture", name, pack(values.tobytes(), level))

    def sendFile(self, filename, data, level=0):
        """In pieces of 1 MiB, each compressed if `level` is not 0."""
        for offset in range(0, len(data), FILE_PIECE):
            piece = data[offset:offset + FILE_PIECE]
            self.command("sendFile", filename, level != 0, offset, offset > 0, pack(piece, level) if level else piece)

    def syncDir(self, folder, level=0, **targets):
        """Sends the files of a folder that the server asks for. Returns their names."""
        folder = pathlib.Path(folder)
        files = [[str(file.relative_to(folder)), hashlib.md5(file.read_bytes()).hexdigest()]
                 for file in sorted(folder.rglob("*")) if file.is_file()]
        wanted = self.command("syncDir", str(folder), files, level, **targets) or []
        for row in wanted:
            self.sendFile(row.get("target", row["requested_file"]),
                          pathlib.Path(row["dirname"] + "/" + row["requested_file"]).read_bytes(), row["compressionLevel"])
        return [row["requested_file"] for row in wanted]


def _picture(row, answer):
    """Rows from the top, as the published client turns them."""
    kind, channels = PICTURES[row.name]
    data = next(value for value in answer.values() if isinstance(value, bytes))
    if answer["compressed"]:
        size = int.from_bytes(data[:4], "big")
        data = zlib.decompress(data[4:])
        if size != len(data):
            raise ValueError(f"{row.name}: {len(data)} bytes, announced {size}")
        if row.name == "getImageSpectrumProjection":  # first bytes of all values, then the second, ...
            data = numpy.frombuffer(data, "u1").reshape(4, -1).T.tobytes()
    shape = (answer["h"], answer["w"], channels) if channels > 1 else (answer["h"], answer["w"])
    return numpy.frombuffer(data, kind).reshape(shape)[::-1]


def _method(name):
    def call(self, *values, **named):
        return self.command(name, *values, **named)
    call.__name__ = name
    return call


for _name in TABLE:
    if not hasattr(PublishedClient, _name):
        setattr(PublishedClient, _name, _method(_name))
