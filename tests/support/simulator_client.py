#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A client of the simulator port: what another program needs to move the scene and to make steps.

    with Simulator("127.0.0.1", 5003) as simulator:
        simulator.pose("camera", 0.0, (-20000, 0, 0), (1, 0, 0, 0))
        print(simulator.step(0.1))    # Frame(number=1, time='0.100000000', outcome='complete', late_rows=0, quality={...})

With simulator.token_file: Simulator(host, port, token=pathlib.Path("camera.token").read_bytes()).
"""
import collections
import hmac
import socket

Frame = collections.namedtuple("Frame", "number time outcome late_rows quality")


class Refused(Exception):
    """The daemon answered `error ...`."""


class Simulator:
    def __init__(self, host, port, timeout_s=60, token=None):
        self.address = (host, port)
        self.socket = socket.create_connection(self.address, timeout_s)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.lines = self.socket.makefile("r", encoding="ascii", newline="\n")
        self.greeting = self.lines.readline().strip()
        _, asked, challenge = self.greeting.partition(" challenge=")
        if asked:
            if token is None:
                raise Refused("the daemon wants a token (simulator.token_file)")
            self.send(f"token {hmac.new(token, bytes.fromhex(challenge), 'sha256').hexdigest()}\n".encode())
            self.answer()  # welcome

    @staticmethod
    def pose_line(name, time_s, position_m, quaternion, velocity_m_s=(), rate_rad_s=()):
        numbers = " ".join(repr(float(v)) for v in (*position_m, *quaternion, *velocity_m_s, *rate_rad_s))
        return f"pose {name} {time_s:.9f} {numbers}\n".encode()

    def send(self, data):
        self.socket.sendall(data)

    def answer(self):
        line = self.lines.readline()
        if not line:
            raise ConnectionError("the daemon closed the connection")
        line = line.strip()
        if line.startswith("error "):
            raise Refused(line[6:])
        return line

    def pose(self, name, time_s, position_m, quaternion, velocity_m_s=(), rate_rad_s=()):
        """No answer when it is good; a complaint comes with the next answer that is read. Rates: both or none."""
        self.send(self.pose_line(name, time_s, position_m, quaternion, velocity_m_s, rate_rad_s))

    def pose_by_udp(self, name, time_s, position_m, quaternion):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.sendto(self.pose_line(name, time_s, position_m, quaternion), self.address)

    def step(self, time_s):
        """Lets one frame be made at `time_s` of the scene; returns when its last row has left."""
        self.send(f"step {time_s:.9f}\n".encode())
        word, number, time, outcome, late_rows, *quality = self.answer().split()
        assert word == "frame"
        return Frame(int(number), time, outcome, int(late_rows), dict(pair.split("=") for pair in quality))

    def state(self):
        self.send(b"state\n")
        return dict(pair.split("=") for pair in self.answer().split()[1:])

    def close(self):
        self.lines.close()
        self.socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
