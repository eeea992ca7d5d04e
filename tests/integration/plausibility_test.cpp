// SPDX-License-Identifier: Apache-2.0
// What check, render and capture say about configurations that are valid but odd, and about sound ones.
#include "core/io/file_descriptor.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/temp_folder.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace plausibility_test {

using namespace obscura;
using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

struct Answer {
    int status = -1;
    std::string out, err;
    [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(out); }
};

Answer run(const TempFolder& folder, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), OBSCURA_BINARY_DIR "/tools/obscura");
    ChildProcess child(folder.path(), "obscura", arguments);
    const int status = child.wait(200s).value_or(-1);
    return {status, child.out(), child.err()};
}

/// Words of the warnings of one camera, but for the one that depends on the machine's load.
std::set<std::string> oddities(const nlohmann::json& camera) {
    std::set<std::string> words;
    for (const auto& warning : camera["warnings"])
        if (warning["what"] != "render_time") words.insert(warning["what"]);
    return words;
}

/// `text` with each `from` replaced, which must be there.
std::string with(std::string text, const std::vector<std::pair<std::string, std::string>>& changes) {
    for (const auto& [from, to] : changes) {
        REQUIRE(text.find(from) != std::string::npos);
        text.replace(text.find(from), from.size(), to);
    }
    return text;
}

// A sphere of 1000 m, 10 km before the camera, lit from behind it; half of the full well.
const std::string sound_scene = R"(name = "sound"
[sun]
direction = [0.5, -0.8660254, 0]
distance_au = 1
[stars]
catalogue = "STARS"
limiting_magnitude = 6.0
[camera]
width = 128
height = 96
pixel_pitch_um = 5.5
focal_length_mm = 3
aperture_mm = 1.5
position_m = [0, -10000, 0]
boresight = [0, 1, 0]
up = [0, 0, 1]
[[body]]
name = "ball"
shape = "ellipsoid"
radii_m = [500, 500, 500]
material = "lambert"
albedo = 0.1
)";
const std::string stars = "[stars]\ncatalogue = \"STARS\"\nlimiting_magnitude = 6.0\n";
const std::string sphere = "shape = \"ellipsoid\"\nradii_m = [500, 500, 500]\n";

const std::string sound_configuration = R"([scene]
file = "scene.toml"
[daemon]
run = 1
[trigger]
rate_hz = 5
[camera]
exposure_us = 100
[gige]
enabled = false
[sensor]
pixel_pitch_um = 5.5
[sensor.readout]
width = 128
height = 96
pixel_clock_hz = 5e6
[sensor.detector]
full_well_e = 50000
gain_dn_per_e = 0.08
)";

/// An octahedron with its corners `radius` from the origin.
std::string octahedron(double radius) {
    const std::string r = std::to_string(radius), n = "-" + r;
    std::string text;
    for (const std::string& x : {r, n})
        text += "v " + x + " 0 0\nv 0 " + x + " 0\nv 0 0 " + x + "\n";
    for (const char* face : {"1 2 3", "2 4 3", "4 5 3", "5 1 3", "2 1 6", "4 2 6", "5 4 6", "1 5 6"})
        text += std::string("f ") + face + "\n";
    return text;
}

std::string write_scene(const TempFolder& folder, std::string text) {
    const std::string catalogue = OBSCURA_SOURCE_DIR "/config/stars/bright.csv";
    while (text.find("STARS") != std::string::npos)
        text.replace(text.find("STARS"), 5, catalogue);
    return folder.write("scene.toml", text);
}

std::string write_both(const TempFolder& folder, const std::string& scene, const std::string& configuration) {
    write_scene(folder, scene);
    return folder.write("camera.toml", configuration);
}

} // namespace

