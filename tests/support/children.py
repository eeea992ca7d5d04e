# SPDX-License-Identifier: Apache-2.0
"""Child processes of a test that end with it, however it ends: a daemon that is left behind holds ports and processor time."""
import atexit
import ctypes
import signal
import subprocess
import threading

PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None)


def _end_with_parent():
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


class Child(subprocess.Popen):
    """As subprocess.Popen. Killed when the test ends by an exception, and by the kernel when it is killed itself."""

    def __init__(self, *arguments, **options):
        # The kernel counts the thread that has started the child as its parent, and other threads end before the test.
        if threading.current_thread() is threading.main_thread():
            options.setdefault("preexec_fn", _end_with_parent)
        super().__init__(*arguments, **options)
        atexit.register(self._end)

    def _end(self):
        if self.poll() is None:
            self.kill()
            self.wait()
