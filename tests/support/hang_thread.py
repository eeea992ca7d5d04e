#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Stops threads of a running program, as if they hung, and leaves the others running (ptrace, as a debugger does).

Usage: hang_thread.py PID NAME [SECONDS]    stops the threads called NAME until SECONDS are over or for ever
Exit status 1 if there is no such thread; 77 where ptrace is not permitted. From other programs: with Hung(pid, name): ...
"""
import ctypes
import errno
import os
import sys
import time

PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT = 17, 0x4206, 0x4207
WALL = 0x40000000
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p]
libc.ptrace.restype = ctypes.c_long


def threads(pid):
    """{thread id: name} of a process."""
    found = {}
    for task in os.listdir(f"/proc/{pid}/task"):
        try:
            with open(f"/proc/{pid}/task/{task}/comm", encoding="utf-8") as file:
                found[int(task)] = file.read().strip()
        except OSError:
            pass
    return found


class NotPermitted(Exception):
    pass


def ptrace(request, thread):
    if libc.ptrace(request, thread, None, None) == -1:
        error = ctypes.get_errno()
        if error in (errno.EPERM, errno.ENOSYS):
            raise NotPermitted(os.strerror(error))
        raise OSError(error, os.strerror(error))


class Hung:
    """Within it the threads called `name` stand still."""

    def __init__(self, pid, name):
        self.ids = [thread for thread, comm in threads(pid).items() if comm == name]
        self.held = []

    def __enter__(self):
        for thread in self.ids:
            ptrace(PTRACE_SEIZE, thread)
            self.held.append(thread)
            ptrace(PTRACE_INTERRUPT, thread)
            os.waitpid(thread, WALL)
        return self

    def __exit__(self, *_):
        for thread in self.held:
            try:
                ptrace(PTRACE_DETACH, thread)
            except OSError:
                pass  # ended, or killed


def main(pid, name, seconds="inf"):
    try:
        with Hung(int(pid), name) as hung:
            if not hung.ids:
                sys.exit(f"process {pid} has no thread '{name}', only {sorted(set(threads(int(pid)).values()))}")
            print(f"thread '{name}' stands still", flush=True)
            end = time.monotonic() + float(seconds)
            # A traced process that is killed must be waited for, or it would linger.
            while time.monotonic() < end and os.path.exists(f"/proc/{pid}/task"):
                for thread in hung.ids:
                    try:
                        reaped, status = os.waitpid(thread, WALL | os.WNOHANG)
                        if reaped and (os.WIFSIGNALED(status) or os.WIFEXITED(status)):
                            return
                    except ChildProcessError:
                        return
                time.sleep(0.02)
    except NotPermitted as error:
        print(f"skipped: ptrace: {error}")
        sys.exit(77)


if __name__ == "__main__":
    main(*sys.argv[1:])
