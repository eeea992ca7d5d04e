# SPDX-License-Identifier: Apache-2.0
"""A camera for benches of what other programs cost it: its configuration, and how late its rows left."""
import csv
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONFIG = """[scene]
file = "{root}/tests/support/light_scene.toml"
[render]
samples_per_pixel = 1
[trigger]
rate_hz = 10
[daemon]
pool_frames = 24
[gige]
enabled = false
{tables}
[sensor.readout]
width = {size}
height = {size}
"""


def write_config(file, size, tables):
    """A camera of `size` x `size` at 10 Hz; `tables`: further text."""
    pathlib.Path(file).write_text(CONFIG.format(root=ROOT, size=size, tables=tables))


def row_lateness(file):
    """Microseconds by which each row left after its time, sorted; of a timing file."""
    values = []
    with open(file, newline="", encoding="utf-8") as lines:
        for row in csv.DictReader(line for line in lines if not line.startswith("#")):
            values += [float(v) for v in row["row_lateness_us"].split()]
    return sorted(values)


def at(values, share):
    """Quantile of sorted values."""
    return values[min(len(values) - 1, int(share * len(values)))] if values else float("nan")
