// SPDX-License-Identifier: Apache-2.0
// Files that must be refused: each with its exact one-line message and exit status.
#include "core/error.hpp"
#include "emulator/config/daemon_config.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene/trajectory.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace broken_test {

using namespace obscura;

namespace {

/// The lines that `load` throws, with the folder's name taken out.
std::string complaint(const test::TempFolder& folder, const std::function<void()>& load) {
    try {
        load();
    } catch (const Error& error) {
        // A file that cannot be opened is an input, as on any command line.
        const bool opened =
            std::string_view(error.what()).find(": cannot be opened: ") == std::string_view::npos;
        CHECK((error.status() == exit_config || (!opened && error.status() == exit_no_input)));
        std::string line = error.what();
        const std::string prefix = folder.path().string() + "/";
        for (std::size_t at; (at = line.find(prefix)) != std::string::npos;)
            line.erase(at, prefix.size());
        return line;
    }
    return "no error";
}

struct Broken {
    const char* text;
    const char* line;
};

const std::vector<Broken> broken_configs{
    {R"([scene]
file = "scene.toml"
[gige]
mac = "02:4f:0"
)",
     "c.toml:4:7: gige.mac: \"02:4f:0\" is no hardware address, allowed six bytes like 02:4f:00:00:00:01"},
    {R"(camera = []
[scene]
file = "scene.toml"
)",
     "c.toml:1:1: camera: 0 cameras, allowed 1 to 16"},
    {R"([scene]
file = "scene.toml"
[[camera]]
[camera.gige]
interface = "127.0.0.2"
serial = "A"
[[camera]]
[camera.gige]
serial = "B"
interface = "127.0.0.2"
)",
     "c.toml:10:13: camera[1].gige.interface: \"127.0.0.2\" is the address of camera[0], too; each camera "
     "needs "
     "its own"},
    {R"([scene]
file = "scene.toml"
[gige]
serial = "A"
[[camera]]
gige = { interface = "127.0.0.2" }
[[camera]]
gige = { interface = "127.0.0.3" }
)",
     "c.toml:4:10: camera[1].gige.serial: \"A\" is the serial number of camera[0], too; each camera needs "
     "its "
     "own"},
    {R"([scene]
file = "scene.toml"
[[camera]]
[[camera]]
exposure = 3
)",
     R"(c.toml:5:1: camera[1].exposure: unknown key, did you mean "exposure_us"?)"},
    {R"([scene]
file = "scene.toml"
[[camera]]
gain_db = 50
)",
     "c.toml:4:11: camera[0].gain_db: 50 is out of range, allowed 0 to 24 dB"},
    {R"([scene]
file = "scene.toml"
[[camera]]
[camera.view]
boresight = [0, 0, 0]
)",
     "c.toml:5:13: camera[0].view.boresight: a vector that is not zero is wanted"},
    {R"([scene]
file = "scene.toml"
[[camera]]
[camera.daemon]
seed = 3
)",
     "c.toml:4:9: camera[0].daemon: unknown key, allowed view, trigger, deadline, simulator, "
     "outputs, gige, file, v4l2, "
     "stimulator, "
     "sensor, window, width, height, offset_x, offset_y, pixel_format, exposure_us, gain_db, trigger_mode, "
     "trigger_source, trigger_activation, exposure_mode, frame_rate_hz, readout_timing, "
     "rows_max"},
    {R"([scene]
file = "scene.toml"
[gige]
enabled = false
[[camera]]
[[camera]]
[[camera.window]]
width = 5
height = 5
offset_y = 1020
)",
     "c.toml:9:10: camera[1].window[0].height: rows 1020 to 1024 leave the sensor, which is 1024 px high"},
    {R"([scene]
file = "scene.toml"
[sensor.readout]
width = 100
[[camera]]
offset_x = 101
)",
     "c.toml:6:12: camera[0].offset_x: columns 101 to 101 leave the sensor, which is 100 px wide"},
    {R"([scene]
file = "scene.toml"
[camera]
trigger_activation = "FallingEdge"
)",
     "c.toml:4:22: camera.trigger_activation: TriggerActivation[FrameStart]: Line0 reports rising edges "
     "only"},
    {R"([scene]
file = "scene.toml"
[[camera]]
[[camera]]
exposure_mode = "TriggerWidth"
gige = { enabled = false }
)",
     "c.toml:5:17: camera[1].exposure_mode: ExposureMode TriggerWidth: no line's source reports both edges"},
    {R"([scene]
file = "scene.toml"
[sensor.detector]
adc_bits = 12
offset_dn = 3000
)",
     "c.toml:5:13: sensor.detector.offset_dn: BlackLevel 3000 DN: allowed 0 to 2048"},
    {R"([scene]
file = "scene.toml"
[sensor]
file = "black.toml"
)",
     "c.toml:4:8: sensor.file: BlackLevel 3000 DN: allowed 0 to 2048"},
    {R"([scene]
file = "scene.toml"
[camera]
width = 10
offset_x = 3
[sensor.readout]
window_step = 2
)",
     "c.toml:5:12: camera.offset_x: 3 is not a multiple of 2, the step of this sensor's windows"},
    {R"([scene]
file = "scene.toml"
[gige]
packet_size = 1501
[[camera]]
)",
     "c.toml:4:15: gige.packet_size: 1501 is not a multiple of 4"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
)",
     R"(c.toml:3:1: camera.window[0]: the key "height" is missing)"},
    {R"([scene]
file = "scene.toml"
[camera]
window = 3
)",
     R"(c.toml:4:1: camera.window: allowed tables [[camera.window]])"},
    {R"([scene]
file = "scene.toml"
[camera]
window = []
)",
     R"(c.toml:4:1: camera.window: empty, at least one window is wanted)"},
    {R"([scene]
file = "scene.toml"
[camera]
width = 10
[[camera.window]]
width = 10
height = 10
)",
     R"(c.toml:4:9: camera.width: not allowed beside [[camera.window]], which says it)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