TEST_CASE("check gives the figures of a sound configuration and no warning") {
    const TempFolder folder;
    const std::string config = write_both(folder, sound_scene, sound_configuration);
    const Answer answer = run(folder, {"check", "--json", "--strict", "--quick", config});
    INFO(answer.err);
    REQUIRE(answer.status == 0);
    const nlohmann::json camera = answer.json()["cameras"][0];
    CHECK(camera["warnings"].empty());
    // 128 pixels of 5.5 um at 3 mm.
    CHECK_THAT(camera["field_of_view_deg"][0], WithinRel(2 * std::atan(0.352 / 3) * 180 / M_PI, 1e-9));
    CHECK_THAT(camera["field_of_view_deg"][1], WithinRel(2 * std::atan(0.264 / 3) * 180 / M_PI, 1e-9));
    CHECK_THAT(camera["pixel_scale_arcsec"], WithinRel(5.5e-3 / 3 * 180 / M_PI * 3600, 1e-6));
    const nlohmann::json ball = camera["bodies"][0];
    CHECK_THAT(ball["extent_m"], WithinRel(1000.0, 1e-9));
    CHECK_THAT(ball["distance_m"], WithinRel(10'000.0, 1e-9));
    CHECK_THAT(ball["extent_px"], WithinRel(2 * std::asin(0.05) * 3 / 5.5e-3, 0.03));
    // The surface is 9500 m away.
    CHECK_THAT(ball["m_per_px"], WithinRel(9500 * 5.5e-3 / 3, 1e-6));
    CHECK_THAT(ball["phase_deg"], WithinAbs(30, 0.01));
    CHECK(ball["in_field"] == true);
    CHECK(camera["stars_in_field"].get<int>() > 3);
    CHECK(camera["faintest_star_v"].get<double>() <= 6.0);
    CHECK(camera["faintest_star_v"].get<double>() > 4.0);
    CHECK(camera["timing"]["trigger_period_ms"] == 200);
    CHECK_FALSE(camera.contains("signal")); // --quick renders nothing
}

TEST_CASE("the expected signal of check is that of the frames") {
    const TempFolder folder;
    const std::string config = write_both(folder, sound_scene, sound_configuration);
    const nlohmann::json checked = run(folder, {"check", "--json", config}).json()["cameras"][0];
    const std::string frames = folder.path() / "frames";
    const Answer captured = run(folder, {"capture", config, "-o", frames, "--json", "--strict"});
    INFO(captured.err);
    REQUIRE(captured.status == 0);
    const nlohmann::json made = captured.json()["plausibility"];
    const double expected = checked["signal"]["brightest_e"];
    CHECK(expected > 5000);
    CHECK(expected < 45'000);
    CHECK_THAT(made["signal"]["brightest_e"], WithinRel(expected, 0.02));
    CHECK(checked["signal"]["saturated_share"] == 0);
    CHECK(checked["signal"]["rows_share"] == 1);
    CHECK(checked["rendering"]["estimated_ms"].get<double>() > 0);
    CHECK(oddities(checked).empty());
    CHECK(oddities(made).empty());
}

TEST_CASE("each oddity of a configuration has its warning and no other") {
    struct Case {
        std::string what;
        std::vector<std::pair<std::string, std::string>> scene, configuration;
        std::string says; ///< in the warning
    };
    const std::vector<Case> cases{
        {"mesh_unit", {{sphere, "shape = \"mesh\"\nfile = \"rock.obj\"\n"}}, {}, "600 mm across"},
        {"focal_length",
         {{"focal_length_mm = 3", "focal_length_mm = 0.12"}},
         {},
         "Try focal_length_mm = 120"},
        {"camera_inside",
         {{"position_m = [0, -10000, 0]", "position_m = [0, -400, 0]"}},
         {},
         "inside \"ball\""},
        {"behind_camera", {{"boresight = [0, 1, 0]", "boresight = [0, -1, 0]"}}, {}, "behind the camera"},
        {"outside_field", {{"boresight = [0, 1, 0]", "boresight = [1, 1, 0]"}}, {}, "45 deg"},
        {"nothing_in_field",
         {{stars, ""}, {sound_scene.substr(sound_scene.find("[[body]]")), ""}},
         {},
         "no body and no star"},
        {"leap_seconds",
         {{"name = \"sound\"", "name = \"sound\"\nepoch = \"2199-01-01T00:00:00Z\""}},
         {},
         "expire"},
        {"pose_age",
         {{"radii_m = [500, 500, 500]\n", "radii_m = [500, 500, 500]\nattitude = \"turn.csv\"\n"}},
         {},
         "the attitudes of \"ball\" are known for other times (100 s to 200 s): at scene time 0 s they are 100 s away"},
        {"pose_age",
         {{"radii_m = [500, 500, 500]\n", "radii_m = [500, 500, 500]\ntrajectory = \"way.csv\"\n"}},
         {},
         "the poses of \"ball\" are known for other times (100 s to 200 s): at scene time 0 s they are 100 s away"},
        {"preset_range",
         {{"material = \"lambert\"", "material = \"callisto\""}},
         {},
         "\"ball\" has material = \"callisto\", which is known from 360 to 860 nm, at phase angles of 0 to 12 deg (Harris 1961, Morrison and Morrison 1977), and is seen at a phase angle of 30 deg"},
        {"attitude_instant",
         {{"radii_m = [500, 500, 500]\n", "radii_m = [500, 500, 500]\nattitude = \"once.csv\"\n"}},
         {},
         "the attitude of \"ball\" is known at one instant only, scene time 0 s"},
        {"no_star",
         {{"focal_length_mm = 3", "focal_length_mm = 60"}, {"[500, 500, 500]", "[20, 20, 20]"}},
         {},
         "no star"},
        {"dark", {{"distance_au = 1", "distance_au = 1000"}}, {}, "the frame is dark"},
        {"saturated", {}, {{"exposure_us = 100", "exposure_us = 2000"}}, "try exposure_us"},
        {"readout",
         {},
         {{"pixel_clock_hz = 5e6", "shutter = \"global\"\npixel_clock_hz = 5e4"}},
         "triggers come every 200 ms"},
    };
    for (const Case& c : cases) {
        INFO(c.what);
        const TempFolder folder;
        folder.write("rock.obj", octahedron(0.3));
        folder.write("way.csv", "time_s,x_m,y_m,z_m\n100,0,0,0\n200,0,0,1\n");
        folder.write("turn.csv", "time_s,qw,qx,qy,qz\n100,1,0,0,0\n200,0,0,0,1\n");
        folder.write("once.csv", "time_s,qw,qx,qy,qz\n0,1,0,0,0\n");
        const std::string config =
            write_both(folder, with(sound_scene, c.scene), with(sound_configuration, c.configuration));
        const Answer answer = run(folder, {"check", "--json", config});
        INFO(answer.err);
        REQUIRE(answer.status == 0);
        const nlohmann::json camera = answer.json()["cameras"][0];
        INFO(camera.dump(1));
        CHECK(oddities(camera).contains(c.what));
        CHECK_THAT(answer.err, ContainsSubstring("obscura check: warning: "));
        CHECK_THAT(answer.err, ContainsSubstring(c.says));
        // A camera inside of a body sees no star, and the dark inner side of the body.
        if (c.what != "camera_inside") CHECK(oddities(camera) == std::set<std::string>{c.what});
        CHECK(run(folder, {"check", "--strict", config}).status == 1);
    }
}

TEST_CASE("an exposure that the sensor cannot make is no cure for saturation") {
    const TempFolder folder;
    // The rows of a rolling shutter take 2.56 ms each.
    const std::string config =
        write_both(folder, sound_scene, with(sound_configuration, {{"hz = 5e6", "hz = 5e4"}}));
    const Answer answer = run(folder, {"check", config});
    CHECK_THAT(answer.err, ContainsSubstring("the sensor exposes for 256"));
}

TEST_CASE("a mesh in kilometres is no dot once its unit is declared") {
    const TempFolder folder;
    folder.write("rock.obj", octahedron(0.3));
    const std::string scene = write_scene(
        folder,
        with(sound_scene, {{sphere, "shape = \"mesh\"\nfile = \"rock.obj\"\nmetres_per_unit = 1000\n"}}));
    const Answer answer = run(folder, {"check", "--strict", scene});
    INFO(answer.err);
    CHECK(answer.status == 0);
    CHECK_THAT(answer.out, ContainsSubstring("600 m across, 10 km away"));
}

TEST_CASE("a camera inside a mesh gives a warning, one outside within its bounding sphere none") {
    const TempFolder folder;
    folder.write("rock.obj", octahedron(1000));
    const auto words = [&](const std::string& position) {
        const std::string scene =
            write_scene(folder, with(sound_scene, {{sphere, "shape = \"mesh\"\nfile = \"rock.obj\"\n"},
                                                   {"[0, -10000, 0]", position}}));
        return oddities(run(folder, {"check", "--json", "--quick", scene}).json()["cameras"][0]);
    };
    CHECK(words("[100, -200, 50]").contains("camera_inside"));
    // Inside the bounding sphere, outside the octahedron.
    CHECK_FALSE(words("[500, -500, 500]").contains("camera_inside"));
}

TEST_CASE("rendering that takes longer than the trigger period is a warning") {
    const TempFolder folder;
    const std::string config =
        write_both(folder, sound_scene,
                   with(sound_configuration, {{"rate_hz = 5", "rate_hz = 5000"},
                                              {"[camera]", "[render]\nsamples_per_pixel = 1024\n[camera]"}}));
    const Answer answer = run(folder, {"check", config});
    CHECK(answer.status == 0);
    CHECK_THAT(answer.err, ContainsSubstring("rendering takes this machine"));
    CHECK_THAT(answer.err, ContainsSubstring("triggers come every 0.2 ms"));
}

TEST_CASE("render and capture warn before they begin, and stop there with --strict") {
    const TempFolder folder;
    const std::string scene =
        with(sound_scene, {{"boresight = [0, 1, 0]", "boresight = [0, -1, 0]"}, {stars, ""}});
    const std::string config = write_both(folder, scene, sound_configuration);
    const std::string file = folder.path() / "scene.toml", picture = folder.path() / "picture.fits";
    const Answer rendered = run(folder, {"render", file, "-o", picture, "--json"});
    CHECK(rendered.status == 0);
    CHECK_THAT(rendered.err, ContainsSubstring("obscura render: warning: no body is in the field"));
    CHECK(oddities(rendered.json()["plausibility"]) == std::set<std::string>{"behind_camera"});
    std::filesystem::remove(picture);
    CHECK(run(folder, {"render", file, "-o", picture, "--strict"}).status == 1);
    CHECK_FALSE(std::filesystem::exists(picture));

    const std::string frames = folder.path() / "frames";
    const Answer captured = run(folder, {"capture", config, "-o", frames});
    CHECK(captured.status == 0);
    CHECK_THAT(captured.err, ContainsSubstring("obscura capture: warning: no body is in the field"));
    CHECK_THAT(captured.out, ContainsSubstring("brightest signal"));
    CHECK(run(folder, {"capture", config, "-o", frames, "--strict"}).status == 1);
}

TEST_CASE("render warns where a frame needs more tiles than there is room for") {
    const TempFolder folder;
    const std::string scene = with(
        sound_scene,
        {{stars, ""},
         {sphere, "shape = \"planet\"\nradii_m = [500, 500, 500]\ntile_memory_mib = 128\ncell_px = 0.1\n"},
         {"width = 128\nheight = 96", "width = 256\nheight = 256"},
         {"focal_length_mm = 3", "focal_length_mm = 30"}});
    write_scene(folder, scene);
    const std::string picture = folder.path() / "picture.fits";
    const auto rendered = [&](const char* samples) {
        return run(folder,
                   {"render", folder.path() / "scene.toml", "-o", picture, "--samples", samples, "--json"});
    };
    const Answer crowded = rendered("4");
    CHECK(oddities(crowded.json()["plausibility"]) == std::set<std::string>{"tile_memory"});
    CHECK_THAT(crowded.err, ContainsSubstring("tiles of the surface of ball, and there is room for"));
    write_scene(folder, with(scene, {{"cell_px = 0.1", "cell_px = 1"}}));
    CHECK(oddities(rendered("4").json()["plausibility"]).empty());
}

TEST_CASE("the shipped configurations and scenes are free of oddities") {
    const TempFolder folder;
    for (const char* file : {"demo.toml", "realtime.toml", "scenes/demo.toml", "scenes/realtime.toml"}) {
        const Answer answer =
            run(folder, {"check", "--json", std::string(OBSCURA_SOURCE_DIR "/config/") + file});
        INFO(file << '\n' << answer.err);
        REQUIRE(answer.status == 0);
        CHECK(oddities(answer.json()["cameras"][0]).empty());
    }
}

TEST_CASE("check --devices says what the daemon would find") {
    const TempFolder folder;
    const auto state_of = [](const Answer& answer, const std::string& device) {
        const nlohmann::json all = answer.json();
        for (const auto& trial : all["devices"])
            if (trial["device"].get<std::string>().starts_with(device))
                return trial["state"].get<std::string>();
        return std::string("-");
    };
    const auto check = [&](const std::string& more) {
        const std::string config = write_both(
            folder, sound_scene, with(sound_configuration, {{"[gige]\nenabled = false\n", ""}}) + more);
        return run(folder, {"check", "--devices", "--quick", "--json", config});
    };
    const Answer sound =
        check("[gige]\ninterface = \"127.77.3.1\"\n[file]\nenabled = true\ndirectory = \"new/frames\"\n");
    INFO(sound.out << sound.err);
    CHECK(sound.status == 0);
    CHECK(state_of(sound, "gige.interface 127.77.3.1") == "ok");
    CHECK(state_of(sound, "gige.port 3956") == "ok");
    CHECK(state_of(sound, "file.directory") == "ok");
    CHECK_FALSE(std::filesystem::exists(folder.path() / "new"));

    // A port that another program has.
    const FileDescriptor taken(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(3956);
    REQUIRE(inet_pton(AF_INET, "127.77.3.1", &address.sin_addr) == 1);
    REQUIRE(::bind(taken.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    const Answer busy = check("[gige]\ninterface = \"127.77.3.1\"\n");
    CHECK(busy.status == 69);
    CHECK(state_of(busy, "gige.port 3956") == "failed");
    CHECK_THAT(busy.out, ContainsSubstring("ss -lnp"));

    const Answer missing = check(R"([gige]
interface = "nosuch0"
[v4l2]
enabled = true
device = "/dev/video-not-there"
[outputs]
exposure = "no-such-line"
[stimulator]
enabled = true
vendor_id = 1
product_id = 2
)");
    INFO(missing.out << missing.err);
    CHECK(missing.status == 69);
    CHECK(state_of(missing, "gige.interface nosuch0") == "failed");
    CHECK(state_of(missing, "v4l2.device /dev/video-not-there") == "missing");
    CHECK(state_of(missing, "outputs.exposure no-such-line") == "failed");
    CHECK(state_of(missing, "stimulator 0001:0002") == "missing");
}

TEST_CASE("check --devices tries the sources of triggers") {
    const TempFolder folder;
    const FileDescriptor taken(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::bind(taken.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    socklen_t size = sizeof address;
    REQUIRE(::getsockname(taken.get(), reinterpret_cast<sockaddr*>(&address), &size) == 0);
    const std::string config = write_both(
        folder, sound_scene,
        with(sound_configuration, {{"rate_hz = 5\n", "rate_hz = 5\nsource = \"udp\"\nlisten = \"127.0.0.1:" +
                                                         std::to_string(ntohs(address.sin_port)) + "\"\n"}}));
    const Answer busy = run(folder, {"check", "--devices", "--quick", config});
    CHECK(busy.status == 69);
    CHECK_THAT(busy.out, ContainsSubstring("trigger.source udp"));
    CHECK_THAT(busy.out, ContainsSubstring("failed: "));
    // The scene alone needs nothing of the machine.
    CHECK(run(folder, {"check", "--devices", folder.path() / "scene.toml"}).status == 64);
}

} // namespace plausibility_test
