// SPDX-License-Identifier: Apache-2.0
// Sections of all kinds of transports: defaults, printing, mistakes at their places, identities, makers.
#include "core/clock.hpp"
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/pattern_camera.hpp"
#include "tests/support/temp_folder.hpp"
#include "transports/file/settings.hpp"
#include "transports/gige/settings.hpp"
#include "transports/registry.hpp"
#include "transports/stimulator/calibration_table.hpp"
#include "transports/stimulator/settings.hpp"
#include "transports/v4l2/settings.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <vector>

namespace settings_test {

using namespace obscura;
using namespace obscura::transports;
using obscura::transports::gige::Fault;
using obscura::transports::gige::GigeSettings;

namespace {

constexpr SensorFacts sensor{64, 48, 12};

CameraFacts camera_facts() {
    CameraFacts camera{.sensor = sensor};
    camera.limits.sensor_width = camera.reset.region.width = sensor.width;
    camera.limits.sensor_height = camera.reset.region.height = sensor.height;
    return camera;
}

/// Settings read from a text that counts as the file c.toml of a folder, and the mistakes in it.
struct Reading {
    ConfiguredTransports transports;
    config::Value root;
    config::Where where;
    config::Mistakes mistakes;

    explicit Reading(const std::string& text, const std::filesystem::path& folder = "/bench")
        : root(config::parse_text(text, "c.toml")), where{folder / "c.toml", ""} {
        for (const config::Section& section : transports.sections())
            config::read_member(root, where, section, mistakes);
        if (mistakes.count() == 0) transports.check_with(camera_facts(), root, where, mistakes);
    }
    /// All mistakes without the folder's name; empty when there are none.
    [[nodiscard]] std::string complaint() const {
        try {
            mistakes.throw_if_any();
        } catch (const ConfigError& error) {
            std::string lines = error.what();
            const std::string prefix = where.file.parent_path().string() + "/";
            for (std::size_t at; (at = lines.find(prefix)) != std::string::npos;)
                lines.erase(at, prefix.size());
            return lines;
        }
        return {};
    }
    [[nodiscard]] std::string printed() {
        std::string text;
        for (const config::Section& section : transports.sections())
            text += config::print_section(section, "");
        return text;
    }
};

std::string without_comments(const std::string& text) {
    std::string kept;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        if (end > begin && text[begin] != '#') kept += text.substr(begin, end - begin) + "\n";
        begin = end + 1;
    }
    return kept;
}

constexpr const char* default_text = R"([gige]
enabled = true
interface = "lo"
port = 3956
vendor = "Obscura"
model = "Obscura-1"
serial = "OBS000001"
user_name = ""
mac = ""
packet_size = 1500
heartbeat_timeout_ms = 3000
heartbeat_timeout_max_ms = 60000
history_frames = 4
truth_entries = 0
keep_alive_ms = 10.0
drop_percent = 0.0
throughput_limit_mbit_s = 1000.0
backend = "sendmmsg"
allow = ""
off_link = false
read_only = false
xml = ""
xml_values = ""
state_file = ""
[file]
enabled = false
directory = "/bench/frames"
format = "png"
queue_frames = 4
truth = false
truth_table = false
[v4l2]
enabled = false
device = "/dev/video10"
format = "Y16"
io = "auto"
buffers = 8
queue_frames = 4
frame_counter = false
required = false
[stimulator]
enabled = false
vendor_id = 7504
product_id = 24909
serial = ""
width = 0
height = 0
refresh_hz = 0.0
format = "auto"
grey = "equal"
compression = "auto"
queue_frames = 2
calibration = ""
black_dn = 0.0
white_dn = 0.0
peak = 0.0
dither = "both"
)";

struct Broken {
    const char* text;
    const char* lines;
};