[[camera.window]]
width = 25
height = 10
offset_x = 1000
)",
     R"(c.toml:7:9: camera.window[1].width: columns 1000 to 1024 leave the sensor, which is 1024 px wide)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 2000
)",
     R"(c.toml:5:10: camera.window[0].height: rows 0 to 1999 leave the sensor, which is 1024 px high)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 0
height = 10
)",
     R"(c.toml:4:9: camera.window[0].width: 0 is out of range, allowed 1 to 65536 px)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
offset_y = -2
)",
     R"(c.toml:6:12: camera.window[0].offset_y: -2 is out of range, allowed 0 to 65535 px)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
exposure_us = 0
)",
     R"(c.toml:6:15: camera.window[0].exposure_us: 0 is out of range, allowed 1 to 3.6e9 us)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
exposure_us = -5.0
)",
     R"(c.toml:6:15: camera.window[0].exposure_us: -5 is out of range, allowed 1 to 3.6e9 us)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
exposure_us = nan
)",
     R"(c.toml:6:15: camera.window[0].exposure_us: nan is not a finite number)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
offset_x = 3
[sensor.readout]
window_step = 2
)",
     R"(c.toml:6:12: camera.window[0].offset_x: 3 is not a multiple of 2, the step of this sensor's windows)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
sampling = "cds"
reads = 2
[sensor.readout]
shutter = "global"
)",
     R"(c.toml:6:12: camera.window[0].sampling: "cds" needs a rolling shutter)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
reads = 2
)",
     R"(c.toml:6:9: camera.window[0].reads: 2 is out of range, allowed 1 to 1 with sampling "destructive")"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
sampling = "ramp"
)",
     R"(c.toml:3:1: camera.window[0].reads: 1 is out of range, allowed 2 to 64 with sampling "ramp")"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
sampling = "non-destructive"
reads = 33
)",
     R"(c.toml:3:10: camera.window: 33 windows with every non-destructive read counted, allowed are 32)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
