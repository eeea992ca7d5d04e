#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes a device away from under a running daemon and gives it back, again and again:

    returns.py DAEMON-PID TIMES gpio CHIP-FOLDER LINE FRAMES-FOLDER
    returns.py DAEMON-PID TIMES usb UDC-FILE CONTROLLER DEVICE-LOG
    returns.py DAEMON-PID TIMES video DRIVER-FOLDER DEVICE-NAME DAEMON-LOG

Prints how long it took from the return to the first frame through the device (gpio: the frame of an edge is stored; usb: the
screen shows an update; video: the node has taken an image). The clock is the virtual machine's, which runs with this
machine's: what the emulated processors are slower by is in it. Fails when one return takes more than 2 s, or the daemon
holds more files, threads or memory afterwards.
"""
import os
import pathlib
import re
import sys
import time

# On a busy machine the emulated one, and its USB enumeration, take longer than the daemon.
LIMIT_S = 5.0 if os.environ.get("RIG_BUSY") else 2.0
PATIENCE_S = 30
SETTLED = 10  # returns until everything that is allocated once has been
# Growth of memory in the second half of the returns: the C library keeps what it was given before, and touches more of
# it.
MOST_GROWTH_KIB = 1024

pid, times, kind = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
arguments = sys.argv[4:]


def held():
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    values = dict(line.split(":", 1) for line in status.splitlines())
    return {"files": len(os.listdir(f"/proc/{pid}/fd")), "threads": int(values["Threads"]), "KiB": int(values["VmRSS"].split()[0])}


def write(file, text):
    with open(file, "w", encoding="ascii") as out:
        out.write(text)


class Log:
    """Counts lines of a growing file that hold a text."""

    def __init__(self, file, text):
        self.file, self.text, self.count, self.rest = open(file, encoding="utf-8", errors="replace"), text, 0, ""

    def __call__(self):
        *lines, self.rest = (self.rest + self.file.read()).split("\n")
        self.count += sum(self.text in line for line in lines)
        return self.count


class FirstUpdates(Log):
    """Counts the times that the stimulator was plugged in and then shown something."""

    def __init__(self, file):
        super().__init__(file, "")
        self.waiting = True  # it is plugged in when this begins

    def __call__(self):
        *lines, self.rest = (self.rest + self.file.read()).split("\n")
        for line in lines:
            if line == "plugged in":
                self.waiting = True
            elif self.waiting and line.startswith("update "):
                self.waiting = False
                self.count += 1
        return self.count


def wait_more(count, than, meanwhile=lambda: None):
    begin = time.monotonic()
    while count() <= than:
        waited = time.monotonic() - begin
        if waited > PATIENCE_S:
            sys.exit(f"nothing came within {PATIENCE_S} s, return {len(took) + 1}")
        meanwhile()
        # Each look takes processor time that the daemon needs: to three per cent will do.
        time.sleep(max(0.002, 0.03 * waited))


class Gpio:
    def __init__(self, chip, line, frames):  # the chip's folder in configfs
        self.chip, self.line, self.frames = pathlib.Path(chip), line, pathlib.Path(frames)
        self.find_line()
        self.pulsed = self.since_ns = 0
        self.number, self.count = 1, 0

    def find_line(self):  # whose place changes with every return
        device, bank = ((self.chip / name).read_text().strip() for name in ("dev_name", "bank0/chip_name"))
        self.pull = pathlib.Path(f"/sys/devices/platform/{device}/{bank}/sim_gpio{self.line}/pull")

    def remove(self):
        write(self.chip / "live", "0")
        time.sleep(0.02)

    def put_back(self):
        self.since_ns = time.monotonic_ns()
        write(self.chip / "live", "1")
        self.find_line()

    def frame_count(self):  # frames of edges since the last return
        while (told := self.frames / f"frame_{self.number:06}.toml").exists():
            edge = re.search(r"^T_EDGE *= *(\d+)\b.*\n", told.read_text(), re.M)
            if not edge:
                break  # being written
            self.number += 1
            self.count += int(edge[1]) > self.since_ns
        return self.count

    def pulse(self):  # 20 edges a second
        now = time.monotonic()
        if now < self.pulsed + 0.05:
            return
        self.pulsed = now
        self.pull.write_text("pull-up")
        self.pull.write_text("pull-down")


class Usb:
    def __init__(self, udc, controller, log):
        self.udc, self.controller = udc, controller
        self.gone = Log(log, "unplugged")
        self.frame_count = FirstUpdates(log)

    def remove(self):
        before = self.gone()
        write(self.udc, "\n")
        wait_more(self.gone, before)

    def put_back(self):
        write(self.udc, self.controller)

    def pulse(self):
        pass


class Video:
    def __init__(self, driver, name, log):
        self.driver, self.name = driver, name
        self.frame_count, self.gone = Log(log, "takes images again"), Log(log, "is gone")

    def remove(self):
        before = self.gone()
        write(f"{self.driver}/unbind", self.name)
        wait_more(self.gone, before)

    def put_back(self):
        write(f"{self.driver}/bind", self.name)

    def pulse(self):
        pass


device = {"gpio": Gpio, "usb": Usb, "video": Video}[kind](*arguments)
took, memory = [], []
if kind != "video":
    wait_more(device.frame_count, 0, device.pulse)
for number in range(times):
    if number == min(SETTLED, times - 1):
        time.sleep(1)  # what else was on the device is opened again
        before = held()
    if number >= min(SETTLED, times - 1) and (number - SETTLED) % max(1, (times - SETTLED) // 4) == 0:
        memory.append(held()["KiB"])
    device.remove()
    seen = device.frame_count()
    begin = time.monotonic()
    device.put_back()
    wait_more(device.frame_count, seen, device.pulse)
    took.append(time.monotonic() - begin)
time.sleep(1)
after = held()
took.sort()
memory.append(after["KiB"])
if os.environ.get("RIG_BUSY"):
    kind += ", machine busy"
figures = (f"{times} returns ({kind}): first frame after {1e3 * took[times // 2]:.0f} ms (median), {1e3 * took[-1]:.0f} ms at worst; "
           + f"files {before['files']} then {after['files']}, threads {before['threads']} then {after['threads']}, "
           f"memory {', '.join(map(str, memory))} KiB")
if took[-1] > LIMIT_S:
    sys.exit(f"more than {LIMIT_S} s: {figures}")
if after["files"] > before["files"] or after["threads"] > before["threads"] or memory[-1] > memory[len(memory) // 2] + MOST_GROWTH_KIB:
    sys.exit(f"something leaks: {figures}")
print(figures)
