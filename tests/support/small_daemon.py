# SPDX-License-Identifier: Apache-2.0
"""A small camera for tests of programs that ask daemons: few pixels, frames to files, a monitor socket."""
import pathlib
import shutil
import subprocess

from children import Child


class SmallDaemon:
    """Its files in a folder. `tables`: further text of its configuration, which begins within [sensor.readout]; `trigger`: of [trigger];
    `gige`: of [gige]; without it there is no GigE Vision."""

    def __init__(self, folder, obscurad, source, name="obscurad.toml", rate_hz=10, tables="", trigger="", gige="enabled = false", size=(64, 48)):
        folder = pathlib.Path(folder)
        (folder / "frames").mkdir()
        shutil.copy(pathlib.Path(source) / "tests/support/light_scene.toml", folder / "scene.toml")
        self.obscurad, self.config, self.socket = obscurad, folder / name, str(folder / "monitor.socket")
        self.config.write_text(f"""[scene]
file = "scene.toml"
[trigger]
rate_hz = {rate_hz}
{trigger}
[gige]
{gige}
[file]
enabled = true
format = "raw"
directory = "{folder / 'frames'}"
[monitor]
socket = "{self.socket}"
[sensor.readout]
width = {size[0]}
height = {size[1]}
{tables}""")

    def start(self, *arguments):
        """The process; its output is not kept."""
        return Child([self.obscurad, "--config", self.config, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