[[camera.window]]
width = 10
height = 10
[sensor.readout]
windows_max = 1
)",
     R"(c.toml:3:10: camera.window: 2 windows, this sensor has at most 1)"},
    {R"([scene]
file = "scene.toml"
[[camera.window]]
width = 10
height = 10
offset_x = 2000
[sensor.readout]
strict = false
)",
     R"(c.toml:6:12: camera.window[0].offset_x: nothing of the window lies on the sensor, which has 1024 x 1024 px)"},
    {R"([scene]
file = "scene.toml"
[[gige.faults]]
percent = 3
)",
     R"(c.toml:3:1: gige.faults[0]: the key "kind" is missing)"},
    {R"([scene]
file = "scene.toml"
[gige]
faults = 3
)",
     "c.toml:4:1: gige.faults: allowed tables [[gige.faults]]"},
    {R"([scene]
file = "scene.toml"
[[gige.faults]]
kind = "lose"
[[gige.faults]]
kind = "loose"
)",
     "c.toml:6:8: gige.faults[1].kind: \"loose\" is not known, allowed lose, lose_for_good, duplicate, "
     "reorder, delay, corrupt, drop_leader, drop_trailer, skip_frame, freeze_frame, repeat_frame, "
     "wrong_block_id, wrong_timestamp, mute_control, heartbeat_loss; did you mean \"lose\"?"},
    {R"([scene]
file = "scene.toml"
[[gige.faults]]
kind = "skip_frame"
first = 20
last = 10
)",
     "c.toml:6:8: gige.faults[0].last: 10 is before the first, 20"},
    {R"([scene]
file = "scene.toml"
[[gige.faults]]
kind = "delay"
amount = -5
)",
     "c.toml:5:10: gige.faults[0].amount: -5 us is no delay, allowed 0 to 1000000"},
    {R"([scene]
file = "scene.toml"
[[gige.faults]]
kind = "wrong_block_id"
amount = 0.5
)",
     "c.toml:5:10: gige.faults[0].amount: 0.5 is no distance of block ids, allowed 1 to 65535"},
    {R"([scene]
file = "scene.toml"
[trigger]
rate = 5
)",
     R"(c.toml:4:1: trigger.rate: unknown key, did you mean "rate_hz"?)"},
    {R"([scene]
file = "scene.toml"
[trigger]
rate_hz = 0
)",
     "c.toml:4:11: trigger.rate_hz: 0 is out of range, allowed 0.001 to 10000 Hz"},
    {R"([scene]
file = "scene.toml"
[trigger]
rate_hz = "5"
)",
     "c.toml:4:11: trigger.rate_hz: is a string, allowed a number, 0.001 to 10000 Hz"},
    {R"([scene]
file = "scene.toml"
[trigger]
rate_hz = nan
)",
     "c.toml:4:11: trigger.rate_hz: nan is not a finite number"},
    {R"([scene]
file = "scene.toml"
[trigger]
rate_hz = 20000
)",
     "c.toml:4:11: trigger.rate_hz: 20000 is out of range, allowed 0.001 to 10000 Hz"},
    {R"([scene]
file = "scene.toml"
[trigger]
source = "sundial"
)",
     R"(c.toml:4:10: trigger.source: "sundial" is not known, allowed timer, ptp_timer, gpio, pps, ptp, udp, )"
     "lockstep, none"},
    {R"([scene]
file = "scene.toml"
[trigger.line1]
source = "lockstep"
)",
     R"(c.toml:4:10: trigger.line1.source: "lockstep" is not known, allowed timer, ptp_timer, gpio, pps, ptp, )"
     "udp, none"},
    {R"([scene]
file = "scene.toml"
[trigger.line4]
source = "udp"
)",
     R"(c.toml:3:10: trigger.line4: unknown key, did you mean "line1"?)"},
    {R"([scene]
file = "scene.toml"
[triger]
rate_hz = 5
)",
     R"(c.toml:3:2: triger: unknown key, did you mean "trigger"?)"},
    {R"([scene]
file = "scene.toml"
[completely_different]
)",
     "c.toml:3:2: completely_different: unknown key, allowed scene, daemon, render, ptp, threads, monitor, models, "
     "control, trigger, deadline, camera, simulator, outputs, gige, file, v4l2, stimulator, sensor"},
    {R"([scene]
file = "scene.toml"
[monitor]
socket = "relative"
)",
     R"(c.toml:4:10: monitor.socket: "relative"; allowed are "auto", "off" and an absolute path of at most 107 bytes)"},
    {R"([scene]
file = "scene.toml"
[control]
unix_socket = "relative"
listen = "0.0.0.0:5153"
)",
     "c.toml:5:10: control.listen: 0.0.0.0:5153: without token_file only addresses of the loopback interface "
     "are allowed\nc.toml:4:15: control.unix_socket: \"relative\"; allowed are \"auto\" and an absolute "
     "path of at most 107 bytes"},
    {R"([scene]
file = "scene.toml"
[simulator]
enabled = true
listen = "192.168.1.5:5003"
)",
     "c.toml:5:10: simulator.listen: 192.168.1.5:5003: without token_file only addresses of the loopback "
     "interface are allowed"},
    {R"([scene]
file = "scene.toml"
[control]
listen = "127.0.0.1"
clients = 0
)",
     "c.toml:5:11: control.clients: 0 is out of range, allowed 1 to 1000"},
    {R"([scene]
file = "scene.toml"
[threads]
release_cores = "3-1"
)",
     R"(c.toml:4:17: threads.release_cores: "3-1" is no list of cores like "2-3,5")"},
    {R"([scene]
file = "scene.toml"
[threads]
render_class = "rr"
render_priority = 70
)",
     "c.toml:5:19: threads.render_priority: 70 is not below the priorities of the other threads, 70"},
    {R"([scene]
file = "scene.toml"
[stimulator]
grey = "sum"
)",
     R"(c.toml:4:8: stimulator.grey: "sum" needs a format with colours, RGB888 or XRGB8888)"},
    {R"([scene]
file = "scene.toml"
[stimulator]
white_dn = 100
black_dn = 100
)",
     "c.toml:5:12: stimulator.black_dn: 100 is not below white at 100"},
    {R"([scene]
file = "scene.toml"
[camera]
exposure_us = 5
exposure_us = 6
)",
     "c.toml:5:15: not valid TOML: Error while parsing key-value pair: cannot redefine existing integer "
     "'exposure_us'"},
    {R"([scene]
file = "scene.toml"
[camera]
width = 2000
)",
     "c.toml:4:9: camera.width: columns 0 to 1999 leave the sensor, which is 1024 px wide"},
    {R"([scene]
file = "scene.toml"
[camera]
width = 512
offset_x = 600
)",
     "c.toml:4:9: camera.width: columns 600 to 1111 leave the sensor, which is 1024 px wide"},
    {R"([scene]
file = "scene.toml"
[camera]
height = 12.5
)",
     "c.toml:4:10: camera.height: is a number, allowed an integer, 0 to 65536 px"},
    {R"([scene]
file = "scene.toml"
[camera]
pixel_format = "RGB8"
)",
     R"(c.toml:4:16: camera.pixel_format: "RGB8" is not known, allowed Mono8, Mono10, Mono12, Mono14, Mono16, Mono10p, Mono12p)"},
    {R"([scene]
file = "scene.toml"
[camera]
exposure_us = 0.5
)",
     "c.toml:4:15: camera.exposure_us: 0.5 is out of range, allowed 1 to 3.6e9 us"},
    {R"([scene]
file = "scene.toml"
[gige]
port = 70000
)",
     "c.toml:4:8: gige.port: 70000 is out of range, allowed 1 to 65535"},
    {R"([scene]
file = "scene.toml"
[gige]
serial = "far too long a serial number"
)",
     "c.toml:4:10: gige.serial: allowed are at most 15 printable ASCII characters"},
    {R"([scene]
file = "scene.toml"
[gige]
packet_size = 1501
)",
     "c.toml:4:15: gige.packet_size: 1501 is not a multiple of 4"},
    {R"([scene]
file = "scene.toml"
[gige]
enabled = 1
)",
     "c.toml:4:11: gige.enabled: is an integer, allowed true or false"},
    {R"([scene]
file = "scene.toml"
[daemon]
seed = -1
)",
     "c.toml:4:8: daemon.seed: -1 is out of range, allowed 0 to 9e15"},
    {R"([scene]
file = "scene.toml"
[daemon]
scene_time = "tai"
)",
     "c.toml:4:14: daemon.scene_time: \"tai\" needs an epoch in the scene file"},
    {R"([scene]
file = "scene.toml"
[daemon]
scene_time = "replay"
)",
     "c.toml:4:14: daemon.scene_time: \"replay\" needs scene_times"},
    {R"([scene]
file = "scene.toml"
[daemon]
scene_time = "tai"
scene_rate = 2
)",
     "c.toml:5:14: daemon.scene_rate: belongs to scene_time = \"nominal\" or \"clock\"\n"
     "c.toml:4:14: daemon.scene_time: \"tai\" needs an epoch in the scene file"},
    {R"([scene]
file = "scene.toml"
[daemon]
scene_times = "scene.toml"
)",
     "c.toml:4:15: daemon.scene_times: belongs to scene_time = \"replay\""},
    {R"([scene]
file = "scene.toml"
[daemon]
scene_rate = 0
)",
     "c.toml:4:14: daemon.scene_rate: 0 is out of range, allowed 1e-6 to 1000000"},
    {R"([scene]
file = "scene.toml"
[daemon]
log_level = 7
)",
     "c.toml:4:13: daemon.log_level: is an integer, allowed a string: error, warning, notice, info, debug"},
    {R"([scene]
file = "scene.toml"
[sensor]
file = "none.toml"
)",
     "c.toml:4:8: sensor.file: none.toml: no such file"},
    {R"([scene]
file = "scene.toml"
[sensor]
file = "bad_sensor.toml"
)",
     "bad_sensor.toml:2:9: readout.width: 0 is out of range, allowed 1 to 65536 px"},
    {R"([scene]
file = "scene.toml"
[sensor]
file = "."
)",
     "c.toml:4:8: sensor.file: : not a regular file"},
    {R"([scene]
file = "scene.toml"
[sensor]
pixel_pitch_um = { valu = 5 }
)",
     R"(c.toml:4:20: sensor.pixel_pitch_um.valu: unknown key, did you mean "value"?)"},
    {R"([scene]
file = "scene.toml"
[sensor]
pixel_pitch_um = { source = "x" }
)",
     R"(c.toml:4:18: sensor.pixel_pitch_um: the table has no key "value")"},
    {R"([scene]
file = "scene.toml"
[sensor]
pixel_pitch_um = { value = 5, source = 3 }
)",
     "c.toml:4:40: sensor.pixel_pitch_um.source: is an integer, allowed a string"},
    {R"([scene]
file = "scene.toml"
[sensor.detector]
quantum_efficiency = [[500, 0.5], [400, 0.4]]
)",
     "c.toml:4:35: sensor.detector.quantum_efficiency: wavelengths must increase"},
    {R"([scene]
file = "scene.toml"
[sensor.detector]
quantum_efficiency = [[500, 0.5], [500, 0.4]]
)",
     "c.toml:4:35: sensor.detector.quantum_efficiency: wavelengths must increase"},
    {R"([scene]
file = "scene.toml"
[sensor.detector]
quantum_efficiency = [[500, 1.5]]
)",
     "c.toml:4:29: sensor.detector.quantum_efficiency: 1.5 is out of range, allowed 0 to 1"},
    {R"([scene]
file = "scene.toml"
[sensor.detector]
quantum_efficiency = 0.5
)",
     "c.toml:4:22: sensor.detector.quantum_efficiency: is a number, allowed an array of [wavelength_nm, "
     "value] pairs"},
    {R"([scene]
file = "scene.toml"
[sensor.detector]
quantum_efficiency = []
)",
     "c.toml:4:22: sensor.detector.quantum_efficiency: empty, at least one [wavelength_nm, value] pair is "
     "wanted"},
    {R"([scene]
file = "scene.toml"
[sensor.detector]
offset_dn = 5000
)",
     "c.toml:3:9: sensor.detector: offset_dn 5000 is above the full scale of 12 bits"},
    {R"([scene]
file = "scene.toml"
[sensor.readout]
reset_instant_ns = 100
)",
     "c.toml:3:9: sensor.readout: sample_instant_ns 200 < reset_instant_ns 100 < row_overhead_ns 1000 does "
     "not hold"},
    {R"([scene]
file = "scene.toml"
sensor = 4
)",
     "c.toml:3:1: scene.sensor: unknown key, allowed file"},
    {"[scene]\n", R"(c.toml:1:2: scene: the key "file" is missing, a scene file is wanted)"},
    {"", R"(c.toml: scene: the key "file" is missing, a scene file is wanted)"},
    {R"([scene]
file = "missing.toml"
)",
     "c.toml:2:8: scene.file: missing.toml: no such file"},
    {"[scene]\nfile = 12\n", "c.toml:2:8: scene.file: is an integer, allowed a file name"},
    {R"([scene]
file = ""
)",
     "c.toml:2:8: scene.file: empty, a file name is wanted"},
    {"[a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q]\n", "c.toml:1:33: not valid TOML: a key has more than 16 parts"},
    {"[scene\n", "c.toml:1:7: not valid TOML: Error while parsing table header: expected ']', saw '\\n'"},
    {"key = \n", "c.toml:1:7: not valid TOML: Error while parsing key-value pair: expected value, saw '\\n'"},
    {R"([scene]
file = "scene.toml
)",
     "c.toml:2:19: not valid TOML: Error while parsing string: unescaped control characters other than TAB "
     "(U+0009) are explicitly prohibited"},
    {R"([scene]
file = "scene.toml"
[camera]
gain_db = 1979-05-27
)",
     "c.toml:4:11: camera.gain_db: is a date or time, allowed a number, 0 to 24 dB"},
    {R"([scene]
file = "scene.toml"
[camera]
width = 99999999999999999999
)",
     "c.toml:4:29: not valid TOML: Error while parsing decimal integer: '99999999999999999999' is not "
     "representable in 64 bits"},
    {"\xff"
     "\xfe"
     "[scene]\n",
     "c.toml: cannot be opened: is text in UTF-16 or UTF-32, allowed is UTF-8: save it as such"},
};
const std::vector<Broken> broken_scenes{
    {"[camera]\nprojection = \"fish\"\n",
     R"(s.toml:2:14: camera.projection: "fish" is not known, allowed pinhole, equidistant, equisolid, )"
     "stereographic, orthographic, model"},
    {"[camera]\nvignetting = \"cos\"\n",
     R"(s.toml:2:14: camera.vignetting: "cos" is not known, allowed none, cos4; did you mean "cos4"?)"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
colour = [0.1, 0.2]
)",
     "s.toml:5:10: body[0].colour: has 2 numbers, allowed one for each of the 1 bands"},
    {R"([[body]]
shape = "polygons"
albedo = 0.5
faces_m = [[[0, 0, 0], [1, 0, 0]]]
)",
     "s.toml:4:12: body[0].faces_m: a face is an array of 3 or more corners [x, y, z]"},
    {R"([[body]]
shape = "polygons"
albedo = 0.5
faces_m = [[[0, 0, 0], [1, 0, 0], [1, 1]]]
)",
     "s.toml:4:35: body[0].faces_m: a corner is an array of 3 numbers [x, y, z]"},
    {R"([[lamp]]
beam = "spot"
intensity_w_sr = [1]
)",
     R"(s.toml:2:8: lamp[0].beam: "spot" is not known, allowed point, uniform, gaussian)"},
    {"quantity = \"flux\"\n", R"(s.toml:1:12: quantity: "flux" is not known, allowed irradiance, radiance)"},
    {"[[body]]\n", R"(s.toml:1:1: body[0]: the key "shape" is missing)"},
    {R"([[body]]
shape = "cube"
)",
     R"(s.toml:2:9: body[0].shape: "cube" is not known, allowed ellipsoid, mesh, planet, terrain, procedural, polygons, box, disc, cone, model)"},
    {R"([[body]]
shape = "ellipsoid"
albedo = 0.5
)",
     R"(s.toml:1:1: body[0]: the key "radii_m" is missing)"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
)",
     R"(s.toml:1:1: body[0]: the key "albedo" is missing)"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 0, 1]
