#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""obscura ephemeris: what it prints and refuses, and places beside python3-skyfield's.
Usage: ephemeris_test.py OBSCURA"""
import json
import math
import os
import pathlib
import struct
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "support"))
from verb_checks import VerbChecks  # noqa: E402

obscura = sys.argv[1]
checks = VerbChecks(obscura)
run, check, check_near, check_refused = checks.run, checks.check, checks.check_near, checks.check_refused
folder = pathlib.Path(tempfile.mkdtemp())


def spk(segments):
    """SPK file of bodies in uniform motion: (target, centre, begin, end, position km, velocity km/s)."""
    summaries, names, data = b"", b"", []
    for target, centre, begin, end, position, velocity in segments:
        middle, half = (begin + end) / 2, (end - begin) / 2
        words = [middle, half]
        for p, v in zip(position, velocity):
            words += [p + v * middle, v * half]
        words += [begin, end - begin, 8, 1]
        first = 3 * 128 + 1 + len(data)
        data += words
        summaries += struct.pack("<2d6i", begin, end, target, centre, 1, 2, first, first + len(words) - 1)
        names += b"UNIFORM".ljust(40)
    record = bytearray(b"DAF/SPK ".ljust(8) + struct.pack("<2i", 2, 6) + b"test".ljust(60) + struct.pack("<3i", 2, 2, 3 * 128 + 1 + len(data)) + b"LTL-IEEE")
    record = record.ljust(1024, b"\0")
    body = struct.pack("<3d", 0, 0, len(segments)) + summaries
    return bytes(record) + body.ljust(1024, b"\0") + names.ljust(1024) + struct.pack(f"<{len(data)}d", *data)


# A probe that passes a body, with a gap in its coverage.
kernel = folder / "probe.bsp"
kernel.write_bytes(spk([(-900, 0, 0, 100, (1000, 0, 0), (0, 1, 0)), (-900, 0, 200, 300, (1000, 0, 0), (0, 1, 0)),
                        (10, 0, -1000, 300, (-1.5e8, 0, 0), (0, 0, 0))]))
names = folder / "names.tf"
names.write_text("KPL/FK\n\\begindata\nNAIF_BODY_NAME = 'PROBE' NAIF_BODY_CODE = -900\n"
                 "BODY-900_RADII = ( 3 2 1 )\nBODY-900_POLE_RA = ( 0 ) BODY-900_POLE_DEC = ( 90 ) BODY-900_PM = ( 90 )\n")

text = run("ephemeris", kernel, names)
for part in ("PROBE (-900)", "2000-01-01T12:00:00.000 TDB to 2000-01-01T12:01:40.000 TDB, 2000-01-01T12:03:20.000 TDB to",
             "IAU_PROBE", "3 x 2 x 1 km", "SUN (10)"):
    check(f"list has {part!r}", part in text, True)
content = json.loads(run("ephemeris", kernel, names, "--json"))
check("bodies", [(b["id"], b["name"], len(b["covered"])) for b in content["positions"]], [(-900, "PROBE", 2), (10, "SUN", 1)])
check("radii", content["radii"], [{"id": -900, "name": "PROBE", "radii_km": [3, 2, 1]}])

at = ["ephemeris", kernel, names, "--target", "PROBE"]
place = json.loads(run(*at, "--time", "ET 50", "--json"))["places"][0]
check("position", [round(v, 6) for v in place["position_km"]], [1000, 50, 0])
check("velocity", [round(v, 9) for v in place["velocity_km_s"]], [0, 1, 0])
# The prime meridian points at 180 degrees: pole at 0, 90, node at 90 degrees, and a quarter turn on.
check_near("sun", place["below_sun_deg"][0], math.degrees(math.atan2(50, 1.50001e8)), 1e-6)
rows = run(*at, "--time", "2000-01-01T11:59:00Z", "--until", "2000-01-01T11:59:25Z", "--step", 10, "--csv").splitlines()
check("rows", [row.split(",")[0] for row in rows[1:]], [f"2000-01-01T11:59:{t:02}.000000000Z" for t in (0, 10, 20)])
check("frame", [round(v) for v in json.loads(run(*at, "--time", "ET 50", "--frame", "IAU_PROBE", "--json"))["places"][0]["position_km"]], [-1000, -50, 0])
later = json.loads(run("ephemeris", kernel, names, "--target", "SUN", "--observer", "PROBE", "--time", "ET 50", "--see", "astrometric", "--json"))["places"][0]
check_near("light time", later["light_time_s"], math.hypot(1.50001e8, 50) / 299792.458, 1e-9)

check_refused([*at, "--time", "ET 150"], 66, "PROBE (-900) is covered 2000-01-01T12:00:00.000 TDB to 2000-01-01T12:01:40.000 TDB, 2000-01-01T12:03:20")
check_refused([*at[:3], "--target", "PROBES", "--time", "ET 50"], 66, 'body PROBES: unknown, did you mean "PROBE"?')
check_refused([*at, "--time", "ET 50", "--observer", "MARS"], 66, "no kernel has positions of MARS (499)")
check_refused([*at, "--time", "noon"], 64, "obscura ephemeris: time")
check_refused([*at], 64, "--target needs --time")
check_refused([*at, "--time", "ET 0", "--until", "ET 10"], 64, "--until and --step")
check_refused([*at, "--time", "ET 0", "--until", "ET 100", "--step", "1e-6"], 64, "allowed are 1000000")
check_refused([*at, "--time", "ET 50", "--frame", "MIST"], 66, "frame MIST: unknown")
check_refused(["ephemeris", names.parent / "none.bsp"], 66, "none.bsp: cannot be opened")
(folder / "short.bsp").write_bytes(kernel.read_bytes()[:2500])
check_refused(["ephemeris", folder / "short.bsp"], 66, "short.bsp: ")

data = pathlib.Path(os.environ.get("OBSCURA_DATA", pathlib.Path(__file__).resolve().parents[3] / "shared/data")) / "ephemeris"
if (data / "de405_2000-2050.bsp").exists():
    # skyfield 1.45: ts.utc(2026, 3, 1, 12), Earth.at(t).observe(BODY).radec() and add_aberration().
    for target, astrometric, apparent, km in (("MOON", (138.755346161, 18.113253802), (138.760633383, 18.111766551), 375938.344540),
                                              ("5", (106.179961412, 22.949851978), (106.183527201, 22.949514415), 689698268.051685)):
        for see, wanted in (("astrometric", astrometric), ("apparent", apparent)):
            words = ["ephemeris", data / "de405_2000-2050.bsp", "--target", target, "--observer", "EARTH", "--time", "2026-03-01T12:00:00Z", "--see", see, "--json"]
            found = json.loads(run(*words))["places"][0]
            # skyfield's UTC to TDB differs by 20 us; 0.1 mas is 3e-8 degrees.
            check_near(f"{target} {see} right ascension", found["ra_deg"], wanted[0], 3e-8)
            check_near(f"{target} {see} declination", found["dec_deg"], wanted[1], 3e-8)
            check_near(f"{target} {see} distance", found["distance_km"], km, 1e-3)
else:
    print(f"SKIPPED: {data}/de405_2000-2050.bsp is not there")

# The default ephemeris: made without a name, used by scenes that name no kernel.
if pathlib.Path("/usr/share/casacore/data/ephemerides/DE405").exists():
    os.environ["XDG_DATA_HOME"] = os.environ["XDG_DATA_DIRS"] = str(folder / "home")
    made = folder / "home/obscura/de405.bsp"
    said = run("import", "ephemeris")
    check("the default ephemeris is made", (made.exists(), str(made) in said), (True, True))
    scene = folder / "moon.toml"
    scene.write_text("""epoch = "2026-03-01T12:00:00Z"
centre = "EARTH"
light_time = true
aberration = true
light_deflection = true
[camera]
ephemeris = "EARTH"
look_at = "MOON"
[[body]]
ephemeris = "MOON"
ephemeris_frame = "J2000"
radii_m = [1737400, 1737400, 1737400]
albedo = 0.12
""")
    seen = json.loads(run("sky", scene, "--json"))
    wanted = json.loads(run("ephemeris", made, "--target", "MOON", "--observer", "EARTH", "--time", "2026-03-01T12:00:00Z", "--see", "deflected", "--json"))["places"][0]
    check_near("the camera looks at the Moon: right ascension", seen["boresight_ra_deg"], wanted["ra_deg"], 3e-8)
    check_near("the camera looks at the Moon: declination", seen["boresight_dec_deg"], wanted["dec_deg"], 3e-8)
    check_refused(["import", "ephemeris", kernel], 64, "--output is wanted where a kernel is converted")
else:
    print("SKIPPED: casacore-data-jpl-de405 is not installed")

checks.end()
