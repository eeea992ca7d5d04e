// SPDX-License-Identifier: Apache-2.0
// Several sensor windows in one image: registers, description, leaders and chunks agree on its size, as seen
// by libaravis and by GStreamer.
#include "emulator/daemon/daemon.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

namespace gige_composed_test {

using namespace obscura;
using namespace obscura::test;
using namespace std::chrono_literals;

namespace {

/// Two windows that make an image of 256 x 456 pixels, on a sensor of 300 rows.
constexpr const char* two_windows = R"([[camera.window]]
width = 200
height = 200
offset_x = 20
offset_y = 40
[[camera.window]]
width = 256
height = 256
offset_y = 44
)";

DaemonOptions options_at(int number, const std::string& windows) {
    DaemonOptions options;
    options.address = own_address(number);
    options.size = 300;
    options.rate_hz = 20;
    options.more = windows;
    return options;
}

/// A daemon with these windows, and a client in control of its camera.
struct Bench {
    TempFolder folder;
    emulator::Daemon daemon;
    GigeClient client;

    explicit Bench(const DaemonOptions& options)
        : daemon(emulator::load_config(write_configuration(folder, options))),
          client(started(daemon, options.address)) {}
    Bench(int number, const std::string& windows) : Bench(options_at(number, windows)) {}
    static const std::string& started(emulator::Daemon& daemon, const std::string& address) {
        daemon.start();
        return address;
    }
};

bool locked(GigeClient& client, const char* feature) {
    ArvGcNode* node = arv_gc_get_node(arv_device_get_genicam(client.device()), feature);
    REQUIRE(node != nullptr);
    GError* error = nullptr;
    const bool is_locked = arv_gc_feature_node_is_locked(ARV_GC_FEATURE_NODE(node), &error) != FALSE;
    check(error, feature);
    return is_locked;
}

std::int64_t largest(GigeClient& client, const char* feature) {
    GError* error = nullptr;
    std::int64_t minimum = 0, maximum = 0;
    arv_camera_get_integer_bounds(client.camera(), feature, &minimum, &maximum, &error);
    check(error, feature);
    CHECK(minimum <= client.integer(feature));
    return maximum;
}

/// Bytes of one block, received into a buffer with room for more.
struct Received {
    Object<ArvBuffer> buffer;
    std::size_t bytes = 0;
};
Received receive_one(GigeClient& client) {
    const auto room = 2 * static_cast<std::size_t>(client.integer("PayloadSize"));
    client.open_stream(0);
    for (int i = 0; i < 4; ++i)
        arv_stream_push_buffer(client.stream(), arv_buffer_new_allocate(room));
    client.execute("AcquisitionStart");
    Received one{client.next(10'000)};
    client.execute("AcquisitionStop");
    client.close_stream();
    REQUIRE(one.buffer != nullptr);
    REQUIRE(arv_buffer_get_status(one.buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
    arv_buffer_get_data(one.buffer.get(), &one.bytes);
    return one;
}

} // namespace

TEST_CASE("while windows are composed, size and payload are those of the image that is sent") {
    Bench bench(1, two_windows);
    GigeClient& client = bench.client;
    for (const char* selected : {"Region1", "Region0"}) { // whichever is selected: there is one image
        client.set("RegionSelector", selected);
        CHECK(client.integer("Width") == 256);
        CHECK(client.integer("Height") == 456);
        CHECK(largest(client, "Width") >= 256);
        CHECK(largest(client, "Height") >= 456);
    }
    CHECK(client.integer("WidthMax") == 300);
    CHECK(client.integer("HeightMax") >= 456);
    for (const bool chunks : {false, true})
        for (const char* format : {"Mono8", "Mono16", "Mono12p"}) {
            CAPTURE(chunks, format);
            client.set("PixelFormat", format);
            client.set_flag("ChunkModeActive", chunks);
            for (const char* chunk : {"Width", "Height", "OffsetX", "OffsetY", "RowTimes"}) {
                client.set("ChunkSelector", chunk);
                client.set_flag("ChunkEnable", chunks);
            }
            client.set_flag("GevSCCFGExtendedChunkData", chunks);
            const auto [buffer, bytes] = receive_one(client);
            CHECK(static_cast<std::int64_t>(bytes) == client.integer("PayloadSize"));
            gint x = 0, y = 0, width = 0, height = 0;
            arv_buffer_get_image_region(buffer.get(), &x, &y, &width, &height);
            CHECK(x == client.integer("OffsetX"));
            CHECK(y == client.integer("OffsetY"));
            CHECK(width == client.integer("Width"));
            CHECK(height == client.integer("Height"));
            if (!chunks) continue;
            const Object<ArvChunkParser> parser(arv_camera_create_chunk_parser(client.camera()));
            for (const char* chunk : {"Width", "Height", "OffsetX", "OffsetY"}) {
                GError* error = nullptr;
                CHECK(arv_chunk_parser_get_integer_value(parser.get(), buffer.get(),
                                                         fmt::format("Chunk{}", chunk).c_str(),
                                                         &error) == client.integer(chunk));
                check(error, chunk);
            }
        }
}

TEST_CASE("the size of a composed image can be read only, and its windows can wander") {
    Bench bench(2, two_windows);
    emulator::Daemon& daemon = bench.daemon;
    GigeClient& client = bench.client;
    CHECK(locked(client, "Width"));
    CHECK(locked(client, "Height"));
    CHECK_FALSE(locked(client, "OffsetX"));
    CHECK_THROWS(client.set("Width", std::int64_t{128}));
    CHECK_THROWS(client.set("Height", std::int64_t{100}));
    client.set("Width", std::int64_t{256}); // as it is: clients write back what they have read
    client.set("Height", std::int64_t{456});
    CHECK(daemon.camera().settings().window(0).region == Region{20, 40, 200, 200});
    CHECK(largest(client, "OffsetX") == 100);
    CHECK(largest(client, "OffsetY") == 100);
    client.set("OffsetX", std::int64_t{100});
    client.set("OffsetY", std::int64_t{7});
    CHECK(daemon.camera().settings().window(0).region == Region{100, 7, 200, 200});
    client.set("RegionSelector", "Region1");
    CHECK(locked(client, "Height"));
    CHECK(client.integer("OffsetY") == 44);
    CHECK(largest(client, "OffsetX") == 44);

    // A region is set while it is off.
    client.set("RegionMode", "Off");
    CHECK_FALSE(locked(client, "Width"));
    CHECK(client.integer("Width") == 256); // that of the region: it takes no part in the image
    client.set("Width", std::int64_t{60});
    client.set("Height", std::int64_t{50});
    client.set("RegionSelector", "Region0");
    CHECK_FALSE(locked(client, "Width")); // one window only
    CHECK(client.integer("Width") == 200);
    CHECK(client.integer("Height") == 200);
    CHECK(client.integer("HeightMax") == 300);
    client.set("Width", std::int64_t{40});
    client.set("RegionSelector", "Region1");
    client.set("RegionMode", "On");
    CHECK(client.integer("Width") == 60);
    CHECK(client.integer("Height") == 250);
    CHECK(client.integer("PayloadSize") == 60 * 250 * 2);
}

TEST_CASE("several reads of one window are one image, too") {
    Bench bench(3,
                "[[camera.window]]\nwidth = 120\nheight = 50\noffset_y = 30\nsampling = \"non-destructive\"\n"
                "reads = 4\n");
    GigeClient& client = bench.client;
    CHECK(client.integer("Width") == 120);
    CHECK(client.integer("Height") == 200);
    CHECK(locked(client, "Height"));
    const auto [buffer, bytes] = receive_one(client);
    CHECK(arv_buffer_get_image_height(buffer.get()) == 200);
    CHECK(static_cast<std::int64_t>(bytes) == client.integer("PayloadSize"));
}

TEST_CASE("a window that the chip crops has the size that is read") {
    Bench bench(7, "strict = false\n[[camera.window]]\nwidth = 200\nheight = 100\noffset_x = 220\n");
    GigeClient& client = bench.client;
    CHECK(client.integer("Width") == 80);
    CHECK(largest(client, "OffsetX") == 220);
    const auto [buffer, bytes] = receive_one(client);
    CHECK(arv_buffer_get_image_width(buffer.get()) == 80);
    CHECK(static_cast<std::int64_t>(bytes) == client.integer("PayloadSize"));
    client.set("OffsetX", std::int64_t{100}); // the window is kept as it was set
    CHECK(client.integer("Width") == 200);
}

TEST_CASE("with multi-part payload every region keeps its own size, and the payload is their sum") {
    Bench bench(4, two_windows);
    GigeClient& client = bench.client;
    client.set_flag("GevSCCFGMultiPart", true);
    CHECK(locked(client, "BinningHorizontal"));
    constexpr std::array<Region, 2> own{Region{20, 40, 200, 200}, Region{0, 44, 256, 256}};
    for (const bool chunks : {false, true}) {
        CAPTURE(chunks);
        client.set_flag("ChunkModeActive", chunks);
        client.set("ChunkSelector", "RowTimes");
        client.set_flag("ChunkEnable", chunks);
        const auto [buffer, bytes] = receive_one(client);
        std::size_t sum = 0;
        for (guint p = 0; p < arv_buffer_get_n_parts(buffer.get()); ++p) {
            std::size_t part = 0;
            arv_buffer_get_part_data(buffer.get(), p, &part);
            sum += part;
        }
        CHECK(static_cast<std::int64_t>(sum) == client.integer("PayloadSize"));
        REQUIRE(arv_buffer_get_n_parts(buffer.get()) == own.size() + (chunks ? 1 : 0));
        for (guint p = 0; p < own.size(); ++p) {
            client.set("RegionSelector", fmt::format("Region{}", p).c_str());
            CHECK_FALSE(locked(client, "Width"));
            CHECK(Region{static_cast<int>(client.integer("OffsetX")),
                         static_cast<int>(client.integer("OffsetY")),
                         static_cast<int>(client.integer("Width")),
                         static_cast<int>(client.integer("Height"))} == own[p]);
            CHECK(arv_buffer_get_part_width(buffer.get(), p) == own[p].width);
            CHECK(arv_buffer_get_part_height(buffer.get(), p) == own[p].height);
            CHECK(arv_buffer_get_part_x(buffer.get(), p) == own[p].x);
            CHECK(arv_buffer_get_part_y(buffer.get(), p) == own[p].y);
        }
    }
    client.set("RegionSelector", "Region0");
    client.set("Height", std::int64_t{100});
    client.set_flag("GevSCCFGMultiPart", false);
    CHECK(client.integer("Height") == 356);
}

TEST_CASE("another camera's description shows the size of the composed image, too") {
    DaemonOptions options = options_at(8, two_windows);
    options.gige_more = "xml = \"" OBSCURA_SOURCE_DIR "/tests/support/flight_camera.xml\"\n";
    Bench bench(options);
    GigeClient& client = bench.client;
    CHECK(client.integer("Width") == 256);
    CHECK(client.integer("Height") == 456);
    CHECK(client.integer("PayloadSize") == 256 * 456 * 2);
    CHECK_THROWS(client.set("Height", std::int64_t{200}));
    CHECK(client.integer("Height") == 456);
}

TEST_CASE("user sets hold the windows, not the size of their image") {
    Bench bench(5, two_windows);
    emulator::Daemon& daemon = bench.daemon;
    GigeClient& client = bench.client;
    const CameraSettings configured = daemon.camera().settings();
    client.set("OffsetY", std::int64_t{10});
    client.set("UserSetSelector", "UserSet1");
    client.execute("UserSetSave");
    client.set("UserSetSelector", "Default");
    client.execute("UserSetLoad");
    CHECK(daemon.camera().settings() == configured);
    client.set("UserSetSelector", "UserSet1");
    client.execute("UserSetLoad");
    CHECK(daemon.camera().settings().window(0).region == Region{20, 10, 200, 200});
    CHECK(daemon.camera().settings().window(1).region == Region{0, 44, 256, 256});
}

TEST_CASE("GStreamer gets as many bytes as its caps say") {
    const std::string launch = "/usr/bin/gst-launch-1.0", inspect = "/usr/bin/gst-inspect-1.0";
    const TempFolder folder;
    const std::vector<std::string> environment{"GST_REGISTRY=" + (folder.path() / "gst.registry").string()};
    const auto there = [&] {
        if (!std::filesystem::exists(launch) || !std::filesystem::exists(inspect)) return false;
        ChildProcess look(folder.path(), "inspect", {inspect, "aravissrc"}, environment);
        return look.wait(60s) == 0;
    };
    if (!there()) {
        std::cout << "SKIPPED: no gst-launch-1.0 (gstreamer1.0-tools) with aravissrc (libaravis-0.8-0)\n";
        return;
    }
    DaemonOptions options = options_at(6, two_windows);
    options.camera_more = "pixel_format = \"Mono8\"\n";
    DaemonProcess daemon(folder, write_configuration(folder, options));
    REQUIRE(daemon.wait_ready());
    constexpr int frames = 5;
    const std::filesystem::path file = folder.path() / "frames.raw";
    ChildProcess gst(folder.path(), "gst",
                     {launch, "-v", "aravissrc", "camera-name=" + options.address,
                      fmt::format("num-buffers={}", frames), "!", "capsfilter", "!", "filesink",
                      "location=" + file.string()},
                     environment);
    const auto status = gst.wait(60s);
    INFO(gst.out() << gst.err());
    REQUIRE(status == 0);
    CHECK_THAT(gst.out(), Catch::Matchers::ContainsSubstring("format=(string)GRAY8"));
    CHECK_THAT(gst.out(), Catch::Matchers::ContainsSubstring("width=(int)256"));
    CHECK_THAT(gst.out(), Catch::Matchers::ContainsSubstring("height=(int)456"));
    CHECK(std::filesystem::file_size(file) == std::uintmax_t{frames} * 256 * 456);
}

} // namespace gige_composed_test