const std::vector<Broken> broken_texts{
    {"[gige]\nallow = \"banana\"\n",
     "c.toml:2:9: gige.allow: \"banana\": allowed is an IPv4 address or a range like 192.168.7.0/24"},
    {"[gige]\nallow = \"10.0.0.1, 10.0.0.0/33\"\n",
     "c.toml:2:9: gige.allow: \"10.0.0.0/33\": allowed is an IPv4 address or a range like 192.168.7.0/24"},
    {"[gige]\ninterface = \"\"\n",
     "c.toml:2:13: gige.interface: empty, the name or an IPv4 address of a network interface is wanted"},
    {"[gige]\ninterface = \"192.168.7\"\n",
     "c.toml:2:13: gige.interface: \"192.168.7\" is no IPv4 address like 192.168.7.2"},
    {"[gige]\ninterface = \"a name that is too long\"\n",
     "c.toml:2:13: gige.interface: \"a name that is too long\" is no name of a network interface: allowed "
     "are at "
     "most 15 characters without blanks and slashes"},
    {"[gige]\nmac = \"02:4f:0\"\n",
     "c.toml:2:7: gige.mac: \"02:4f:0\" is no hardware address, allowed six bytes like 02:4f:00:00:00:01"},
    {"[gige]\nmac = \"03:00:00:00:00:01\"\n",
     "c.toml:2:7: gige.mac: \"03:00:00:00:00:01\" is no hardware address, allowed six bytes like "
     "02:4f:00:00:00:01"},
    {"[gige]\nvendor = \"12345678901234567890123456789012\"\nmodel = \"caf\u00e9\"\n",
     "c.toml:2:10: gige.vendor: allowed are at most 31 printable ASCII characters\n"
     "c.toml:3:9: gige.model: allowed are at most 31 printable ASCII characters"},
    {"[gige]\nserial = \"1234567890123456\"\nuser_name = \"1234567890123456\"\n",
     "c.toml:2:10: gige.serial: allowed are at most 15 printable ASCII characters\n"
     "c.toml:3:13: gige.user_name: allowed are at most 15 printable ASCII characters"},
    {"[gige]\npacket_size = 1501\n", "c.toml:2:15: gige.packet_size: 1501 is not a multiple of 4"},
    {"[gige]\nbackend = \"pigeon\"\n",
     "c.toml:2:11: gige.backend: \"pigeon\" is not known, allowed sendmmsg, sendto, gso, auto"},
    {"[gige]\nxml = \"none.xml\"\n", "c.toml:2:7: gige.xml: none.xml: no such file"},
    {"[gige]\nxml = \"bad.xml\"\n",
     "c.toml:2:7: gige.xml: bad.xml: not a GenICam description (XML with the root RegisterDescription is "
     "wanted)"},
    {"[gige]\nxml = \"good.xml\"\nxml_values = \"HeaterSetPoint\"\n",
     "c.toml:3:14: gige.xml_values: \"HeaterSetPoint\": no =, allowed is Feature=value of a feature in "
     "good.xml"},
    {"[gige]\nxml = \"good.xml\"\nxml_values = \"HeaterSetPoint=20, Nonsense=1\"\n",
     "c.toml:3:14: gige.xml_values: \"Nonsense=1\": no such feature, allowed is Feature=value of a feature "
     "in "
     "good.xml"},
    {"[gige]\nxml = \"good.xml\"\nxml_values = \"Gain=99\"\n",
     "c.toml:3:14: gige.xml_values: \"Gain=99\": outside what the camera allows"},
    {"[gige]\nxml = \"good.xml\"\nxml_values = \"Width=65\"\n",
     "c.toml:3:14: gige.xml_values: \"Width=65\": outside what the camera allows"},
    {"[gige]\nfaults = 3\n", "c.toml:2:1: gige.faults: allowed tables [[gige.faults]]"},
    {"[[gige.faults]]\npercent = 3\n", "c.toml:1:1: gige.faults[0]: the key \"kind\" is missing"},
    {"[[gige.faults]]\nkind = \"lose\"\n[[gige.faults]]\nkind = \"loose\"\n",
     "c.toml:4:8: gige.faults[1].kind: \"loose\" is not known, allowed lose, lose_for_good, duplicate, "
     "reorder, "
     "delay, corrupt, drop_leader, drop_trailer, skip_frame, freeze_frame, repeat_frame, wrong_block_id, "
     "wrong_timestamp, mute_control, heartbeat_loss; did you mean \"lose\"?"},
    {"[[gige.faults]]\nkind = \"skip_frame\"\nfirst = 20\nlast = 10\n",
     "c.toml:4:8: gige.faults[0].last: 10 is before the first, 20"},
    {"[[gige.faults]]\nkind = \"delay\"\namount = -5\n",
     "c.toml:3:10: gige.faults[0].amount: -5 us is no delay, allowed 0 to 1000000"},
    {"[[gige.faults]]\nkind = \"wrong_block_id\"\namount = 0.5\n",
     "c.toml:3:10: gige.faults[0].amount: 0.5 is no distance of block ids, allowed 1 to 65535"},
    {"[file]\nformat = \"gif\"\n", "c.toml:2:10: file.format: \"gif\" is not known, allowed png, fits, raw"},
    {"[file]\nqueue_frames = 0\n", "c.toml:2:16: file.queue_frames: 0 is out of range, allowed 1 to 256"},
    {"[v4l2]\nenabled = true\ndevice = \"video10\"\n",
     "c.toml:3:10: v4l2.device: the absolute path of a video node is wanted, as in /dev/video10"},
    {"[v4l2]\nformat = \"y16\"\n",
     "c.toml:2:10: v4l2.format: \"y16\" is not known, allowed GREY, Y10, Y12, Y14, Y16; did you mean \"Y16\"?"},
    {"[stimulator]\ngrey = \"sum\"\n",
     "c.toml:2:8: stimulator.grey: \"sum\" needs a format with colours, RGB888 or XRGB8888"},
    {"[stimulator]\nwhite_dn = 100\nblack_dn = 100\n",
     "c.toml:3:12: stimulator.black_dn: 100 is not below white at 100"},
    // White is the highest number of the sensor's ADC.
    {"[stimulator]\nblack_dn = 4095\n", "c.toml:2:12: stimulator.black_dn: 4095 is not below white at 4095"},
    {"[stimulator]\nenabled = true\ncalibration = \"none.fits\"\n",
     "c.toml:3:15: stimulator.calibration: none.fits is no file that can be read"},
    {"[stimulator]\nenabled = true\ncalibration = \"other.fits\"\n",
     "c.toml:3:15: stimulator.calibration: made with a camera of 32x32 pixels, the sensor has 64x48"},
    // Mistakes of several transports at once.
    {"[gige]\nport = 0\n[v4l2]\nio = \"carrier\"\n",
     "c.toml:2:8: gige.port: 0 is out of range, allowed 1 to 65535\n"
     "c.toml:4:6: v4l2.io: \"carrier\" is not known, allowed auto, mmap, write"},
};