albedo = 0.5
)",
     "s.toml:3:15: body[0].radii_m: 0 is out of range, allowed 1e-6 to 1e12 m"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1]
albedo = 0.5
)",
     "s.toml:3:11: body[0].radii_m: has 2 elements, allowed an array of 3 numbers [x, y, z]"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, "a", 1]
albedo = 0.5
)",
     "s.toml:3:15: body[0].radii_m: holds a string, allowed an array of 3 numbers [x, y, z]"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
position_m = [nan, 0, 0]
)",
     "s.toml:5:15: body[0].position_m: nan is not a finite number"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
orientation = [1, 1, 0, 0]
)",
     "s.toml:5:15: body[0].orientation: |q| = 1.41421, a unit quaternion [w, x, y, z] is wanted"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
orientation = [0, 0, 0, 0]
)",
     "s.toml:5:15: body[0].orientation: |q| = 0, a unit quaternion [w, x, y, z] is wanted"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
seed = 4
)",
     R"(s.toml:5:8: body[0].seed: belongs to shape = "procedural", this body's is "ellipsoid")"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
trajectory = "gone.csv"
)",
     "s.toml:5:14: body[0].trajectory: gone.csv: no such file"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
trajectory = "good.csv"
position_m = [1, 2, 3]
)",
     R"(s.toml:6:14: body[0].position_m: cannot stand beside "trajectory")"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
