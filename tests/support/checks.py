# SPDX-License-Identifier: Apache-2.0
"""Checks of a test: a line each, those that are not good are kept in `failures`."""

failures = []


def check(what, good, detail=""):
    print(f"{'ok' if good else 'NOT OK'} - {what}{'' if good or not detail else ': ' + str(detail)}", flush=True)
    if not good:
        failures.append(what)