CalibrationTable table_for(std::int32_t width, std::int32_t height) {
    CalibrationTable table;
    table.screen_width = 80, table.screen_height = 60;
    table.camera_width = width, table.camera_height = height;
    return table;
}

void write_neighbours(const test::TempFolder& folder) {
    folder.write("bad.xml", "<Nothing/>");
    folder.write("bad.fits", "no FITS at all");
    std::filesystem::copy_file(OBSCURA_SOURCE_DIR "/tests/support/flight_camera.xml",
                               folder.path() / "good.xml");
    write_calibration(folder.path() / "good.fits", table_for(sensor.width, sensor.height));
    write_calibration(folder.path() / "other.fits", table_for(32, 32));
}

} // namespace

TEST_CASE("transports have the defaults that stand in the manual, in its order") {
    Reading reading("");
    CHECK(reading.complaint().empty());
    CHECK(without_comments(reading.printed()) == default_text);
}

TEST_CASE("printed sections of transports read back to the same") {
    const test::TempFolder folder;
    write_neighbours(folder);
    Reading first(R"([gige]
interface = "127.0.0.5"
mac = "02:00:00:00:00:0A"
backend = "auto"
allow = "127.0.0.5, 127.0.1.0/24"
xml = "good.xml"
xml_values = "HeaterSetPoint=20"
state_file = "sets"
[[gige.faults]]
kind = "freeze_frame"
percent = 12.5
last = 7
[[gige.faults]]
kind = "lose"
seed = 9
[file]
enabled = true
directory = "out"
format = "fits"
[v4l2]
format = "GREY"
io = "write"
[stimulator]
enabled = true
product_id = 4265
format = "RGB888"
grey = "high_low"
compression = "always"
calibration = "good.fits"
dither = "temporal"
)",
                  folder.path());
    REQUIRE(first.complaint().empty());
    const auto& camera = first.transports.get<GigeSettings>();
    CHECK(gige::parse_mac(camera.mac) == 0x02000000000A);
    CHECK(camera.backend == gige::SendBackend::automatic);
    REQUIRE(camera.faults.size() == 2);
    CHECK(camera.faults[0].fault == Fault::freeze_frame);
    CHECK(camera.faults[0].percent == 12.5);
    CHECK(camera.faults[1].percent == 100);
    CHECK(camera.faults[1].last_frame == 0);
    CHECK(first.transports.get<FileSinkSettings>().directory == (folder.path() / "out").string());
    CHECK(first.transports.get<V4l2Settings>().io == V4l2Io::write);
    const auto& stimulator = first.transports.get<StimulatorSettings>();
    CHECK(stimulator.calibration == (folder.path() / "good.fits").string());
    CHECK(gud_format(stimulator.format) == gud::Format::rgb888);
    Reading again(first.printed(), folder.path());
    CHECK(again.complaint().empty());
    CHECK(again.printed() == first.printed());

    ConfiguredTransports copy = first.transports;
    copy.get<V4l2Settings>().io = V4l2Io::mmap;
    CHECK(first.transports.get<V4l2Settings>().io == V4l2Io::write);
}