spin_axis = [0, 0, 0]
)",
     "s.toml:5:13: body[0].spin_axis: a vector that is not zero is wanted"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
name = "x"
[[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
name = "x"
)",
     R"(s.toml:6:1: body[1].name: "x" is the name of an earlier body)"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 1.5
)",
     "s.toml:4:10: body[0].albedo: 1.5 is out of range, allowed 0 to 1"},
    {R"([[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
material = "lambertian"
)",
     R"(s.toml:5:12: body[0].material: "lambertian" is not known, allowed lambert, lommel-seeliger, lunar-lambert, minnaert, oren-nayar, phong, hapke, phase-curve, ggx, mirror, file, model, moon, eros, itokawa, 67p, mercury, venus, earth, mars, jupiter, saturn, io, europa, ganymede, callisto, mli, solar-cell, white-paint; did you mean "lambert"?)"},
    {R"([[body]]
shape = "mesh"
albedo = 0.5
)",
     R"(s.toml:1:1: body[0]: the key "file" is missing)"},
    {R"([[body]]
shape = "mesh"
file = "no.obj"
albedo = 0.5
)",
     "s.toml:3:8: body[0].file: no.obj: no such file"},
    {"body = 3\n", "s.toml:1:1: body: allowed tables [[body]]"},
    {R"([body]
shape = "mesh"
)",
     "s.toml:1:2: body: allowed tables [[body]]"},
    {"[sun]\ndirection = [0, 0, 0]\n", "s.toml:2:13: sun.direction: a vector that is not zero is wanted"},
    {"[sun]\ndirection = [1, 0, 0]\nposition_m = [1, 0, 0]\n",
     R"(s.toml:2:13: sun.direction: cannot stand beside "position_m")"},
    {"[sun]\nradius = 1\n", R"(s.toml:2:1: sun.radius: unknown key, did you mean "radius_m"?)"},
    {"[camera]\nboresight = [0, 0, 1]\nup = [0, 0, -2]\n",
     R"(s.toml:2:13: camera.boresight: is parallel to "up", which leaves the rotation about it open; write another direction, for instance up = [1, 0, 0])"},
    {"[camera]\nlook_at_m = [0, 0, 0]\n", "s.toml:2:13: camera.look_at_m: is the camera's own position"},
    {"[camera]\nup = [0, 0, 1]\n", R"(s.toml:1:2: camera: "up" needs "boresight", "look_at_m" or "look_at")"},
    {"[camera]\nlook_at = \"asteroid\"\n[[body]]\nname = \"rock\"\nshape = \"ellipsoid\"\nradii_m = [1, 1, "
     "1]\n"
     "albedo = 0.5\n",
     R"(s.toml:2:11: camera.look_at: "asteroid" is no body or landmark of the scene; there are rock, sun)"},
    {"[[lamp]]\nintensity_w_sr = [1]\nlook_at = \"asteroid\"\n",
     R"(s.toml:3:11: lamp[0].look_at: "asteroid" is no body or landmark of the scene; there are sun)"},
    {"[camera]\nlook_at = \"\"\n", "s.toml:2:11: camera.look_at: is empty, the name of a body is wanted"},
    {"[camera]\nlook_at = \"sun\"\nlook_at_m = [1, 2, 3]\n",
     R"(s.toml:3:13: camera.look_at_m: cannot stand beside "look_at")"},
    {"[camera]\nlook_at = \"sun\"\ntrajectory = \"good.csv\"\n",
     R"(s.toml:2:11: camera.look_at: cannot stand beside a "trajectory" with columns qw,qx,qy,qz)"},
    {"[camera]\ntrajectory = \"positions.csv\"\n",
     R"(s.toml:2:14: camera.trajectory: has no columns qw,qx,qy,qz: "look_at", "look_at_m", "boresight", "orientation" or "attitude" is wanted beside it)"},
    {R"([camera]
parent = "rock"
joint = "hinge"
joint_angle_deg = 3
look_at = "sun"
[[body]]
name = "rock"
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 0.5
)",
     R"(s.toml:5:11: camera.look_at: belongs to joint = "fixed": it gives the attitude at every instant)"},
    {"[camera]\nboresight = [0, 0, 1]\norientation = [1, 0, 0, 0]\n",
     R"(s.toml:3:15: camera.orientation: cannot stand beside "boresight")"},
    {"[camera]\nfocal_length_mm = -5\n",
     "s.toml:2:19: camera.focal_length_mm: -5 is out of range, allowed 0.1 to 1000000 mm"},
    {"[camera]\nwidth = 0\n", "s.toml:2:9: camera.width: 0 is out of range, allowed 1 to 65536 px"},
    {"[stars]\n", R"(s.toml:1:2: stars: the key "catalogue" is missing)"},
    {R"([stars]
catalogue = "gone.csv"
)",
     "s.toml:2:13: stars.catalogue: gone.csv: no such file"},
    {R"([stars]
catalogue = "bad_stars.csv"
)",
     "bad_stars.csv:2:1: 3 values, the header has 4 columns (ra_deg,dec_deg,v_mag,b_v)"},
    {"[[band]]\nfrom_nm = 500\n", R"(s.toml:1:1: band[0]: the key "to_nm" is missing)"},
    {"[[band]]\nfrom_nm = 500\nto_nm = 400\n", "s.toml:3:9: band[0].to_nm: must be greater than from_nm"},
    {"band = []\n", "s.toml:1:1: band: at least one band is wanted"},
};
const std::vector<Broken> broken_materials{
    {"albedo = 0.5\nexponent = 2\n", "s.toml:5:12: body[0].exponent: belongs to material = \"minnaert\" or "
                                     "\"phong\", this body's is \"lambert\""},
    {"material = \"hapke\"\n", "s.toml:1:1: body[0]: the key \"single_scattering_albedo\" is missing"},
    {"material = \"hapke\"\nalbedo = 0.5\nsingle_scattering_albedo = 0.3\n",
     "s.toml:5:10: body[0].albedo: belongs to material = \"lambert\" or \"lommel-seeliger\" or "
     "\"lunar-lambert\" or "
     "\"minnaert\" or \"oren-nayar\" or \"phase-curve\", this body's is \"hapke\""},
    {"material = \"lunar-lambert\"\nalbedo = 0.5\nweight = [1, 2]\n",
     "s.toml:6:10: body[0].weight: has 2 elements, allowed an array of 4 numbers"},
    {"material = 3\n",
     "s.toml:4:12: body[0].material: is an integer, allowed a string: lambert, "
     "lommel-seeliger, lunar-lambert, "
     "minnaert, oren-nayar, phong, hapke, phase-curve, ggx, mirror, file, model, moon, eros, itokawa, 67p, "
     "mercury, venus, earth, mars, jupiter, saturn, io, europa, ganymede, callisto, mli, solar-cell, "
     "white-paint"},
};
const std::vector<Broken> broken_trajectories{
    {"", R"(t.csv:1:1: empty, the header "time_s,x_m,y_m,z_m[,qw][,qx][,qy][,qz]" is wanted)"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n", "t.csv: no rows after the header"},
    {"time,x,y,z\n0,0,0,0\n",
     R"(t.csv:1:1: header is "time,x,y,z", allowed "time_s,x_m,y_m,z_m[,qw][,qx][,qy][,qz]")"},
    {"time_s,x_m,y_m,z_m\n", "t.csv: no rows after the header"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy\n0,0,0,0,1,0,0\n",
     "t.csv:2:9: qw: qw, qx, qy and qz are wanted in every row, or in none for positions only"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0,0,0,,,,\n",
     "t.csv:3:9: qw: qw, qx, qy and qz are wanted in every row, or in none for positions only"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0\n",
     "t.csv:2:1: 7 values, the header has 8 columns (time_s,x_m,y_m,z_m,qw,qx,qy,qz)"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n0,0,0,0,1,0,0,0\n",
     "t.csv:3:1: time_s: 0 does not come after 0"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n-1,0,0,0,1,0,0,0\n",
     "t.csv:3:1: time_s: -1 does not come after 0"},
    {"time_s,x_m,y_m,z_m\n0,0,0,0\n1,0,-1e200,0\n", "t.csv:3:5: y_m: -1e+200 is outside -1e+15 to 1e+15"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,nan,1,0,0,0\n",
     R"(t.csv:2:7: z_m: "nan" is not a finite number)"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,1e999,1,0,0,0\n",
     R"(t.csv:2:7: z_m: "1e999" is not a finite number)"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,  ,1,0,0,0\n", R"(t.csv:2:7: z_m: "" is not a finite number)"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,12m,0,1,0,0,0\n",
     R"(t.csv:2:5: y_m: "12m" is not a finite number)"},
    {"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0.1,0,0\n",
     "t.csv:2:9: qw: |q| = 1.00499, a unit quaternion is wanted"},
};
const std::vector<Broken> broken_catalogues{
    {"ra_deg,dec_deg,v_mag,b_v\n361,0,1,0\n", "k.csv:2:1: ra_deg: 361 is out of range, allowed 0 to 360"},
    {"ra_deg,dec_deg,v_mag,b_v\n0,-91,1,0\n", "k.csv:2:3: dec_deg: -91 is out of range, allowed -90 to 90"},
    {"ra_deg,dec_deg,v_mag,b_v\n0,0,x,0\n", R"(k.csv:2:5: v_mag: "x" is not a finite number)"},
    {"ra_deg,dec_deg,v_mag,b_v\n0,0,1\n",
     "k.csv:2:1: 3 values, the header has 4 columns (ra_deg,dec_deg,v_mag,b_v)"},
};

constexpr const char* good_body = "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.5\n";
constexpr const char* trajectory_header = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n";

void write_neighbours(const test::TempFolder& folder) {
    folder.write("scene.toml", good_body);
    folder.write("bad_sensor.toml", "[readout]\nwidth = 0\n");
    folder.write("black.toml", "[detector]\nadc_bits = 12\noffset_dn = 3000\n");
    folder.write("good.csv", std::string(trajectory_header) + "0,0,0,0,1,0,0,0\n");
    folder.write("positions.csv", "time_s,x_m,y_m,z_m\n0,0,0,0\n");
    folder.write("bad_stars.csv", "ra_deg,dec_deg,v_mag,b_v\n1,2,3\n");
}

} // namespace

