// SPDX-License-Identifier: Apache-2.0
// The whole way of a frame: clock -> scene -> detector -> GigE Vision -> libaravis in another process, and
// the same frames made again without any of that.
#include "emulator/config/daemon_config.hpp"
#include "emulator/unit/assemble.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <fitsio.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

using namespace obscura;
using namespace obscura::test;
using namespace std::chrono_literals;
using Catch::Matchers::ContainsSubstring;

namespace {

using Json = nlohmann::json;

#ifdef OBSCURA_SANITIZED
constexpr int stream_frames = 20; // a frame takes ten times as long then
#else
constexpr int stream_frames = 100;
#endif

const std::string obscura_program = OBSCURA_BINARY_DIR "/tools/obscura";

ChildProcess grab(const TempFolder& folder, const std::string& address, int frames,
                  const std::string& output) {
    std::vector<std::string> arguments{
        obscura_program, "grab", "--address",     address, "--frames", std::to_string(frames),
        "--timeout",     "30",   "--packet-size", "8000",  "--json"};
    if (!output.empty())
        arguments.insert(arguments.end(), {"--format", "raw", "--output", (folder.path() / output).string()});
    return ChildProcess(folder.path(), "grab", arguments);
}

std::filesystem::path frame_file(const TempFolder& folder, const std::string& output, int number) {
    return folder.path() / output / fmt::format("frame_{:06}.raw", number);
}

// Number of frames 1..n that differ from what the configuration gives offline, in this process.
int count_different(const TempFolder& folder, const std::filesystem::path& configuration,
                    const std::string& output, int frames) {
    const emulator::DaemonConfig config = emulator::load_config(configuration);
    const emulator::Imaging imaging(config, 1);
    int different = 0;
    for (int number = 1; number <= frames; ++number) {
        const FrameRef frame = imaging.pool->acquire();
        REQUIRE(
            imaging.maker->make(imaging.nominal_order(static_cast<std::uint64_t>(number)), *frame).empty());
        const std::string received = text_of(frame_file(folder, output, number));
        const auto pixels = frame->pixels();
        const bool same = received.size() == pixels.size_bytes() &&
                          std::memcmp(received.data(), pixels.data(), received.size()) == 0;
        if (!same) ++different;
    }
    return different;
}

// The catalogue of 125,982 Hipparcos stars (fixed columns, see the data's README) as our CSV table.
std::filesystem::path star_table(const TempFolder& folder, const std::filesystem::path& catalogue) {
    gzFile in = gzopen(catalogue.c_str(), "rb");
    REQUIRE(in != nullptr);
    std::string table = "ra_deg,dec_deg,v_mag,b_v\n";
    char line[512];
    int stars = 0;
    while (gzgets(in, line, sizeof line) != nullptr) {
        const std::string l = line;
        if (l.size() < 58 || l[0] == '#') continue;
        const auto number = [&](std::size_t from, std::size_t to) {
            return std::stod(l.substr(from, to - from));
        };
        const double ra = 15 * (number(0, 2) + number(2, 4) / 60 + number(4, 9) / 3600);
        const double dec = number(11, 13) + number(13, 15) / 60 + number(15, 19) / 3600;
        table += fmt::format("{:.6f},{:.6f},{},{}\n", ra, l[10] == '-' ? -dec : dec, number(46, 51),
                             number(51, 56));
        ++stars;
    }
    gzclose(in);
    REQUIRE(stars > 120'000);
    return folder.write("stars.csv", table);
}

struct Outcome {
    Json received, daemon;
};

// Starts the daemon, receives, stops, and demands that every frame arrived whole and as made offline.
Outcome stream_and_compare(const TempFolder& folder, const DaemonOptions& options, int frames) {
    const std::filesystem::path configuration = write_configuration(folder, options);
    DaemonProcess daemon(folder, configuration);
    if (!daemon.wait_ready()) FAIL("not ready: " << daemon.process().err());
    CHECK(daemon.ready_text() == "ready " + options.address + ":3956\n");
    ChildProcess client = grab(folder, options.address, frames, "received");
    const auto status = client.wait(std::chrono::milliseconds(60'000 + 1000 * frames));
    INFO(client.out() << client.err() << daemon.process().err());
    CHECK(status == 0);
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);

    Outcome outcome{Json::parse(client.out()), Json::parse(daemon.statistics())};
    CHECK(outcome.received["frames"] == frames);
    CHECK(outcome.received["incomplete"] == 0);
    CHECK(outcome.received["missing"] == 0);
    // Consecutive numbers from 1: every file is there, and there is no other.
    for (int number = 1; number <= frames; ++number)
        CHECK(std::filesystem::exists(frame_file(folder, "received", number)));
    CHECK_FALSE(std::filesystem::exists(frame_file(folder, "received", frames + 1)));
    CHECK(count_different(folder, configuration, "received", frames) == 0);
    return outcome;
}

} // namespace

TEST_CASE("a hundred triggered frames of 1024 x 1024 arrive whole and are those made offline") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(1);
    const Outcome outcome = stream_and_compare(folder, options, stream_frames);
    ChildProcess capture(folder.path(), "capture",
                         {obscura_program, "capture", (folder.path() / "obscurad.toml").string(), "--frames",
                          std::to_string(stream_frames), "--format", "raw", "--output",
                          (folder.path() / "captured").string()});
    CHECK(capture.wait(300s) == 0);
    int different = 0;
    for (int number = 1; number <= stream_frames; ++number)
        if (text_of(frame_file(folder, "received", number)) !=
            text_of(frame_file(folder, "captured", number)))
            ++different;
    CHECK(different == 0);

    const Json& camera = outcome.daemon["camera"];
    CHECK(camera["frames"] >= stream_frames);
    CHECK(camera["dropped"] == 0);
    CHECK(camera["triggers"] == camera["frames"].get<int>() + camera["missed_triggers"].get<int>());
}

TEST_CASE("the same with Itokawa's measured shape before the stars of Orion") {
    const auto shape = data_file("shapes_celestia49k/obj_km/itokawa_49k.obj");
    const auto stars = data_file("stars/kstars_stars.dat.gz");
    if (!shape || !stars) return;
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(7);
    options.scene =
        folder
            .write("itokawa.toml", fmt::format(R"(name = "itokawa"
[sun]
direction = [-0.80540, -0.36169, 0.46958]
distance_au = 1.3
[stars]
catalogue = "{}"
limiting_magnitude = 8
[camera]
focal_length_mm = 50
aperture_mm = 25
psf_sigma_px = 0.7
position_m = [-1525.72, -14286.92, 804.0]
boresight = [0.10609838, 0.99278754, -0.05582150]
up = [0, 0, 1]
[[body]]
name = "itokawa"
shape = "mesh"
file = "{}"
metres_per_unit = 1000
material = "lommel-seeliger"
albedo = 0.35
spin_axis = [0, 0, 1]
spin_rate_deg_per_s = 2
)",
                                               star_table(folder, *stars).string(), shape->string()))
            .string();
    const Outcome outcome = stream_and_compare(folder, options, stream_frames);
    CHECK(outcome.daemon["camera"]["dropped"] == 0);