TEST_CASE("mistakes in sections of transports are reported at their places") {
    const test::TempFolder folder;
    write_neighbours(folder);
    for (const Broken& broken : broken_texts) {
        CAPTURE(broken.text);
        CHECK(Reading(broken.text, folder.path()).complaint() == broken.lines);
    }
    // The rest of this line is cfitsio's.
    const std::string line =
        Reading("[stimulator]\nenabled = true\ncalibration = \"bad.fits\"\n", folder.path()).complaint();
    CHECK(line.find("c.toml:3:15: stimulator.calibration: ") == 0);
    CHECK(line.find('\n') == std::string::npos);
    // What is switched off need not be there.
    CHECK(Reading("[stimulator]\ncalibration = \"none.fits\"\n[v4l2]\ndevice = \"video10\"\n", folder.path())
              .complaint()
              .empty());
}

TEST_CASE("relative paths start from the folder of the configuration file") {
    const std::filesystem::path here = std::filesystem::current_path();
    Reading given("[file]\ndirectory = \"out\"\n[stimulator]\ncalibration = \"t.fits\"\n", "bench");
    CHECK(given.transports.get<FileSinkSettings>().directory == (here / "bench/out").string());
    CHECK(given.transports.get<StimulatorSettings>().calibration == (here / "bench/t.fits").string());
    Reading left_out("", "bench");
    CHECK(left_out.transports.get<FileSinkSettings>().directory == (here / "bench/frames").string());
    CHECK(left_out.transports.get<StimulatorSettings>().calibration.empty());
}

