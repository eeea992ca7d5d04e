#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Two cameras in two network namespaces, joined by a virtual cable, with a ptp4l beside each: both show the state of
their clock, and the same scheduled action gives frames whose time stamps agree within 10 us.

Both namespaces have one kernel, so there is one clock to agree on, and ptp4l only measures (free_running): what is
tested is everything between ptp4l's management socket and the time stamps, not how well a clock can be steered.

Usage: ptp_test.py OBSCURAD. Exit status 77 where namespaces or ptp4l are not to be had.
"""
import ctypes
import os
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time

obscurad = sys.argv[1]
PATIENCE_S = 40
LIMIT_NS = 10_000
DOMAIN = 77
names = [f"ptp{os.getpid()}{end}" for end in "ab"]
addresses = ["10.211.77.1", "10.211.77.2"]


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def ip(*arguments):
    return subprocess.run(["ip", *arguments], capture_output=True, text=True)


def inside(namespace, *command):
    """The command in another namespace. Not `ip -n` or `ip netns exec`: they mount, which a changed root forbids."""
    return ["nsenter", f"--net=/var/run/netns/{namespace}", *command]


def socket_in(namespace):
    """A UDP socket that lives in another network namespace; this process stays where it is."""
    libc = ctypes.CDLL(None, use_errno=True)
    with open("/proc/self/ns/net") as here, open(f"/var/run/netns/{namespace}") as there:
        if libc.setns(there.fileno(), 0) != 0:
            raise OSError(ctypes.get_errno(), "setns")
        try:
            return socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        finally:
            libc.setns(here.fileno(), 0)


class Camera:
    """A few GVCP commands."""

    def __init__(self, namespace, address):
        self.address = address
        self.control, self.stream = socket_in(namespace), socket_in(namespace)
        for s in (self.control, self.stream):
            s.bind((address, 0))
            s.settimeout(1)
        self.request = 0

    def command(self, code, payload, flags=1):
        self.request += 1
        packet = struct.pack(">BBHHH", 0x42, flags, code, len(payload), self.request) + payload
        for _ in range(5):
            self.control.sendto(packet, (self.address, 3956))
            try:
                answer = self.control.recv(600)
            except socket.timeout:
                continue
            status, _, _, request = struct.unpack(">HHHH", answer[:8])
            if request == self.request:
                assert status == 0, f"command {code:#x}: status {status:#x}"
                return answer[8:]
        raise TimeoutError(f"{self.address}: no answer to {code:#x}")

    def read(self, *registers):
        answer = self.command(0x80, struct.pack(f">{len(registers)}I", *registers))
        return struct.unpack(f">{len(registers)}I", answer)

    def write(self, register, value):
        self.command(0x82, struct.pack(">II", register, value))

    def device_time(self):
        self.write(0x944, 2)
        high, low = self.read(0x948, 0x94C)
        return high << 32 | low

    def ptp(self):
        """State, locked, offset from the master in ns."""
        self.write(0xA90C, 1)
        state, locked, high, low = self.read(0xA904, 0xA908, 0xA918, 0xA91C)
        offset = high << 32 | low
        return state, locked, offset - (1 << 64 if offset >> 63 else 0)

    def start(self):
        self.write(0x0A00, 2)
        self.write(0x90C, 0xCAFE)  # action device key, group key, group mask
        self.write(0x9800, 1)
        self.write(0x9804, 1)
        self.write(0xAA04, 2)  # TriggerSource = Action1
        self.write(0xD18, struct.unpack(">I", socket.inet_aton(self.address))[0])
        self.write(0xD00, self.stream.getsockname()[1])
        self.write(0xA104, 1)  # AcquisitionStart

    def action_at(self, instant):
        self.command(0x100, struct.pack(">IIIQ", 0xCAFE, 1, 1, instant), flags=0x81)

    def next_stamp(self):
        while True:
            packet = self.stream.recv(9000)
            if packet[4] & 0x0F == 1:  # leader
                return struct.unpack(">Q", packet[12:20])[0]


if os.geteuid() != 0:
    skip("needs the right to make network namespaces")
if shutil.which("ptp4l") is None:
    skip("ptp4l is not installed")
processes = []
folder = tempfile.TemporaryDirectory(prefix="obscura-ptp-")
base = pathlib.Path(folder.name)
try:
    for name in names:
        made = ip("netns", "add", name)
        if made.returncode != 0:
            skip(f"no network namespaces: {made.stderr.strip()}")
    made = ip("link", "add", "ptp0", "netns", names[0], "type", "veth", "peer", "name", "ptp0", "netns", names[1])
    if made.returncode != 0:
        skip(f"no virtual cable: {made.stderr.strip()}")
    for name, address in zip(names, addresses):
        for what in (["addr", "add", f"{address}/24", "dev", "ptp0"], ["link", "set", "lo", "up"],
                     ["link", "set", "ptp0", "up"]):
            made = subprocess.run(inside(name, "ip", *what), capture_output=True, text=True)
            if made.returncode != 0:
                skip(f"no addresses in a network namespace: {made.stderr.strip()}")
    (base / "scene.toml").write_text("[camera]\nposition_m = [0, 0, 0]\n")
    for i, (name, address) in enumerate(zip(names, addresses)):
        (base / f"{i}.conf").write_text(
            f"[global]\nuds_address {base}/{i}.ptp\ndomainNumber {DOMAIN}\nfree_running 1\nlogSyncInterval -4\n"
            f"logMinDelayReqInterval -4\nlogAnnounceInterval -2\ntime_stamping software\nuse_syslog 0\n"
            f"slaveOnly {i}\npriority1 {10 + i}\n")
        (base / f"{i}.toml").write_text(
            f'[scene]\nfile = "scene.toml"\n[ptp]\nenabled = true\nsocket = "{base}/{i}.ptp"\ndomain = {DOMAIN}\n'
            f'lock_us = 10000\n[trigger]\nsource = "none"\n[camera]\nexposure_us = 1000\n'
            f'[gige]\ninterface = "{address}"\n[sensor.readout]\nwidth = 64\nheight = 32\n')
        for command in (["ptp4l", "-4", "-f", f"{base}/{i}.conf", "-i", "ptp0", "-m"],
                        [obscurad, "--config", f"{base}/{i}.toml", "--ready-file", f"{base}/{i}.ready"]):
            log = open(base / f"{i}.{pathlib.Path(command[0]).name}.log", "w")
            processes.append(subprocess.Popen(inside(name, *command), stdout=log, stderr=log))
    deadline = time.monotonic() + PATIENCE_S
    while not all((base / f"{i}.ready").exists() for i in range(2)):
        if time.monotonic() > deadline or any(p.poll() is not None for p in processes):
            raise AssertionError("not ready")
        time.sleep(0.05)
    cameras = [Camera(name, address) for name, address in zip(names, addresses)]
    for camera in cameras:
        camera.start()
    states = []
    while time.monotonic() < deadline:
        states = [camera.ptp() for camera in cameras]
        # 6: master; 8, 9: measures or follows it.
        if states[0][0] == 6 and states[1][0] in (8, 9) and all(locked for _, locked, _ in states):
            break
        time.sleep(0.2)
    else:
        raise AssertionError(f"not locked: {states}")
    print(f"states {states}")
    worst = 0
    for _ in range(10):
        instant = cameras[0].device_time() + 300_000_000
        for camera in cameras:
            camera.action_at(instant)
        a, b = (camera.next_stamp() for camera in cameras)
        worst = max(worst, abs(a - b))
        assert abs(a - instant) < 1_000_000, f"asked for {instant}, got {a}"
    print(f"10 scheduled actions: time stamps differ by at most {worst} ns (limit {LIMIT_NS})")
    assert worst <= LIMIT_NS
    # A PTP daemon that goes is missed.
    processes[2].terminate()
    while cameras[1].ptp()[0] != 0:
        assert time.monotonic() < deadline + PATIENCE_S, "state still shown without ptp4l"
        time.sleep(0.2)
except BaseException:
    for log in sorted(base.glob("*.log")):
        print(f"--- {log.name}\n{log.read_text()[-2000:]}")
    raise
finally:
    for process in processes:
        process.terminate()
    for process in processes:
        process.wait()
    for name in names:
        ip("netns", "del", name)
    folder.cleanup()