TEST_CASE("broken configurations are refused with one line") {
    const test::TempFolder folder;
    write_neighbours(folder);
    for (const Broken& broken : broken_configs) {
        const auto file = folder.write("c.toml", broken.text);
        CHECK(complaint(folder, [&] { (void)emulator::load_config(file); }) == broken.line);
    }
    CHECK(broken_configs.size() >= 20);
}

TEST_CASE("what could not start is refused before it is tried, all of it at once") {
    const test::TempFolder folder;
    write_neighbours(folder);
    const auto file = folder.write("c.toml", R"([scene]
file = "scene.toml"
[trigger]
source = "gpio"
[trigger.line1]
source = "gpio"
[trigger.line2]
source = "udp"
listen = "banana"
[trigger.line3]
source = "ptp_timer"
start = "yesterday"
[gige]
allow = "banana"
[simulator]
enabled = true
listen = "banana"
[threads]
render_cores = "some"
[camera]
gain_db = 30
)");
    const std::string lines = complaint(folder, [&] { (void)emulator::load_config(file); });
    for (const char* line : {"c.toml:3:2: trigger.line: ", "c.toml:5:10: trigger.line1.line: ",
                             "c.toml:9:10: trigger.line2.listen: ", "c.toml:12:9: trigger.line3.start: ",
                             "c.toml:14:9: gige.allow: ", "c.toml:17:10: simulator.listen: ",
                             "c.toml:19:16: threads.render_cores: ",
                             "c.toml:21:11: camera.gain_db: 30 is out of range, allowed 0 to 24 dB"}) {
        INFO(lines);
        CHECK(lines.find(line) != std::string::npos);
    }
    CHECK(std::count(lines.begin(), lines.end(), '\n') == 7);
}