TEST_CASE("two cameras share no address, serial number, node or folder") {
    const char* const all = "[gige]\nmac = \"02:00:00:00:00:0a\"\nstate_file = \"sets\"\n"
                            "[file]\nenabled = true\n[v4l2]\nenabled = true\n[stimulator]\nenabled = true\n";
    const Reading one(all);
    Reading two(all);
    two.transports.check_apart(one.transports, "camera[0]", two.root, two.where, two.mistakes);
    const char* const end = " of camera[0], too; each camera needs its own";
    CHECK(two.complaint() ==
          fmt::format("c.toml:1:2: gige.interface: \"lo\" is the address{0}\n"
                      "c.toml:1:2: gige.serial: \"OBS000001\" is the serial number{0}\n"
                      "c.toml:2:7: gige.mac: \"02:00:00:00:00:0a\" is the hardware address{0}\n"
                      "c.toml:3:14: gige.state_file: \"sets\" is the file for user sets{0}\n"
                      "c.toml:4:2: file.directory: \"frames\" is the folder{0}\n"
                      "c.toml:6:2: v4l2.device: \"/dev/video10\" is the video node{0}\n"
                      "c.toml:8:2: stimulator.serial: \"\" is the stimulator{0}",
                      end));
    // Another port is another address, and what is switched off takes nothing.
    Reading three("[gige]\nport = 3957\nserial = \"B\"\n[v4l2]\ndevice = \"/dev/video10\"\n");
    three.transports.check_apart(one.transports, "camera[0]", three.root, three.where, three.mistakes);
    CHECK(three.complaint().empty());
}

TEST_CASE("every key of a transport is documented by a phrase of its own") {
    ConfiguredTransports transports;
    std::vector<std::string> headings;
    for (const config::Section& section : transports.sections())
        for (const config::DocumentedTable& table : config::document(section, "")) {
            headings.push_back(table.heading);
            CHECK(table.help.size() > 20);
            for (const config::Key& key : table.keys) {
                CAPTURE(table.heading, key.name);
                CHECK(key.help().size() > 15);
                CHECK(key.help().find("Of ") != 0);
                CHECK(key.help().find("The same") != 0);
            }
        }
    CHECK(headings ==
          std::vector<std::string>{"[gige]", "[[gige.faults]]", "[file]", "[v4l2]", "[stimulator]"});
}

TEST_CASE("enabled transports are made in the order in which they start") {
    const test::TempFolder folder;
    Reading reading("[file]\nenabled = true\ntruth = true\n[v4l2]\nenabled = true\n"
                    "[stimulator]\nenabled = true\n",
                    folder.path());
    REQUIRE(reading.complaint().empty());
    // History and two; queue; queue; queue and one.
    CHECK(reading.transports.frames_held() == 6 + 4 + 4 + 3);
    CHECK(reading.transports.kept_truth().pixels);
    CHECK(reading.transports.kept_truth().scene_entries == 0);
    CHECK(reading.transports.controls_acquisition());

    CameraLimits limits;
    limits.sensor_width = sensor.width, limits.sensor_height = sensor.height;
    test::PatternCamera camera(limits);
    const MonotonicClock clock;
    const TransportContext context{.control = camera, .clock = clock, .sensor = sensor};
    std::vector<std::string> names;
    for (const auto& transport : reading.transports.make(context))
        names.emplace_back(transport->kind());
    CHECK(names == std::vector<std::string>{"file", "gige", "v4l2", "stimulator"});
    CHECK(std::filesystem::is_directory(folder.path() / "frames"));

    Reading alone("[gige]\nenabled = false\n[file]\nenabled = true\ndirectory = \"/proc/none\"\n");
    CHECK(alone.transports.frames_held() == 4);
    CHECK_FALSE(alone.transports.controls_acquisition());
    CHECK_FALSE(alone.transports.kept_truth().pixels);
    CHECK_THROWS_AS(alone.transports.make(context), OutputError);
}

} // namespace settings_test