    // There is something to see, and it moves: many bright pixels, and the last frame is not the first.
    const std::string first = text_of(frame_file(folder, "received", 1));
    std::vector<std::uint16_t> pixels(first.size() / 2);
    std::memcpy(pixels.data(), first.data(), first.size());
    const auto bright =
        std::count_if(pixels.begin(), pixels.end(), [](std::uint16_t dn) { return dn > 500; });
    CHECK(bright > 2000);
    CHECK(bright < 500'000);
    CHECK((first != text_of(frame_file(folder, "received", stream_frames))));
}

TEST_CASE("several windows arrive as one composed image and are those made offline") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(8);
    options.size = 256;
    // They share rows, and one is delivered read by read: 310 rows, more than the sensor has.
    options.more = R"(window_mode = "interleaved"
[[camera.window]]
width = 64
height = 40
offset_x = 100
offset_y = 90
exposure_us = 700
[[camera.window]]
width = 200
height = 180
offset_x = 20
offset_y = 60
exposure_us = 3000
[[camera.window]]
width = 30
height = 30
offset_x = 110
offset_y = 100
sampling = "non-destructive"
reads = 3
)";
    stream_and_compare(folder, options, 20);
    CHECK(text_of(frame_file(folder, "received", 20)).size() == 2 * 200 * (40 + 180 + 3 * 30));

    // The same offline, with the truth about each pixel.
    ChildProcess capture(folder.path(), "capture",
                         {obscura_program, "capture", (folder.path() / "obscurad.toml").string(), "--first",
                          "20", "--format", "raw", "--truth", "--exr", "--output",
                          (folder.path() / "captured").string()});
    CHECK(capture.wait(60s) == 0);
    CHECK((text_of(frame_file(folder, "received", 20)) == text_of(frame_file(folder, "captured", 20))));
    fitsfile* truth = nullptr;
    int status = 0;
    fits_open_diskfile(&truth, (folder.path() / "captured/truth_000020.fits").c_str(), READONLY, &status);
    REQUIRE(status == 0);
    std::array<long, 2> extent{};
    fits_get_img_size(truth, 2, extent.data(), &status);
    CHECK(extent == std::array<long, 2>{200, 310});
    long windows = 0, rows = 0;
    fits_movnam_hdu(truth, BINARY_TBL, const_cast<char*>("WINDOWS"), 0, &status);
    fits_get_num_rows(truth, &windows, &status);
    std::array<int, 5> reads{}, ys{};
    fits_read_col(truth, TINT, 8, 1, 1, 5, nullptr, reads.data(), nullptr, &status);
    fits_read_col(truth, TINT, 2, 1, 1, 5, nullptr, ys.data(), nullptr, &status);
    fits_movnam_hdu(truth, BINARY_TBL, const_cast<char*>("ROWS"), 0, &status);
    fits_get_num_rows(truth, &rows, &status);
    fits_close_file(truth, &status);
    CHECK(status == 0);
    CHECK(windows == 5);
    CHECK(std::count(reads.begin(), reads.end(), 3) == 3);
    CHECK(std::count(ys.begin(), ys.end(), 60) == 1);
    CHECK(rows == 310);
}