TEST_CASE("broken scenes are refused with one line") {
    const test::TempFolder folder;
    write_neighbours(folder);
    for (const Broken& broken : broken_scenes) {
        const auto file = folder.write("s.toml", broken.text);
        CHECK(complaint(folder, [&] { (void)scene::load_scene(file); }) == broken.line);
    }
}

TEST_CASE("broken materials are refused with one line") {
    const test::TempFolder folder;
    for (const Broken& broken : broken_materials) {
        const auto file = folder.write(
            "s.toml", std::string("[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\n") + broken.text);
        CHECK(complaint(folder, [&] { (void)scene::load_scene(file); }) == broken.line);
    }
}

TEST_CASE("broken trajectories are refused with one line") {
    const test::TempFolder folder;
    for (const Broken& broken : broken_trajectories) {
        const auto file = folder.write("t.csv", broken.text);
        CHECK(complaint(folder, [&] { (void)scene::read_trajectory(file); }) == broken.line);
    }
}

TEST_CASE("broken star catalogues are refused with one line") {
    const test::TempFolder folder;
    for (const Broken& broken : broken_catalogues) {
        const auto file = folder.write("k.csv", broken.text);
        CHECK(complaint(folder, [&] { (void)scene::read_stars(file, 99); }) == broken.line);
    }
}

