# SPDX-License-Identifier: Apache-2.0
"""Checks of a test: a line each, those that are not good are kept in `failures`. Waiting for a state instead of for a time."""
import time

PATIENCE_S = 120  # ends a wait for what never comes; a busy machine and sanitizers stay far below

failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)


def until(told, good, pause_s=0.05):
    """The first answer of `told()` that is good; the last one where none has been."""
    end = time.monotonic() + PATIENCE_S
    while not good(answer := told()) and time.monotonic() < end:
        time.sleep(pause_s)
    return answer
