#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura time: what it prints and refuses, and every scale beside astropy, which computes with ERFA too but by other ways.
Usage: time_test.py OBSCURA"""
import json
import pathlib
import sys
import tempfile
from fractions import Fraction

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "support"))
from verb_checks import VerbChecks  # noqa: E402

obscura = sys.argv[1]
checks = VerbChecks(obscura, "time")
run, check, check_refused = checks.run, checks.check, checks.check_refused
folder = pathlib.Path(tempfile.mkdtemp())

everything = run("2016-12-31T23:59:60.5Z").splitlines()
check("scales", [line.split()[0] for line in everything[:5]], ["UTC", "TAI", "TT", "TDB", "GPS"])
check("UTC", everything[0], "UTC      2016-12-31T23:59:60.500000000Z")
check("GPS week", everything[12].strip(), "GPS 1930 17.500000000")
check("TAI - UTC", everything[13].startswith("TAI-UTC  36 s, leap seconds of "), True)
check("one scale", run("JD 2451545.0 TDB", "--to", "utc", "--decimals", 6), "2000-01-01T11:58:55.816099Z\n")
check("form", run("2016-12-31T23:59:60.5Z", "--to", "TAI", "--format", "count"), "PTP 1483228836.500000000\n")
check("one as JSON", json.loads(run("PTP 0", "--to", "TAI", "--json")), {"scale": "TAI", "time": "1970-01-01T00:00:00.000000000 TAI"})
before_utc = json.loads(run("1950-01-01 TDB", "--json"))
check("no UTC", (before_utc["utc"]["iso"], before_utc["tai_minus_utc_s"]), (None, None))
now = json.loads(run("--json"))
check("now", abs(now["tai_ns"] - 37 * 10**9 - __import__("time").time_ns()) < 60 * 10**9, True)

check_refused(["2007-02-30"], 64, 'obscura time: time "2007-02-30": character 9: day 30, allowed is 1 to 28 in FEB 2007')
check_refused(["2015-12-31T23:59:60Z"], 64, "second 60 without a leap second")
check_refused(["now", "--to", "LST"], 64, "allowed are UTC, TAI, TT, TDB and GPS")
check_refused(["now", "--format", "jd"], 64, "--format needs --to")
check_refused(["now", "--leap-seconds", folder / "none.tls"], 66, "none.tls: cannot be read")

# Leap seconds of a file: with a second more, times after it are a second later.
kernel = folder / "future.tls"
steps = ["10, @1972-JAN-1", "11, @1972-JUL-1", "12, @1973-JAN-1"]
kernel.write_text("KPL/LSK\n\\begindata\nDELTET/DELTA_AT = ( " + "\n".join(steps) + " )\n")
check("kernel", run("1973-01-01T00:00:00Z", "--to", "TAI", "--leap-seconds", kernel, "--decimals", 0),
      "1973-01-01T00:00:12 TAI\n")
check("named", str(kernel) + ", which states no expiry" in run("now", "--leap-seconds", kernel), True)
kernel.write_text("KPL/LSK\n\\begindata\nDELTET/DELTA_AT = ( 10, @1972-JAN-1\n13, @1972-JUL-1 )\n")
check_refused(["now", "--leap-seconds", kernel], 66, "TAI - UTC goes from 10 s to 13 s")

try:
    import warnings

    from astropy.time import Time
    from astropy.utils import iers
    warnings.simplefilter("ignore")
    iers.conf.auto_download = False
except ImportError:
    print("skipped beside astropy: it is not installed (Debian package python3-astropy)")
    Time = None


def jd(time):
    return Fraction(float(time.jd1)) + Fraction(float(time.jd2))


largest = 0
for text in ("1961-08-01T00:00:00.1", "1969-07-20T20:17:40", "1972-06-30T23:59:60.25", "1979-03-05T12:05:26.4", "1985-07-01T00:00:00",
             "2000-01-01T11:58:55.816", "2007-02-28T10:23:45.678901234", "2016-12-31T23:59:60.999999999", "2017-01-01T00:00:00",
             "2026-11-22T20:00:00.123456789", "2100-12-31T23:59:59.999999999"):
    if Time is None:
        break
    time = Time(text, scale="utc", format="isot")
    ours = json.loads(run(text + "Z", "--json"))
    for scale in ("tai", "tt", "tdb"):
        got = Fraction(ours[scale]["jd"].split()[1])
        off_ns = float(abs(got - jd(getattr(time, scale))) * 86400 * 10**9)
        largest = max(largest, off_ns)
        check(f"{text}: {scale} within 1 ns, is {off_ns} ns off", off_ns <= 1, True)
    if text >= "1980-01-06":
        gps_s = (jd(time.tai) - Fraction("2444244.5")) * 86400 - 19
        _, week, second = ours["gps_week"].split()
        off_ns = float(abs(int(week) * 604800 + Fraction(second) - gps_s)) * 1e9
        largest = max(largest, off_ns)
        check(f"{text}: GPS within 1 ns, is {off_ns} ns off", off_ns <= 1, True)
    back = json.loads(run(ours["tdb"]["iso"], "--json"))
    check(f"{text}: back from TDB", back["tai_ns"], ours["tai_ns"])
print(f"largest difference from astropy: {largest:.3f} ns")

checks.end()