TEST_CASE("files that cannot be read at all") {
    const test::TempFolder folder;
    CHECK(complaint(folder, [&] { (void)emulator::load_config(folder.path() / "none.toml"); }) ==
          "none.toml: cannot be opened: No such file or directory");
    std::filesystem::create_directory(folder.path() / "d");
    CHECK(complaint(folder, [&] { (void)emulator::load_config(folder.path() / "d"); }) ==
          "d: cannot be opened: not a regular file");
    CHECK(complaint(folder, [&] { (void)scene::load_scene("/dev/zero"); }) ==
          "/dev/zero: cannot be opened: not a regular file");
    CHECK(complaint(folder, [&] { (void)scene::read_trajectory(folder.path() / "none.csv"); }) ==
          "none.csv: cannot be opened: No such file or directory");
}

TEST_CASE("hostile text is survived") {
    const test::TempFolder folder;
    const auto load = [&](const std::string& text) {
        return complaint(folder,
                         [&, file = folder.write("c.toml", text)] { (void)emulator::load_config(file); });
    };
    // Nesting beyond any sense, a key of a megabyte, a zero byte, an escape sequence of a terminal.
    CHECK(load("a = " + std::string(100'000, '[')).substr(0, 7) == "c.toml:");
    CHECK(load(std::string(1'000'000, 'k') + " = 1").size() < 1000);
    CHECK(load(std::string("[scene]\nfile = \"a\0b\"\n", 22)).substr(0, 7) == "c.toml:");
    CHECK(load("\"\\u001b[31m\" = 1\n").find('\x1b') == std::string::npos);
}

} // namespace broken_test