TEST_CASE("with one packet in a hundred left out, resending makes every frame whole") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(2);
    options.rate_hz = 5; // time for several rounds of resending on a busy machine
    options.gige_more = "drop_percent = 1\n";
    const Outcome outcome = stream_and_compare(folder, options, stream_frames);
    const Json& gige = outcome.daemon["transports"]["gige"];
    // 263 packets of 8000 bytes a frame: about 2.6 losses a frame.
    CHECK(gige["injected_losses"] > stream_frames);
    CHECK(gige["resent_packets"] >= gige["injected_losses"].get<int>() / 2);
    CHECK(outcome.received["resent_packets"] > stream_frames);
}

TEST_CASE("packets that are only late are no losses, and grab and the daemon count the same") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(9);
    options.size = 256;
    options.rate_hz = 5;
    // Twice in a frame of 17 packets the sender stands still for longer than a client's timeout.
    options.gige_more = R"([[gige.faults]]
kind = "delay"
percent = 12
amount = 120000
[[gige.faults]]
kind = "lose"
percent = 5
first = 6
[[gige.faults]]
kind = "corrupt"
percent = 0
)";
    constexpr int frames = 12;
    const Outcome outcome = stream_and_compare(folder, options, frames);
    const Json& grab = outcome.received;
    const Json& gige = outcome.daemon["transports"]["gige"];
    INFO(grab.dump(2) << gige.dump(2));
    CHECK(gige["fault_strikes"]["rule_1_delay"] > 0);
    CHECK(gige["injected_delays"] == gige["fault_strikes"]["rule_1_delay"]);
    CHECK(gige["fault_strikes"]["rule_2_lose"] == gige["injected_losses"]);
    CHECK(gige["fault_strikes"]["rule_3_corrupt"] == 0);
    // What the client asked for is what the camera was asked for, and each packet has its fate.
    const int asked = grab["asked_packets"];
    CHECK(gige["asked_packets"] == asked);
    CHECK(gige["resent_packets"] == grab["resent_packets"]);
    CHECK(gige["asked_before_sent"] == grab["asked_before_sent"]);
    CHECK(gige["refused_packets"] == grab["refused_packets"]);
    CHECK(grab["asked_before_sent"] > 0);
    CHECK(grab["resent_packets"].get<int>() + grab["asked_before_sent"].get<int>() +
              grab["refused_packets"].get<int>() ==
          asked);
    CHECK(grab["missing_packets"] == 0);
}

TEST_CASE("a client that vanishes in the middle of the stream leaves a camera for the next one") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(3);
    options.size = 256;
    options.rate_hz = 20;
    options.gige_more = "heartbeat_timeout_ms = 1000\n";
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    {
        ChildProcess first = grab(folder, options.address, 100'000, "first");
        wait_for_file(frame_file(folder, "first", 5));
        REQUIRE(first.running());
    } // killed
    // Until its heartbeat is missed the camera belongs to the client that is gone.
    bool received = false;
    for (int attempt = 0; attempt < 120 && !received; ++attempt) {
        std::this_thread::sleep_for(500ms);
        ChildProcess second = grab(folder, options.address, 5, "second");
        received = second.wait(60s) == 0;
    }
    CHECK(received);
    CHECK(std::filesystem::exists(frame_file(folder, "second", 1)));
    REQUIRE(daemon.process().running());
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
    // On a busy machine another client may be late with its heartbeat, too.
    CHECK(Json::parse(daemon.statistics())["transports"]["gige"]["control_lost"] >= 1);
}

TEST_CASE("a clock faster than rendering: missed triggers are counted, frames arrive whole") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(4);
    options.size = 512;
    options.rate_hz = 2000;
    const Outcome outcome = stream_and_compare(folder, options, 10);
    CHECK(outcome.daemon["camera"]["missed_triggers"] > 10);
}

TEST_CASE("SIGTERM in the middle of a stream ends the daemon, which waits for no client") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(5);
    options.size = 512;
    options.gige_more = "heartbeat_timeout_ms = 60000\n"; // longer than this waits
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    ChildProcess client = grab(folder, options.address, 100'000, "received");
    wait_for_file(frame_file(folder, "received", 3));
    client.send(SIGSTOP); // reads nothing more, and does not give the camera back
    daemon.process().send(SIGTERM);
    CHECK(daemon.process().wait(120s) == 0);
}

TEST_CASE("a port in use and an interface that is not there are named") {
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(6);
    options.size = 64;
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    DaemonProcess second(folder, write_configuration(folder, options), {}, "second");
    CHECK(second.process().wait(120s) == 69);
    CHECK_THAT(second.process().err(), ContainsSubstring(options.address) && ContainsSubstring("3956"));
    CHECK(second.ready_text().empty());
    CHECK(daemon.process().running());

    options.address = "eth-not-there";
    DaemonProcess third(folder, write_configuration(folder, options), {}, "third");
    CHECK(third.process().wait(120s) == 69);
    CHECK_THAT(third.process().err(), ContainsSubstring("eth-not-there"));
}
