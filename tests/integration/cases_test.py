#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the case studies with few samples, and the Io case against frames made up from its own scene, with errors that it must find.

Usage: cases_test.py OBSCURA
Exit status 77 where the data or numpy are missing.
"""
import pathlib
import sys
import tempfile

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from case_runs import CASES, SKIPPED, check, failures, obscura  # noqa: E402
import case_runs  # noqa: E402

sys.path.insert(0, str(CASES))
import numpy as np  # noqa: E402


def case(script, *arguments):
    """As case_runs.case(); ends the test where the data are missing."""
    status, said, figures = case_runs.case(script, *arguments)
    if status == SKIPPED:
        print(said.strip())
        sys.exit(SKIPPED)
    return status, said, figures


def made_up_frame(file, right_px, down_px, factor):
    """A flight frame whose camera points so that all is right and down by some pixels, and whose light is `factor` times ours."""
    import case_files
    import io_lorri
    from case_geometry import text_kernel
    flight = case_files.data_file("flight_nh_lorri")
    header, _ = case_files.read_fits(flight / "lor_0034974380_0x630_sci_1_cropped.fit")
    frame = io_lorri.Frame(header)
    kernels = text_kernel(flight / "kernels/pck00010.tpc", flight / "kernels/nh_lorri_v201.ti")
    pixel_rad = kernels["INS-98301_PIXEL_SIZE"][0] * 1e-3 / kernels["INS-98301_OOC_FOCAL_LENGTH"][0]
    frame.turn_bodies(kernels)
    x, y, z = frame.attitude.T
    z = z - (right_px * x + down_px * y) * pixel_rad
    z /= np.linalg.norm(z)
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    with tempfile.TemporaryDirectory() as folder:
        scene, image = pathlib.Path(folder) / "s.toml", pathlib.Path(folder) / "s.fits"
        scene.write_text(io_lorri.scene_text(frame, kernels, attitude=np.stack([x, np.cross(z, x), z], axis=1)))
        case_files.run(obscura, "render", scene, "-o", image, "--samples", 16, "--seed", 5)
        radiance = case_files.read_fits(image)[1][""]
    dn = factor * radiance * io_lorri.dn_per_radiance(frame, io_lorri.SunInBand())
    noise = np.random.Generator(np.random.Philox(3)).normal(0, 1.4, dn.shape)
    case_files.write_fits(file, [((np.minimum(dn, 3700) + noise)[::-1], {})])


def made_up_kernel(file):
    """An SPK kernel as a transfer file, with Jupiter at its barycentre and the moons at rest where the stand-in has them."""
    import galilean_moons
    import jovian_system
    places = jovian_system.System(obscura, None).moons

    def coded(value):
        """Hexadecimal fraction and power of 16."""
        if value == 0:
            return "0^0"
        power = 0
        size = abs(value)
        while size >= 1:
            size, power = size / 16, power + 1
        while size < 1 / 16:
            size, power = size * 16, power - 1
        digits = f"{int(size * 16**14):014X}".rstrip("0")
        return f"{'-' if value < 0 else ''}{digits}^{'-' if power < 0 else ''}{abs(power):X}"
    begin, length = 838900000.0, 200000.0
    lines = ["DAFETF NAIF DAF ENCODED TRANSFER FILE", "'DAF/SPK '", "'2'", "'6'", f"'{'made up':60}'"]
    segments = {599: (5, np.zeros(3)), **{code: (599, places[name]) for name, code in galilean_moons.NAMES.items()}}
    for number, (body, (centre, place)) in enumerate(segments.items(), start=1):
        # Type 2, one record: middle, radius, two coefficients of each coordinate; start, length, size of a record, records.
        record = [begin + length / 2, length / 2, place[0], 0, place[1], 0, place[2], 0]
        numbers = [*record, begin, length, float(len(record)), 1.0]
        lines += [f"BEGIN_ARRAY {number} {len(numbers)}", f"'{'made up':40}'", f"'{coded(begin)}'", f"'{coded(begin + length)}'",
                  f"'{body:X}'", f"'{centre:X}'", "'1'", "'2'", str(len(numbers)), *(f"'{coded(v)}'" for v in numbers),
                  f"END_ARRAY {number} {len(numbers)}"]
    file.write_text("\n".join([*lines, f"TOTAL_ARRAYS {len(segments)}", ""]))


status, said, figures = case("io_lorri.py", "--samples", 16)
check("the Io case agrees with header, support data and the sum over Jupiter", status == 0, said)
check("the Io case says that the flight frame was not compared",
      figures.get("limb, terminator and night side of the flight frame") == "not compared", said)
with tempfile.TemporaryDirectory() as folder:
    frame = pathlib.Path(folder) / "frame.fit"
    made_up_frame(frame, 0.31, -0.22, 1.15)
    status, said, figures = case("io_lorri.py", "--samples", 16, "--frame", frame)
    shift = figures.get("shift_px", [9, 9])
    check("a frame 0.31 px right and 0.22 px up is found to be so, and passes",
          status == 0 and abs(shift[0] - 0.31) < 0.1 and abs(shift[1] + 0.22) < 0.1, said)
    check("a night side 1.15 times as bright is found to be so", abs(figures.get("night_factor", 0) - 1.15) < 0.03, said)
    made_up_frame(frame, 2.5, 0, 1.6)
    status, said, figures = case("io_lorri.py", "--samples", 16, "--frame", frame)
    check("a frame 2.5 px off, 1.6 times as bright, is refused in both", status == 1 and said.count("TOO FAR OFF") >= 2, said)
status, said, _ = case("io_europa.py", "--samples", 16)
check("the pair of Io and Europa is where and as bright as published", status == 0, said)
status, said, _ = case("jovian_system.py", "--samples", 8)
check("the Jovian case agrees with kernels, rays to the Sun and the lens", status == 0, said)
with tempfile.TemporaryDirectory() as folder:
    kernel = pathlib.Path(folder) / "moons.xsp"
    made_up_kernel(kernel)
    status, said, figures = case("jovian_system.py", "--samples", 8, "--kernel", kernel)
    check("with moons from a kernel too", status == 0 and not any("stand-in" in what for what in figures), said)
    kernel.write_text(kernel.read_text().replace("'1F7'", "'1F8'"))
    status, said, _ = case("jovian_system.py", "--samples", 8, "--kernel", kernel)
    check("a kernel without Ganymede is refused by name", status == 1 and "GANYMEDE" in said, said)
sys.exit(1 if failures else 0)
