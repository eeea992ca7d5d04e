#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Late frames of a configuration by cause: the machine's stalls or the daemon. Runs the daemon with a client for N frames, several times,
beside a witness on each core that has the highest real-time priority and only sleeps: while it is kept waiting, no program ran in time.

Usage: on_time.py OBSCURAD OBSCURA [--config FILE] [--frames N] [--runs N] [--speed SHARE] [--set SECTION.KEY=VALUE]... [--keep FOLDER]
--speed  0.5: rendering and detector have half of each core, as on a machine half as fast: a program with a priority above theirs and below
         that of the threads that release and send computes for the rest of each millisecond
--set    changes a key of the configuration (TOML values)
--keep   keeps the timing files and the stalls

A frame is late if a row was not ready in time, or left more than a millisecond late. It is the machine's if the rows would have been in time
without the stalls that the witnesses saw: those of the rows' own wait for rows that were ready, those since the frame before for others.
Needs SCHED_FIFO. Prints a row of a Markdown table for each run and the medians. Exit status 1 if in all runs together more than one frame
in 3000 was late by the daemon.
"""
import argparse
import csv
import json
import multiprocessing
import os
import pathlib
import statistics
import sys
import tempfile
import time

from late_rows import ROOT, run

WITNESS_PRIORITY, SPIN_PRIORITY = 99, 66  # detector 65, release 75: the defaults of [threads]
WITNESS_NS, STALL_NS, SPIN_NS = 1_000_000, 100_000, 1_000_000
SEIZED_NS = 30_000_000  # longer stalls excuse nothing: Linux gives 50 ms to ordinary programs where real-time threads leave them none
LATE_NS = 1_000_000
ALLOWED = 1 / 3000
REST = 0.25  # of each core, which render threads leave to other threads (threads.render_share)
HEAD = ("| configuration | speed | frames | late frames | of those by the machine | by the daemon | stalls of the machine, number | longest "
        "| degraded | error, median |\n|---|---|---|---|---|---|---|---|---|---|")


def enter(core, priority):
    os.sched_setaffinity(0, {core})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))


def witness(core, end, answer):
    """Sends the spans, ns of CLOCK_MONOTONIC, in which it was kept waiting."""
    enter(core, WITNESS_PRIORITY)
    stalls, now = [], time.monotonic_ns()
    while not end.is_set():
        due = now + WITNESS_NS
        time.sleep(max(0, due - time.monotonic_ns()) / 1e9)
        now = time.monotonic_ns()
        if now - due > STALL_NS:
            stalls.append((due, now))
    answer.send(stalls)


def spin(core, end, share):
    """Computes for that share of each millisecond."""
    enter(core, SPIN_PRIORITY)
    begin = time.monotonic_ns()
    while not end.is_set():
        while time.monotonic_ns() < begin + share * SPIN_NS:
            pass
        begin += SPIN_NS
        time.sleep(max(0, begin - time.monotonic_ns()) / 1e9)
        begin = max(begin, time.monotonic_ns() - SPIN_NS)


class Beside:
    """Witnesses, and what takes the rest of the cores, while it is open; then `stalls` has what they saw."""

    def __init__(self, speed):
        self.end, self.stalls, self.started, self.answers = multiprocessing.Event(), [], [], []
        for core in sorted(os.sched_getaffinity(0)):
            receive, send = multiprocessing.Pipe(False)
            self.answers.append(receive)
            self.started.append(multiprocessing.Process(target=witness, args=(core, self.end, send)))
            if speed < 1:
                self.started.append(multiprocessing.Process(target=spin, args=(core, self.end, 1 - speed)))

    def __enter__(self):
        for process in self.started:
            process.start()
        return self

    def __exit__(self, *_):
        self.end.set()
        for receive in self.answers:
            self.stalls += receive.recv()
        for process in self.started:
            process.join()
        self.stalls = merged(self.stalls)


def merged(spans):
    """Spans that overlap, as one."""
    out = []
    for begin, end in sorted(spans):
        if out and begin <= out[-1][1]:
            out[-1] = (out[-1][0], max(out[-1][1], end))
        else:
            out.append((begin, end))
    return out


def stalled_ns(stalls, begin, end):
    """Time between two instants in which the machine stood still. A witness does not see the first part of a stall, up to its own period."""
    return sum(min(e, end) - max(b - WITNESS_NS, begin) for b, e in stalls
               if e > begin and b - WITNESS_NS < end and e - b < SEIZED_NS)


def by_machine(frame, stalls):
    """Whether a late frame would have been in time without the stalls."""
    first, last, rows = int(frame["due_ns"]), int(frame["last_due_ns"]), int(frame["rows"])
    per_row = (last - first) / max(1, rows - 1)
    ready_late = int(frame["late_rows"]) > 0
    for row, late_us in enumerate(frame["row_lateness_us"].split()):
        late_ns = float(late_us) * 1000
        if late_ns <= (0 if ready_late else LATE_NS):
            continue
        due = first + row * per_row
        since = int(frame["render_begin_ns"]) - 10 * (last - first) // 9 if ready_late else due
        if stalled_ns(stalls, since, due + late_ns) < late_ns - LATE_NS:
            return False
    return True


def late(frame):
    return int(frame["late_rows"]) + int(frame["stalled_rows"]) > 0


def measure(arguments, folder, number):
    # What computes beside takes its part of the rest, too.
    if arguments.speed < 1:
        arguments.set = arguments.set + [f"threads.render_share={1 - REST / arguments.speed:g}"]
    with Beside(arguments.speed) as beside:
        timing, complaint = run(arguments, folder)
    if complaint:
        print("grab: " + complaint, file=sys.stderr)
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
        (arguments.keep / f"run-{number}.csv").write_bytes(timing.read_bytes())
        (arguments.keep / f"stalls-{number}.json").write_text(json.dumps(beside.stalls), encoding="ascii")
    frames = list(csv.DictReader(timing.read_text(encoding="ascii").splitlines()))
    late_frames = [f for f in frames if late(f)]
    ours = [f for f in late_frames if not by_machine(f, beside.stalls)]
    for f in ours:
        print(f"frame {f['frame_id']} of run {number}: {f['late_rows']} rows not ready, {f['stalled_rows']} left late, "
              f"the worst {int(f['worst_row_ns']) / 1e6:.2f} ms (row {f['worst_row']})", file=sys.stderr)
    errors = [int(f["error_ppm"]) / 1e4 for f in frames if f["levels"]]
    return (len(frames), len(late_frames), len(late_frames) - len(ours), len(ours), len(beside.stalls),
            max((e - b for b, e in beside.stalls), default=0) / 1e6, sum(int(f["rows_degraded"]) > 0 for f in frames),
            statistics.median(errors) if errors else 0.0)


def table_row(name, speed, values):
    frames, all_late, machine, ours, stalls, longest, degraded, error = values
    print(f"| {name} | {speed:g} | {frames:g} | {all_late:g} | {machine:g} | {ours:g} | {stalls:g} | {longest:.1f} ms | {degraded:g} | {error:.2f} % |")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("obscurad")
    parser.add_argument("obscura")
    parser.add_argument("--config", type=pathlib.Path, default=ROOT / "config/realtime.toml")
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--speed", type=float, default=1)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--keep", type=pathlib.Path)
    arguments = parser.parse_args()
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    except PermissionError:
        sys.exit("no SCHED_FIFO: nothing tells the machine's stalls from the daemon's lateness; see ulimit -r")
    name = arguments.config.name + "".join(f", `{change}`" for change in arguments.set)
    runs = []
    print(HEAD)
    for number in range(arguments.runs):
        with tempfile.TemporaryDirectory(prefix="obscura-on-time-") as temporary:
            runs.append(measure(argparse.Namespace(**vars(arguments)), pathlib.Path(temporary), number))
        table_row(name, arguments.speed, runs[-1])
    table_row("median", arguments.speed, [statistics.median(values) for values in zip(*runs)])
    return 1 if sum(r[3] for r in runs) > ALLOWED * sum(r[0] for r in runs) else 0


if __name__ == "__main__":
    sys.exit(main())
