// SPDX-License-Identifier: Apache-2.0
// The camera against an independent client (libaravis) over the loopback interface.
#include "core/clock.hpp"
#include "core/error.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/gige_bench.hpp"
#include "tests/support/pattern_camera.hpp"
#include "transports/gige/channels/fault_injector.hpp"
#include "transports/gige/gige.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <thread>

using namespace obscura;
using namespace obscura::test;
using transports::gige::GigeCamera;
using transports::gige::GigeSettings;

namespace {

#ifdef OBSCURA_SANITIZED
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

const std::string address = own_loopback_address();

CameraLimits limits(std::int32_t width = 256, std::int32_t height = 200) {
    CameraLimits l;
    l.sensor_width = width;
    l.sensor_height = height;
    l.adc_bits = 12;
    return l;
}

/// Camera, pattern generator and connections, taken down in the right order.
struct Bench : GigeBench {
    explicit Bench(const CameraLimits& l, GigeSettings settings = {},
                   transports::gige::GigeContext context = {})
        : GigeBench(l, at(std::move(settings)), std::move(context)) {}
    static GigeSettings at(GigeSettings s) {
        if (s.interface == "lo") s.interface = address;
        return s;
    }
};

std::uint64_t wrong_pixels_16(const ArvBuffer* buffer, std::uint64_t id, const Region& r, int shift) {
    std::size_t bytes = 0;
    const void* data = arv_buffer_get_data(const_cast<ArvBuffer*>(buffer), &bytes);
    std::uint64_t wrong = 0;
    for (std::int32_t y = 0; y < r.height; ++y)
        for (std::int32_t x = 0; x < r.width; ++x) {
            std::uint16_t got = 0;
            std::memcpy(&got,
                        static_cast<const std::uint8_t*>(data) +
                            2 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(r.width) +
                                 static_cast<std::size_t>(x)),
                        2);
            wrong += got != pattern_pixel(id, r.x + x, r.y + y, 12) >> shift;
        }
    return wrong;
}

/// The counters once `frames` frames have left: the last packet may arrive before the sender has counted it.
transports::gige::GigeCounters counters_after(const GigeCamera& camera, std::uint64_t frames) {
    for (int i = 0; i < 12'000 && camera.gige_counters().frames.delivered < frames; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return camera.gige_counters();
}

/// Receives `count` buffers; every one must be complete, in order and correct.
void receive_in_order(GigeClient& client, int count, const Region& region, std::uint64_t first_block = 1) {
    for (std::uint64_t id = 1; id <= static_cast<std::uint64_t>(count); ++id) {
        auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        REQUIRE(arv_buffer_get_frame_id(buffer.get()) == first_block + id - 1);
        REQUIRE(wrong_pixels_16(buffer.get(), id, region, 0) == 0);
        client.give_back(std::move(buffer));
    }
}

} // namespace

TEST_CASE("100 frames arrive complete, in order and unchanged") {
    Bench bench(limits());
    GigeClient client(address);
    client.set("PixelFormat", "Mono16");
    client.set("AcquisitionMode", "Continuous");
    client.set("TriggerMode", "Off");
    client.set("AcquisitionFrameRate", 100.0);
    client.open_stream(8);
    client.execute("AcquisitionStart");
    receive_in_order(client, 100, {0, 0, 256, 200});
    client.execute("AcquisitionStop");
    const auto counters = counters_after(bench.camera, 100);
    CHECK(counters.frames.delivered >= 100);
    CHECK(counters.resent_packets == 0);
    CHECK(counters.trigger_to_first_p50_ns > 0);
}

TEST_CASE("Stopping cuts the block in flight off, and nothing of the old stream leaks into the new") {
    Bench bench(limits());
    bench.source.set_bands(8, 500'000); // a frame takes 12 ms: stop always hits one in flight
    GigeClient client(address);
    client.set("AcquisitionFrameRate", 100.0);
    for (int round = 0; round < 5; ++round) {
        client.open_stream(8); // a new channel: block ids from 1
        client.execute("AcquisitionStart");
        receive_in_order(client, 3, {0, 0, 256, 200});
        client.execute("AcquisitionStop");
        client.close_stream();
    }
    CHECK(bench.source.starts() == 5);
    CHECK(bench.source.pool().in_use() <= 5); // the history
}

TEST_CASE("1 % of packets lost on purpose are recovered by resend") {
    GigeSettings settings;
    settings.drop_percent = 1;
    settings.history_frames = 16; // a starved client asks late
    Bench bench(limits(512, 512), settings);
    GigeClient client(address);
    client.set("AcquisitionFrameRate", 25.0);
    client.open_stream(10);
    client.execute("AcquisitionStart");
    receive_in_order(client, 50, {0, 0, 512, 512});
    client.execute("AcquisitionStop");
    const auto counters = bench.camera.gige_counters();
    // 50 frames of 359 packets: 180 losses expected, with a standard deviation of 13.
    CHECK(counters.injected_losses > 110);
    CHECK(counters.injected_losses < 260);
    CHECK(counters.resent_packets >= counters.injected_losses * 9 / 10);
}

TEST_CASE("Every pixel format carries the digital numbers as PFNC lays them out") {
    Bench bench(limits(64, 48));
    const struct {
        const char* name;
        int bits;
        bool packed;
    } formats[] = {{"Mono8", 8, false},   {"Mono10", 10, false}, {"Mono12", 12, false}, {"Mono14", 14, false},
                   {"Mono16", 16, false}, {"Mono10p", 10, true}, {"Mono12p", 12, true}};
    for (const auto& f : formats) {
        CAPTURE(f.name);
        GigeClient client(address);
        client.set("PixelFormat", f.name);
        client.set("Width", std::int64_t{63}); // an odd width: packed rows do not end on bytes
        client.set("Height", std::int64_t{47});
        const std::size_t expected = f.packed ? (63U * 47U * static_cast<unsigned>(f.bits) + 7) / 8
                                              : 63U * 47U * (f.bits == 8 ? 1U : 2U);
        REQUIRE(static_cast<std::size_t>(client.integer("PayloadSize")) == expected);
        client.open_stream(4);
        client.execute("AcquisitionStart");
        auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        std::size_t bytes = 0;
        const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer.get(), &bytes));
        REQUIRE(bytes == expected);
        std::uint64_t wrong = 0;
        for (std::size_t i = 0; i < 63U * 47U; ++i) {
            const auto x = static_cast<std::int32_t>(i % 63), y = static_cast<std::int32_t>(i / 63);
            const int shift = f.bits < 12 ? 12 - f.bits : 0;
            std::uint32_t got = 0;
            if (f.packed) { // bit by bit, least significant first
                for (std::size_t b = 0; b < static_cast<std::size_t>(f.bits); ++b) {
                    const std::size_t at = i * static_cast<std::size_t>(f.bits) + b;
                    got |= static_cast<std::uint32_t>(data[at / 8] >> at % 8 & 1) << b;
                }
            } else {
                got = f.bits == 8 ? data[i] : static_cast<std::uint32_t>(data[2 * i] | data[2 * i + 1] << 8);
            }
            wrong += got != static_cast<std::uint32_t>(pattern_pixel(1, x, y, 12) >> shift);
        }
        CHECK(wrong == 0);
        client.execute("AcquisitionStop");
    }
}

TEST_CASE("A binned frame is the unbinned one of the same trigger, put together") {
    Bench bench(limits());
    bench.source.set_bands(7, 0); // bands that do not end with binned rows
    const struct {
        const char* name;
        int bits;
    } formats[] = {{"Mono16", 16}, {"Mono12", 12}, {"Mono8", 8}};
    const struct {
        std::int32_t x, y;
        const char *x_mode, *y_mode;
    } binnings[] = {{2, 1, "Sum", "Sum"},         {2, 2, "Sum", "Sum"},     {4, 4, "Sum", "Sum"},
                    {2, 1, "Average", "Average"}, {2, 2, "Average", "Sum"}, {4, 4, "Average", "Average"}};
    for (const auto& f : formats)
        for (const auto& b : binnings) {
            CAPTURE(f.name, b.x, b.y, b.x_mode, b.y_mode);
            GigeClient client(address);
            client.set("PixelFormat", f.name);
            client.set("BinningHorizontal", std::int64_t{b.x});
            client.set("BinningVertical", std::int64_t{b.y});
            client.set("BinningHorizontalMode", b.x_mode);
            client.set("BinningVerticalMode", b.y_mode);
            client.set("OffsetX", std::int64_t{0});
            client.set("OffsetY", std::int64_t{0});
            CHECK(client.integer("WidthMax") == 256 / b.x);
            CHECK(client.integer("HeightMax") == 200 / b.y);
            CHECK_THROWS(client.set("Width", std::int64_t{256 / b.x + 1}));
            const std::int32_t width = 31, height = 21, left = 9, top = 5; // binned pixels
            client.set("Width", std::int64_t{width});
            client.set("Height", std::int64_t{height});
            client.set("OffsetX", std::int64_t{left});
            client.set("OffsetY", std::int64_t{top});
            CHECK(bench.source.settings().region == Region{left * b.x, top * b.y, width * b.x, height * b.y});
            const std::size_t expected = width * height * (f.bits == 8 ? 1U : 2U);
            CHECK(static_cast<std::size_t>(client.integer("PayloadSize")) == expected);
            client.open_stream(4);
            client.execute("AcquisitionStart");
            CHECK_THROWS(client.set("BinningHorizontal", std::int64_t{1}));
            for (std::uint64_t id = 1; id <= 2; ++id) {
                auto buffer = client.next();
                REQUIRE(buffer != nullptr);
                REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
                CHECK(arv_buffer_get_image_width(buffer.get()) == width);
                CHECK(arv_buffer_get_image_height(buffer.get()) == height);
                CHECK(arv_buffer_get_image_x(buffer.get()) == left);
                CHECK(arv_buffer_get_image_y(buffer.get()) == top);
                std::size_t bytes = 0;
                const auto* data =
                    static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer.get(), &bytes));
                REQUIRE(bytes == expected);
                std::uint64_t wrong = 0;
                for (std::int32_t y = 0; y < height; ++y)
                    for (std::int32_t x = 0; x < width; ++x) {
                        double value = 0;
                        for (std::int32_t i = 0; i < b.x * b.y; ++i)
                            value +=
                                pattern_pixel(id, (left + x) * b.x + i % b.x, (top + y) * b.y + i / b.x, 12);
                        if (b.x_mode[0] == 'A') value /= b.x;
                        if (b.y_mode[0] == 'A') value /= b.y;
                        value = std::min(std::floor(value + 0.5), f.bits == 16 ? 65535.0 : 4095.0);
                        const auto at = static_cast<std::size_t>(y * width + x);
                        const int got = f.bits == 8 ? data[at] : data[2 * at] | data[2 * at + 1] << 8;
                        wrong += got != static_cast<int>(value) >> (f.bits == 8 ? 4 : 0);
                    }
                CHECK(wrong == 0);
                client.give_back(std::move(buffer));
            }
            client.execute("AcquisitionStop");
        }
}

TEST_CASE("Chunks and zeros of an abandoned frame are those of the binned image") {
    Bench bench(limits(64, 48));
    bench.source.set_bands(11, 0);
    bench.source.abandon_after(22); // five binned rows and half of a sixth
    GigeClient client(address);
    client.set("BinningHorizontal", std::int64_t{2});
    client.set("BinningVertical", std::int64_t{4});
    client.set("OffsetX", std::int64_t{0});
    client.set("Width", std::int64_t{30});
    client.set("OffsetX", std::int64_t{2});
    client.set_flag("ChunkModeActive", true);
    for (const char* chunk : {"Width", "Height", "OffsetX", "Regions", "RowTimes"}) {
        client.set("ChunkSelector", chunk);
        client.set_flag("ChunkEnable", true);
    }
    client.set_flag("GevSCCFGExtendedChunkData", true);
    client.open_stream(4);
    client.execute("AcquisitionStart");
    auto buffer = client.next();
    REQUIRE(buffer != nullptr);
    REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
    Object<ArvChunkParser> parser(arv_camera_create_chunk_parser(client.camera()));
    const auto integer = [&](const char* name) {
        GError* error = nullptr;
        const gint64 v = arv_chunk_parser_get_integer_value(parser.get(), buffer.get(), name, &error);
        check(error, name);
        return v;
    };
    CHECK(integer("ChunkWidth") == 30);
    CHECK(integer("ChunkHeight") == 12);
    CHECK(integer("ChunkOffsetX") == 2);
    CHECK(integer("ChunkRegionWidth") == 60); // where it lies on the sensor
    CHECK(integer("ChunkRowCount") == 12);
    std::size_t bytes = 0;
    const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer.get(), &bytes));
    REQUIRE(bytes >= 30 * 12 * 2);
    for (std::size_t row = 0; row < 12; ++row) {
        CAPTURE(row);
        CHECK(std::any_of(data + row * 60, data + (row + 1) * 60, [](std::uint8_t b) { return b != 0; }) ==
              (row < 5));
    }
    std::size_t chunk_bytes = 0;
    const auto* times =
        static_cast<const std::uint8_t*>(arv_buffer_get_chunk_data(buffer.get(), 0x4F42000D, &chunk_bytes));
    REQUIRE(chunk_bytes == 8 + 12 * 16);
    const auto instant = [&](std::size_t row, std::size_t which) {
        std::int64_t ns = 0;
        for (std::size_t i = 0; i < 8; ++i)
            ns = ns << 8 | times[8 + row * 16 + which * 8 + i];
        return ns;
    };
    for (std::size_t row = 0; row < 5; ++row) // a global shutter
        CHECK(instant(row, 1) - instant(row, 0) == bench.source.settings().exposure_ns);
    client.execute("AcquisitionStop");
}

TEST_CASE("A region of interest and a small packet size are obeyed") {
    Bench bench(limits());
    GigeClient client(address);
    client.set("Width", std::int64_t{100});
    client.set("Height", std::int64_t{50});
    client.set("OffsetX", std::int64_t{31});
    client.set("OffsetY", std::int64_t{77});
    client.set("GevSCPSPacketSize", std::int64_t{576});
    client.open_stream(6);
    client.execute("AcquisitionStart");
    receive_in_order(client, 10, {31, 77, 100, 50});
    client.execute("AcquisitionStop");
}

TEST_CASE("ChunkRegionID names the region behind each window") {
    CameraLimits l = limits(64, 48);
    l.windows_max = 4;
    Bench bench(l);
    GigeClient client(address);
    client.set("Height", std::int64_t{8});
    for (const char* region : {"Region1", "Region3"}) {
        client.set("RegionSelector", region);
        client.set("Width", std::int64_t{16});
        client.set("Height", std::int64_t{4});
        client.set("OffsetY", std::int64_t{20});
        client.set("RegionMode", "On");
    }
    client.set("RegionSelector", "Region1"); // leaves a gap
    client.set("RegionMode", "Off");
    client.set_flag("ChunkModeActive", true);
    client.set("ChunkSelector", "RegionID");
    client.set_flag("ChunkEnable", true);
    client.open_stream(4);
    client.execute("AcquisitionStart");
    Object<ArvChunkParser> parser(arv_camera_create_chunk_parser(client.camera()));
    auto buffer = client.next();
    REQUIRE(buffer != nullptr);
    GError* error = nullptr;
    const char* name = arv_chunk_parser_get_string_value(parser.get(), buffer.get(), "ChunkRegionID", &error);
    check(error, "ChunkRegionID");
    CHECK(std::string(name) == "Region0"); // of window 0; Aravis cannot choose another
    std::size_t bytes = 0;
    const auto* data =
        static_cast<const std::uint8_t*>(arv_buffer_get_chunk_data(buffer.get(), 0x4F420011, &bytes));
    REQUIRE(bytes == 4 + 32 * 4);
    CHECK(data[3] == 2);  // windows
    CHECK(data[7] == 0);  // the first is Region0
    CHECK(data[11] == 3); // the second Region3
    client.execute("AcquisitionStop");
}

TEST_CASE("Chunks say what the frame is, in both payload types") {
    Bench bench(limits(64, 48));
    for (const bool in_image : {false, true}) {
        CAPTURE(in_image);
        GigeClient client(address);
        client.set("Width", std::int64_t{60});
        client.set("OffsetX", std::int64_t{3});
        client.set("ExposureTime", 1500.0);
        client.set("Gain", 3.5);
        client.set_flag("ChunkModeActive", true);
        for (const char* chunk :
             {"Timestamp", "ExposureTime", "Gain", "FrameID", "Width", "OffsetX", "PixelFormat", "FrameFlags",
              "Regions", "RowTimes", "GroundTruth", "LineStatusAll", "SequencerSetActive", "FrameQuality"}) {
            client.set("ChunkSelector", chunk);
            client.set_flag("ChunkEnable", true);
        }
        client.set_flag("GevSCCFGExtendedChunkData", in_image);
        client.open_stream(4);
        client.execute("AcquisitionStart");
        Object<ArvChunkParser> parser(arv_camera_create_chunk_parser(client.camera()));
        for (std::int64_t id = 1; id <= 3; ++id) {
            auto buffer = client.next();
            REQUIRE(buffer != nullptr);
            REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
            CHECK(arv_buffer_get_payload_type(buffer.get()) ==
                  (in_image ? ARV_BUFFER_PAYLOAD_TYPE_IMAGE : ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA));
            if (!in_image) {
                // GigE Vision 1 chunks, which Aravis does not read: the tags by hand, from the end.
                std::size_t bytes = 0;
                const auto* data =
                    static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer.get(), &bytes));
                const auto word = [&](std::size_t at) {
                    return static_cast<std::uint32_t>(data[at]) << 24 |
                           static_cast<std::uint32_t>(data[at + 1]) << 16 |
                           static_cast<std::uint32_t>(data[at + 2]) << 8 | data[at + 3];
                };
                std::vector<std::uint32_t> ids;
                std::size_t at = bytes;
                while (at >= 8) {
                    ids.push_back(word(at - 8));
                    REQUIRE(word(at - 4) <= at - 8);
                    at -= 8 + word(at - 4);
                }
                CHECK(at == 0);
                CHECK(ids.size() == 15); // fourteen chunks and the image
                CHECK(ids.back() == 0x4F420000);
                client.give_back(std::move(buffer));
                continue;
            }
            CHECK(arv_buffer_has_chunks(buffer.get()));
            CHECK(arv_buffer_get_image_width(buffer.get()) == 60);
            CHECK(wrong_pixels_16(buffer.get(), static_cast<std::uint64_t>(id), {3, 0, 60, 48}, 0) == 0);
            GError* error = nullptr;
            const auto integer = [&](const char* name) {
                const gint64 v = arv_chunk_parser_get_integer_value(parser.get(), buffer.get(), name, &error);
                check(error, name);
                return v;
            };
            const auto real = [&](const char* name) {
                const double v = arv_chunk_parser_get_float_value(parser.get(), buffer.get(), name, &error);
                check(error, name);
                return v;
            };
            CHECK(static_cast<guint64>(integer("ChunkTimestamp")) == arv_buffer_get_timestamp(buffer.get()));
            CHECK(real("ChunkExposureTime") == 1500.0);
            CHECK(real("ChunkGain") == 3.5);
            CHECK(integer("ChunkFrameID") == id);
            CHECK(integer("ChunkWidth") == 60);
            CHECK(integer("ChunkOffsetX") == 3);
            CHECK(integer("ChunkPixelFormat") == 0x01100007);
            CHECK(integer("ChunkFrameFlags") == 0);
            CHECK(integer("ChunkRegionCount") == 1);
            CHECK(integer("ChunkRegionWidth") == 60);
            CHECK(integer("ChunkRegionExposureTime") == 1'500'000);
            CHECK(integer("ChunkRegionExposureTimeMin") == 1'400'000);
            CHECK(integer("ChunkRegionExposureTimeMax") == 1'600'000);
            CHECK(integer("ChunkLineStatusAll") == 1); // the pattern camera's trigger source is Line0
            CHECK(integer("ChunkSequencerSetActive") == 0);
            CHECK(integer("ChunkQualityLevel") == 5);
            CHECK(integer("ChunkQualityReasons") == quality_stall);
            CHECK(integer("ChunkQualityRowsDegraded") == 16);
            CHECK(integer("ChunkQualityTilesMissing") == 3);
            CHECK(real("ChunkQualityError") == 0.25);
            CHECK(real("ChunkQualityErrorWorst") == 0.5);
            CHECK(real("ChunkQualitySamplesMean") == 1.5);
            CHECK(real("ChunkQualityLodDeficit") == 0.125);
            CHECK(integer("ChunkQualityBudget") == 90000);
            CHECK(integer("ChunkQualitySpent") == 70000);
            CHECK(integer("ChunkQualityMargin") == -500);
            CHECK(integer("ChunkQualityInstants") == 4);
            CHECK(real("ChunkQualityErrorGoal") == 0.0625);
            CHECK(real("ChunkQualityNoiseRatio") == 0.75);
            CHECK(integer("ChunkRowCount") == 48);
            CHECK(integer("ChunkRowRead") - integer("ChunkRowReset") == 1'500'000);
            CHECK(integer("ChunkRowReset") == integer("ChunkTimestamp"));
            // The pattern camera's truth: see make_frame().
            CHECK(integer("ChunkBodyCount") == 2);
            CHECK(real("ChunkCameraPositionX") == 1.5 * static_cast<double>(id));
            CHECK(real("ChunkSunPositionZ") == -1e11);
            CHECK(real("ChunkBodyAttitudeW") == 1.0); // of body 0
            CHECK(real("ChunkCameraPoseAge") == 0.25);
            CHECK(real("ChunkBodyPoseAge") == 0.0); // of body 0
            CHECK(real("ChunkFocalLengthX") == 2000);
            CHECK(real("ChunkFocalLengthY") == 1250);
            CHECK(real("ChunkPrincipalPointX") == 31.5);
            CHECK(real("ChunkPrincipalPointY") == 23.5);
            CHECK(std::abs(real("ChunkSensorPixelWidth") - 10) < 1e-9);
            CHECK(std::abs(real("ChunkSensorPixelHeight") - 16) < 1e-9);
            // Aravis's chunk parser has selectors of its own that cannot be set: the second body by hand.
            std::size_t bytes = 0;
            const auto* truth =
                static_cast<const std::uint8_t*>(arv_buffer_get_chunk_data(buffer.get(), 0x4F42000E, &bytes));
            REQUIRE(bytes == 104 + 16 * 88 + 48 + 8 + 16 * 8);
            const auto big_endian = [&](std::size_t at) {
                std::uint64_t bits = 0;
                for (int i = 0; i < 8; ++i)
                    bits = bits << 8 | truth[104 + 88 + at + static_cast<std::size_t>(i)];
                double value = 0;
                std::memcpy(&value, &bits, 8);
                return value;
            };
            CHECK(std::string(reinterpret_cast<const char*>(truth + 104 + 88)) == "moon");
            CHECK(big_endian(32 + 8) == 25143.0);
            CHECK(big_endian(32 + 24) == 0.6);
            CHECK(big_endian(32 + 48) == 0.8);
            CHECK(big_endian(15 * 88 + 48 + 8 + 8) == 0.5); // age of its pose
            client.give_back(std::move(buffer));
        }
        client.execute("AcquisitionStop");
    }
}

TEST_CASE("Regions chosen through SFNC come as parts, and composed without multi-part") {
    CameraLimits l = limits(128, 96);
    l.windows_max = 3;
    Bench bench(l);
    GigeClient client(address);
    client.set("RegionSelector", "Region0");
    client.set("Width", std::int64_t{64});
    client.set("Height", std::int64_t{40});
    client.set("RegionSelector", "Region2");
    CHECK_THROWS(client.set("RegionSelector", "Region3")); // the sensor has no more
    client.set("Width", std::int64_t{32});
    client.set("Height", std::int64_t{20});
    client.set("OffsetX", std::int64_t{96});
    client.set("OffsetY", std::int64_t{70});
    client.set("RegionExposureTime", 2500.0);
    client.set("RegionMode", "On");
    CHECK(client.integer("PayloadSize") == 64 * 60 * 2);
    CHECK(bench.source.settings().window(1).exposure_ns == 2'500'000);
    for (const bool parts : {false, true}) {
        client.set_flag("GevSCCFGMultiPart", parts);
        client.open_stream(4);
        client.execute("AcquisitionStart");
        auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        if (!parts) {
            CHECK(arv_buffer_get_image_width(buffer.get()) == 64);
            CHECK(arv_buffer_get_image_height(buffer.get()) == 60);
        } else {
            REQUIRE(arv_buffer_get_n_parts(buffer.get()) == 2);
            CHECK(arv_buffer_get_part_width(buffer.get(), 1) == 32);
            CHECK(arv_buffer_get_part_height(buffer.get(), 1) == 20);
            CHECK(arv_buffer_get_part_x(buffer.get(), 1) == 96);
            CHECK(arv_buffer_get_part_y(buffer.get(), 1) == 70);
        }
        client.execute("AcquisitionStop");
        client.close_stream();
    }
}

TEST_CASE("Multi-part payload carries one part per sensor window") {
    Bench bench(limits(64, 64));
    const std::vector<Region> windows = {{3, 5, 40, 20}, {10, 30, 21, 7}, {0, 0, 64, 9}};
    bench.source.set_windows(windows);
    for (const char* format : {"Mono16", "Mono8", "Mono12p"})
        for (const bool chunks : {false, true}) {
            CAPTURE(format, chunks);
            GigeClient client(address);
            client.set("PixelFormat", format);
            client.set_flag("GevSCCFGMultiPart", true);
            client.set_flag("ChunkModeActive", chunks);
            client.set("ChunkSelector", "FrameID");
            client.set_flag("ChunkEnable", true);
            client.set("GevSCPSPacketSize", std::int64_t{576});
            client.open_stream(4);
            client.execute("AcquisitionStart");
            for (std::uint64_t id = 1; id <= 3; ++id) {
                auto buffer = client.next();
                REQUIRE(buffer != nullptr);
                REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
                REQUIRE(arv_buffer_get_payload_type(buffer.get()) == ARV_BUFFER_PAYLOAD_TYPE_MULTIPART);
                REQUIRE(arv_buffer_get_n_parts(buffer.get()) == windows.size() + chunks);
                std::uint64_t wrong = 0;
                for (unsigned p = 0; p < windows.size(); ++p) {
                    const Region& r = windows[p];
                    CHECK(arv_buffer_get_part_x(buffer.get(), p) == r.x);
                    CHECK(arv_buffer_get_part_y(buffer.get(), p) == r.y);
                    REQUIRE(arv_buffer_get_part_width(buffer.get(), p) == r.width);
                    REQUIRE(arv_buffer_get_part_height(buffer.get(), p) == r.height);
                    std::size_t bytes = 0;
                    const auto* data =
                        static_cast<const std::uint8_t*>(arv_buffer_get_part_data(buffer.get(), p, &bytes));
                    const std::size_t bits = format == std::string("Mono16")  ? 16
                                             : format == std::string("Mono8") ? 8
                                                                              : 12;
                    REQUIRE(bytes == (static_cast<std::size_t>(r.area()) * bits + 7) / 8);
                    for (std::size_t i = 0; i < static_cast<std::size_t>(r.area()); ++i) {
                        std::uint32_t got = 0;
                        for (std::size_t b = 0; b < bits; ++b)
                            got |=
                                static_cast<std::uint32_t>(data[(i * bits + b) / 8] >> (i * bits + b) % 8 & 1)
                                << b;
                        const auto x = static_cast<std::int32_t>(i) % r.width,
                                   y = static_cast<std::int32_t>(i) / r.width;
                        wrong += got != static_cast<std::uint32_t>(pattern_pixel(id, r.x + x, r.y + y, 12) >>
                                                                   (bits == 8 ? 4 : 0));
                    }
                }
                CHECK(wrong == 0);
                client.give_back(std::move(buffer));
            }
            client.execute("AcquisitionStop");
        }
}

TEST_CASE("Software triggers make one frame each, stamped with the trigger's instant") {
    Bench bench(limits());
    GigeClient client(address);
    client.set("TriggerSelector", "FrameStart");
    client.set("TriggerSource", "Software");
    client.set("TriggerMode", "On");
    client.open_stream(6);
    client.execute("AcquisitionStart");
    std::uint64_t previous = 0;
    for (std::uint64_t id = 1; id <= 20; ++id) {
        timespec before{};
        clock_gettime(CLOCK_TAI, &before);
        client.execute("TriggerSoftware");
        auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        CHECK(arv_buffer_get_frame_id(buffer.get()) == id);
        timespec after{};
        clock_gettime(CLOCK_TAI, &after);
        const std::uint64_t stamp = arv_buffer_get_timestamp(buffer.get());
        CHECK(stamp > previous);
        // Between the command and the frame, give or take the reading of two clocks.
        CHECK(stamp + 50'000 >= static_cast<std::uint64_t>(before.tv_sec) * 1'000'000'000 +
                                    static_cast<std::uint64_t>(before.tv_nsec));
        CHECK(stamp <= static_cast<std::uint64_t>(after.tv_sec) * 1'000'000'000 +
                           static_cast<std::uint64_t>(after.tv_nsec) + 50'000);
        previous = stamp;
        client.give_back(std::move(buffer));
    }
    client.execute("AcquisitionStop");
    CHECK(bench.source.triggers() == 20);
}

TEST_CASE("Frames on rising, falling or all edges of Line0, as far as its source tells of them") {
    CameraLimits both = limits();
    both.lines[0].falling = true;
    Bench bench(both);
    GigeClient client(address);
    client.set("TriggerSelector", "FrameStart");
    client.set("TriggerMode", "On");
    client.set("TriggerSource", "Line0");
    client.set("TriggerDivider", std::int64_t{1});
    client.set("TriggerDelay", 0.0);
    client.open_stream(8);
    for (const auto& [activation, frames] :
         {std::pair{"RisingEdge", 2}, {"FallingEdge", 2}, {"AnyEdge", 4}}) {
        CAPTURE(activation);
        client.set("TriggerActivation", activation);
        CHECK(client.text("TriggerActivation") == activation);
        client.execute("AcquisitionStart");
        int made = 0;
        for (int edge = 0; edge < 4; ++edge)
            made += bench.source.line_trigger(bench.clock.now(), edge % 2 == 1) ? 1 : 0;
        CHECK(made == frames);
        for (int i = 0; i < frames; ++i) {
            auto buffer = client.next();
            REQUIRE(buffer != nullptr);
            CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
            client.give_back(std::move(buffer));
        }
        CHECK(client.next(50) == nullptr);
        client.execute("AcquisitionStop");
    }
    for (const char* level : {"LevelHigh", "LevelLow"}) {
        client.set("TriggerActivation", level);
        CHECK(client.text("TriggerActivation") == level);
    }
    client.set("TriggerActivation", "RisingEdge");
    client.set("ExposureMode", "TriggerWidth");
    CHECK(client.text("ExposureMode") == "TriggerWidth");
    CHECK_THROWS(client.set("ExposureAuto", "Once"));
    client.set("ExposureMode", "Timed");
    client.close_stream();
    // What a client that clears all triggers first does.
    GError* error = nullptr;
    arv_camera_set_trigger(client.camera(), "Software", &error);
    check(error, "set trigger");
    CHECK(client.text("TriggerSource") == "Software");
    CHECK(client.text("TriggerMode") == "On");
}

TEST_CASE("A source that knows rising edges only does not offer the others") {
    Bench bench(limits());
    GigeClient client(address);
    CHECK(client.text("TriggerActivation") == "RisingEdge");
    CHECK_THROWS(client.set("TriggerActivation", "FallingEdge"));
    CHECK_THROWS(client.set("TriggerActivation", "AnyEdge"));
    CHECK_THROWS(client.set("TriggerActivation", "LevelHigh"));
    CHECK_THROWS(client.set("ExposureMode", "TriggerWidth"));
    CHECK(client.text("TriggerActivation") == "RisingEdge");
}

TEST_CASE("An acquisition can wait for a trigger of its own") {
    Bench bench(limits());
    GigeClient client(address);
    client.set("TriggerMode", "Off"); // frames come by themselves, once it has begun
    client.set("AcquisitionFrameRate", 100.0);
    client.set("TriggerSelector", "AcquisitionStart");
    client.set("TriggerMode", "On");
    ArvGcNode* delay = arv_device_get_feature(client.device(), "TriggerDelay"); // of the other trigger
    CHECK_FALSE(arv_gc_feature_node_is_available(ARV_GC_FEATURE_NODE(delay), nullptr));
    client.open_stream(8);
    for (const char* source : {"Software", "Line0", "Action1"}) {
        CAPTURE(source);
        client.set("TriggerSource", source);
        client.execute("AcquisitionStart");
        client.set("AcquisitionStatusSelector", "AcquisitionTriggerWait");
        CHECK(client.flag("AcquisitionStatus"));
        CHECK(client.next(60) == nullptr);
        CHECK_THROWS(client.set("TriggerSource", "Software")); // locked now
        if (source == std::string("Software"))
            client.execute("TriggerSoftware");
        else if (source == std::string("Line0"))
            CHECK(bench.source.line_trigger(bench.clock.now()));
        else
            CHECK(bench.source.action_trigger(bench.clock.now()));
        for (std::uint64_t id = 1; id <= 3; ++id) {
            auto buffer = client.next();
            REQUIRE(buffer != nullptr);
            CHECK(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
            CHECK(arv_buffer_get_frame_id(buffer.get()) == id); // a new channel each time
            client.give_back(std::move(buffer));
        }
        CHECK_FALSE(client.flag("AcquisitionStatus"));
        client.execute("AcquisitionStop");
        client.close_stream();
        client.open_stream(8);
    }
    client.set("TriggerSelector", "FrameStart");
    CHECK(client.text("TriggerMode") == "Off");
}

TEST_CASE("SingleFrame and MultiFrame end by themselves and can be started again") {
    Bench bench(limits());
    GigeClient client(address);
    client.set("AcquisitionFrameRate", 200.0);
    client.open_stream(8);
    std::uint64_t block = 1; // goes on while the channel stays open
    for (int round = 0; round < 3; ++round) {
        client.set("AcquisitionMode", "SingleFrame");
        client.execute("AcquisitionStart");
        receive_in_order(client, 1, {0, 0, 256, 200}, block++);
        CHECK(client.next(50) == nullptr);
    }
    client.set("AcquisitionMode", "MultiFrame");
    client.set("AcquisitionFrameCount", std::int64_t{5});
    client.execute("AcquisitionStart");
    receive_in_order(client, 5, {0, 0, 256, 200}, block);
    CHECK(client.next(50) == nullptr);
}

TEST_CASE("Packets leave while the frame is still being made") {
    // 20 bands of 10 ms; the leader and the first band must be out long before the last.
    Bench bench(limits());
    bench.source.set_bands(10, 10'000'000);
    GigeClient client(address);
    client.set("AcquisitionMode", "SingleFrame");
    client.open_stream(2);
    client.execute("AcquisitionStart");
    receive_in_order(client, 1, {0, 0, 256, 200});
    const auto counters = counters_after(bench.camera, 1);
    CHECK(counters.trigger_to_last_p50_ns > 190'000'000);
    CHECK(counters.trigger_to_first_p50_ns < 100'000'000);
}

TEST_CASE("An abandoned frame goes out with zeros below its last row") {
    Bench bench(limits());
    bench.source.abandon_after(64);
    GigeClient client(address);
    client.set("AcquisitionMode", "SingleFrame");
    client.open_stream(2);
    client.execute("AcquisitionStart");
    auto buffer = client.next();
    REQUIRE(buffer != nullptr);
    REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
    CHECK(wrong_pixels_16(buffer.get(), 1, {0, 0, 256, 64}, 0) == 0);
    std::size_t bytes = 0;
    const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer.get(), &bytes));
    CHECK(std::all_of(data + 256 * 64 * 2, data + bytes, [](std::uint8_t b) { return b == 0; }));
}

TEST_CASE("The packet delay spreads a frame") {
    Bench bench(limits());
    GigeClient client(address);
    client.set("GevSCPD", std::int64_t{200'000});
    client.set("GevSCPSPacketSize", std::int64_t{1500});
    client.set("AcquisitionFrameRate", 5.0);
    client.set("AcquisitionMode", "SingleFrame");
    client.open_stream(2);
    client.execute("AcquisitionStart");
    receive_in_order(client, 1, {0, 0, 256, 200});
    // 70 packets of 1464 bytes, 69 gaps before the last.
    CHECK(counters_after(bench.camera, 1).trigger_to_last_p50_ns > 69 * 200'000);
}

TEST_CASE(
    "A client that vanishes in mid-stream loses control by the heartbeat, and the next one finds all well") {
    GigeSettings settings;
    settings.heartbeat_timeout_ms = 600;
    Bench bench(limits(), settings);
    {
        // Aravis beats by itself and cannot be made to stop: a bare socket takes control and falls silent.
        const int fd = socket(AF_INET, SOCK_DGRAM, 0);
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(3956);
        to.sin_addr.s_addr = inet_addr(address.c_str());
        REQUIRE(connect(fd, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0);
        std::uint16_t id = 0;
        const auto write_register = [&](std::uint32_t where, std::uint32_t value) {
            std::uint8_t d[16] = {0x42, 1, 0, 0x82, 0, 8, 0, static_cast<std::uint8_t>(++id)};
            for (int i = 0; i < 4; ++i) {
                d[8 + i] = static_cast<std::uint8_t>(where >> (24 - 8 * i));
                d[12 + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
            }
            REQUIRE(send(fd, d, sizeof d, 0) == sizeof d);
            std::uint8_t answer[64];
            REQUIRE(recv(fd, answer, sizeof answer, 0) == 12);
            return static_cast<int>(answer[0] << 8 | answer[1]);
        };
        REQUIRE(write_register(0xA00, 2) == 0);
        REQUIRE(write_register(0xD18, ntohl(to.sin_addr.s_addr)) == 0);
        REQUIRE(write_register(0xD00, 9) == 0); // no listener there
        REQUIRE(write_register(0xA104, 1) == 0);
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        CHECK(bench.source.acquiring());
        CHECK(bench.camera.gige_counters().control_lost == 0);
        close(fd);
    }
    for (int i = 0; i < 6000 && bench.source.acquiring(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    CHECK_FALSE(bench.source.acquiring());
    CHECK(bench.camera.gige_counters().control_lost == 1);

    GigeClient client(address);
    client.open_stream(4);
    client.execute("AcquisitionStart");
    receive_in_order(client, 5, {0, 0, 256, 200});
}

TEST_CASE("Test packets have the size asked for; resends say what is to come and what is gone") {
    Bench bench(limits());
    bench.source.set_bands(10, 50 * ns_per_ms); // a second per frame
    GigeClient client(address);
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in a{}, camera{};
    a.sin_family = camera.sin_family = AF_INET;
    a.sin_addr.s_addr = inet_addr("127.0.0.1");
    camera.sin_addr.s_addr = inet_addr(address.c_str());
    camera.sin_port = htons(3956);
    socklen_t bytes = sizeof a;
    REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
    REQUIRE(getsockname(fd, reinterpret_cast<sockaddr*>(&a), &bytes) == 0);
    const timeval timeout{5, 0};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    struct Packet {
        ssize_t bytes = 0;
        unsigned status = 0, block = 0, id = 0;
    };
    const auto receive = [&] {
        std::uint8_t d[2000] = {};
        Packet p;
        p.bytes = recv(fd, d, sizeof d, 0);
        p.status = static_cast<unsigned>(d[0] << 8 | d[1]);
        p.block = static_cast<unsigned>(d[2] << 8 | d[3]);
        p.id = static_cast<unsigned>(d[5] << 16 | d[6] << 8 | d[7]);
        return p;
    };
    const auto ask = [&](unsigned block, unsigned packet) {
        const auto byte = [](unsigned v, int shift) { return static_cast<std::uint8_t>(v >> shift); };
        const std::uint8_t d[20] = {0x42,
                                    0,
                                    0,
                                    0x40,
                                    0,
                                    12,
                                    0,
                                    1,
                                    0,
                                    0,
                                    byte(block, 8),
                                    byte(block, 0),
                                    0,
                                    byte(packet, 16),
                                    byte(packet, 8),
                                    byte(packet, 0),
                                    0,
                                    byte(packet, 16),
                                    byte(packet, 8),
                                    byte(packet, 0)};
        sendto(fd, d, sizeof d, 0, reinterpret_cast<const sockaddr*>(&camera), sizeof camera);
    };
    client.set("GevSCPHostPort", std::int64_t{ntohs(a.sin_port)});
    client.set("GevSCPSPacketSize", std::int64_t{1000});
    client.set_flag("GevSCPSFireTestPacket", true);
    const Packet test = receive();
    CHECK(test.bytes == 1000 - 28);
    CHECK(test.block == 0);
    CHECK(test.id == 0);

    client.execute("AcquisitionStart");
    const Packet leader = receive();
    CHECK(leader.block == 1);
    CHECK(leader.id == 0);
    // The answer comes in between the packets of the block in flight.
    const auto answer = [&](unsigned block, unsigned packet) {
        ask(block, packet);
        for (int i = 0; i < 1000; ++i) {
            const Packet p = receive();
            if (p.bytes <= 0) break;
            if (p.status != 0) return p;
        }
        return Packet{};
    };
    const Packet ahead = answer(1, 100); // its rows are not made yet
    CHECK(ahead.status == 0x8010);
    CHECK(ahead.block == 1);
    CHECK(ahead.id == 100);
    CHECK(ahead.bytes == 8);
    // Nothing about a block that is not there yet: receivers would take it for a jump of the stream.
    ask(2, 0);
    const Packet again = answer(1, 0);
    CHECK(again.status == 0x0100); // the leader once more
    CHECK(again.block == 1);
    CHECK(again.id == 0);
    CHECK(again.bytes == leader.bytes);
    CHECK(answer(1, 5000).status == 0x800C); // the block has not so many
    client.execute("AcquisitionStop");
    close(fd);
}

TEST_CASE("Events reach the message channel and are repeated until acknowledged") {
    Bench bench(limits());
    GigeClient client(address);
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = inet_addr("127.0.0.1");
    socklen_t bytes = sizeof a;
    REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
    REQUIRE(getsockname(fd, reinterpret_cast<sockaddr*>(&a), &bytes) == 0);
    timeval timeout{5, 0};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    client.set("GevMCPHostPort", std::int64_t{ntohs(a.sin_port)});
    client.set("GevMCTT", std::int64_t{100});
    client.set("EventSelector", "Test");
    client.set("EventNotification", "On");

    struct Message {
        std::uint16_t request = 0, id = 0, block = 0;
        std::uint64_t timestamp = 0;
    };
    const auto receive = [&](bool acknowledge) {
        std::uint8_t d[64] = {};
        sockaddr_in from{};
        socklen_t from_bytes = sizeof from;
        REQUIRE(recvfrom(fd, d, sizeof d, 0, reinterpret_cast<sockaddr*>(&from), &from_bytes) == 24);
        REQUIRE(d[0] == 0x42);
        REQUIRE(d[3] == 0xC0);
        if (acknowledge) {
            const std::uint8_t ack[8] = {0, 0, 0, 0xC1, 0, 0, d[6], d[7]};
            sendto(fd, ack, sizeof ack, 0, reinterpret_cast<sockaddr*>(&from), from_bytes);
        }
        Message m;
        m.request = static_cast<std::uint16_t>(d[6] << 8 | d[7]);
        m.id = static_cast<std::uint16_t>(d[10] << 8 | d[11]);
        m.block = static_cast<std::uint16_t>(d[14] << 8 | d[15]);
        for (int i = 16; i < 24; ++i)
            m.timestamp = m.timestamp << 8 | d[i];
        return m;
    };
    client.execute("TestEventGenerate");
    const Message first = receive(false);
    CHECK(first.id == 0x9006);
    const Message again = receive(true);
    CHECK(again.request == first.request);
    CHECK(again.timestamp == first.timestamp);

    for (const char* event : {"FrameStart", "ExposureStart", "ExposureEnd"}) {
        client.set("EventSelector", event);
        client.set("EventNotification", "On");
    }
    client.set("AcquisitionMode", "SingleFrame");
    client.set("ExposureTime", 2500.0);
    client.open_stream(2);
    client.execute("AcquisitionStart");
    const Message start = receive(true), open = receive(true), shut = receive(true);
    auto buffer = client.next();
    REQUIRE(buffer != nullptr);
    CHECK(start.id == 0x9001);
    CHECK(open.id == 0x9002);
    CHECK(shut.id == 0x9003);
    CHECK(start.block == 1);
    CHECK(start.timestamp == arv_buffer_get_timestamp(buffer.get()));
    CHECK(shut.timestamp - open.timestamp == 2'500'000);
    bench.camera.notify(transports::CameraEvent::trigger_missed, {}, 7); // not enabled: silence
    client.set("EventSelector", "FrameTriggerMissed");
    client.set("EventNotification", "On");
    bench.camera.notify(transports::CameraEvent::trigger_missed, {1000}, 7);
    const Message missed = receive(true);
    CHECK(missed.id == 0x9004);
    CHECK(missed.timestamp == 1007);
    client.set("EventSelector", "FrameDegraded");
    client.set("EventNotification", "On");
    bench.source.set_degraded(true);
    client.execute("AcquisitionStart");
    CHECK(receive(true).id == 0x9001);
    const Message degraded = receive(true);
    CHECK(degraded.id == 0x9009);
    CHECK(degraded.block == 2); // the stream goes on counting
    CHECK(degraded.id == client.integer("EventFrameDegraded"));
    close(fd);
}

TEST_CASE("Faults do to the stream what they say") {
    using transports::gige::Fault;
    struct Outcome {
        int complete = 0, incomplete = 0, wrong = 0, out_of_step = 0;
    };
    const auto run = [](Fault fault, double percent, double amount) {
        GigeSettings settings;
        settings.history_frames = 16;
        transports::gige::FaultRule rule;
        rule.fault = fault;
        rule.percent = percent;
        rule.amount = amount;
        settings.faults = {rule};
        Bench bench(limits(), settings);
        GigeClient client(address);
        client.set("AcquisitionMode", "MultiFrame");
        client.set("AcquisitionFrameCount", std::int64_t{8});
        client.set("AcquisitionFrameRate", 25.0);
        client.open_stream(10);
        g_object_set(client.stream(), "frame-retention", 400'000U, nullptr);
        client.execute("AcquisitionStart");
        Outcome o;
        std::uint64_t id = 0;
        while (auto buffer = client.next(600)) {
            const bool complete = arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS;
            (complete ? o.complete : o.incomplete) += 1;
            o.out_of_step += arv_buffer_get_frame_id(buffer.get()) != ++id;
            o.wrong += complete && wrong_pixels_16(buffer.get(), id, {0, 0, 256, 200}, 0) != 0;
            client.give_back(std::move(buffer));
        }
        return o;
    };
    for (const Fault harmless :
         {Fault::duplicate, Fault::reorder, Fault::lose, Fault::drop_trailer, Fault::drop_leader}) {
        CAPTURE(name_of(harmless));
        const Outcome o = run(harmless, harmless == Fault::lose ? 2 : 20, 1);
        CHECK(o.complete == 8);
        CHECK(o.wrong == 0);
    }
    const Outcome delayed = run(Fault::delay, 3, 1000);
    CHECK(delayed.complete == 8);
    const Outcome gone = run(Fault::lose_for_good, 2, 1);
    CHECK(gone.incomplete > 0);
    const Outcome corrupt = run(Fault::corrupt, 2, 1);
    CHECK(corrupt.complete == 8);
    CHECK(corrupt.wrong > 0);
    const Outcome skipped = run(Fault::skip_frame, 50, 1);
    CHECK(skipped.complete < 8);
    CHECK(skipped.out_of_step > 0);
    const Outcome renamed = run(Fault::wrong_block_id, 100, 5);
    CHECK(renamed.out_of_step == 8);
}

TEST_CASE("Every way of sending delivers the same frames") {
    using transports::gige::SendBackend;
    for (const SendBackend backend :
         {SendBackend::sendto, SendBackend::sendmmsg, SendBackend::gso, SendBackend::automatic}) {
        CAPTURE(name_of(backend));
        GigeSettings settings;
        settings.backend = backend;
        settings.history_frames = 16;
        Bench bench(limits(), settings);
        GigeClient client(address);
        client.set("AcquisitionFrameRate", 25.0);
        client.set("GevGVSPExtendedIDMode", "On");
        client.open_stream(8);
        client.execute("AcquisitionStart");
        receive_in_order(client, 10, {0, 0, 256, 200});
        client.execute("AcquisitionStop");
        CHECK(bench.camera.gige_counters().send_errors == 0);
    }
}

TEST_CASE("Two cameras share a host, each at its own address") {
    GigeSettings one, two;
    one.serial = "ONE";
    two.serial = "TWO";
    two.interface = address.substr(0, address.rfind('.') + 1) +
                    std::to_string(std::stoi(address.substr(address.rfind('.') + 1)) + 1);
    Bench first(limits(), one), second(limits(64, 64), two);
    GigeClient a(address), b(two.interface);
    CHECK(a.text("DeviceSerialNumber") == "ONE");
    CHECK(b.text("DeviceSerialNumber") == "TWO");
    CHECK(a.integer("GevMACAddress") != b.integer("GevMACAddress"));
    a.set("AcquisitionFrameRate", 20.0);
    b.set("AcquisitionFrameRate", 20.0);
    a.open_stream(8);
    b.open_stream(100);
    a.execute("AcquisitionStart");
    b.execute("AcquisitionStart");
    receive_in_order(a, 10, {0, 0, 256, 200});
    receive_in_order(b, 10, {0, 0, 64, 64});
}

TEST_CASE("Multicast: a stream can go to a group") {
    Bench bench(limits(64, 64));
    GigeClient client(address);
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in a{};
    a.sin_family = AF_INET;
    socklen_t bytes = sizeof a;
    REQUIRE(bind(fd, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
    REQUIRE(getsockname(fd, reinterpret_cast<sockaddr*>(&a), &bytes) == 0);
    ip_mreq group{};
    group.imr_multiaddr.s_addr = inet_addr("239.192.7.1");
    group.imr_interface.s_addr = inet_addr("127.0.0.1");
    REQUIRE(setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0);
    timeval timeout{5, 0};
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    client.set("GevSCDA", std::int64_t{0xEFC00701});
    client.set("GevSCPHostPort", std::int64_t{ntohs(a.sin_port)});
    client.set("AcquisitionMode", "SingleFrame");
    client.execute("AcquisitionStart");
    std::uint8_t packet[2048];
    REQUIRE(recv(fd, packet, sizeof packet, 0) == 8 + 36); // the leader
    CHECK(packet[4] == 1);
    close(fd);
}

TEST_CASE("Connecting, streaming and leaving again costs neither memory nor file descriptors") {
    // OBSCURA_GIGE_CYCLES=1000 for the long run.
    const char* set = std::getenv("OBSCURA_GIGE_CYCLES");
    const int cycles = set != nullptr ? std::atoi(set) : 60;
    const auto descriptors = [] {
        return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
    };
    const auto resident_kib = [] {
        std::ifstream file("/proc/self/statm");
        long pages = 0, resident = 0;
        file >> pages >> resident;
        return resident * 4;
    };
    Bench bench(limits(64, 64));
    long at_first = 0;
    std::ptrdiff_t open_at_first = 0;
    for (int i = 0; i < cycles; ++i) {
        {
            GigeClient client(address);
            client.set("AcquisitionFrameRate", 100.0);
            client.open_stream(3);
            client.execute("AcquisitionStart");
            auto buffer = client.next();
            REQUIRE(buffer != nullptr);
            client.give_back(std::move(buffer));
            if (i % 2 == 0) client.execute("AcquisitionStop"); // every other client just goes
        }
        if (i == cycles / 3) { // caches of all parties are full by now
            at_first = resident_kib();
            open_at_first = descriptors();
        }
    }
    CHECK(descriptors() <= open_at_first);
    // Client and camera share this process; the client's GenICam trees are what may remain, 0.5 MB each if
    // they leaked.
    std::cout << cycles << " cycles: " << at_first << " KiB after a third, " << resident_kib()
              << " KiB in the end\n";
    if (!sanitized) // freed memory stays in the sanitizers' quarantine; leaks are what they report themselves
        CHECK(resident_kib() - at_first < 100 * cycles);
}

TEST_CASE("Loss matrix", "[.loss]") {
    // By hand: gige_stream_test "[.loss]". Frames at 100 Hz, paced at 120 MB/s, losses at first sending.
    const int frames = 1000;
    for (const bool packet_socket : {false, true})
        for (const auto& [percent, burst] : {std::pair{0.1, 1U}, {1.0, 1U}, {5.0, 1U}, {0.1, 50U}}) {
            GigeSettings settings;
            settings.history_frames = 16;
            settings.throughput_limit_mbit_s = 960;
            transports::gige::FaultRule rule;
            rule.percent = percent;
            rule.burst = burst;
            settings.faults = {rule};
            Bench bench(limits(512, 512), settings, {.thread = {60}});
            GigeClient client(address);
            arv_camera_gv_set_stream_options(client.camera(),
                                             packet_socket ? ARV_GV_STREAM_OPTION_NONE
                                                           : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
            client.set("AcquisitionMode", "MultiFrame");
            client.set("AcquisitionFrameCount", std::int64_t{frames});
            client.set("AcquisitionFrameRate", 100.0);
            client.open_stream(40);
            client.execute("AcquisitionStart");
            int complete = 0, incomplete = 0;
            while (auto buffer = client.next(2000)) {
                (arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS ? complete : incomplete) +=
                    1;
                client.give_back(std::move(buffer));
            }
            const auto c = bench.camera.gige_counters();
            std::cout << (packet_socket ? "packet socket " : "UDP socket    ") << percent
                      << " % in bursts of " << burst << ": complete " << complete << " incomplete "
                      << incomplete << " of " << c.frames.delivered << ", lost " << c.injected_losses
                      << " resent " << c.resent_packets << "\n"
                      << std::flush;
            CHECK(incomplete <= (percent > 1 ? frames / 1000 : 0));
        }
}

TEST_CASE("Features read back what was written, and refuse what cannot be") {
    Bench bench(limits());
    GigeClient client(address);
    client.set("ExposureTime", 1234.56); // to the microsecond
    CHECK(client.real("ExposureTime") == 1235);
    CHECK(bench.source.settings().exposure_ns == 1'235'000);
    client.set("ExposureTime", 3.6e9); // an hour
    CHECK(client.real("ExposureTime") == 3.6e9);
    CHECK(bench.source.settings().exposure_ns == 3600 * ns_per_s);
    CHECK_THROWS(client.set("ExposureTime", 3.600001e9));
    client.set("ExposureTime", 1234.0);
    client.set("Gain", 6.25);
    CHECK(client.real("Gain") == 6.25);
    client.set("AcquisitionFrameRate", 12.5);
    CHECK(client.real("AcquisitionFrameRate") == 12.5);
    client.set("TriggerDelay", 17.5);
    CHECK(bench.source.settings().trigger_delay_ns == 17'500);
    CHECK_THROWS(client.set("Width", std::int64_t{257}));
    CHECK_THROWS(client.set("ExposureTime", 0.1));
    CHECK(client.integer("Width") == 256);
    client.set("DeviceUserID", "bench 7");
    CHECK(client.text("DeviceUserID") == "bench 7");
    CHECK(client.text("DeviceVendorName") == "Obscura");
    client.execute("TimestampLatch");
    CHECK(client.integer("TimestampLatchValue") > 0);
    client.execute("TimestampReset");
    client.execute("TimestampLatch");
    CHECK(client.integer("TimestampLatchValue") < 1'000'000'000);
}

TEST_CASE("A sequence set up through SFNC features runs frame by frame") {
    Bench bench(limits(64, 48));
    GigeClient client(address);
    client.set("SequencerConfigurationMode", "On");
    client.set("SequencerFeatureSelector", "ExposureTime");
    client.set_flag("SequencerFeatureEnable", true);
    for (const std::int64_t set : {0, 1, 2}) {
        client.set("ExposureTime", 1000.0 * static_cast<double>(set + 1));
        client.set("SequencerSetSelector", set);
        client.set("SequencerSetNext", (set + 1) % 3);
        client.execute("SequencerSetSave");
    }
    client.set("SequencerConfigurationMode", "Off");
    client.set("SequencerMode", "On");
    CHECK_THROWS(client.set("SequencerConfigurationMode", "On"));
    client.set("CounterSelector", "Counter1");
    client.set("CounterEventSource", "FrameStart");
    client.set("ChunkSelector", "SequencerSetActive");
    client.set_flag("ChunkEnable", true);
    client.set("ChunkSelector", "ExposureTime");
    client.set_flag("ChunkEnable", true);
    client.set_flag("ChunkModeActive", true);
    client.open_stream(4);
    client.execute("AcquisitionStart");
    Object<ArvChunkParser> parser(arv_camera_create_chunk_parser(client.camera()));
    for (std::int64_t i = 0; i < 7; ++i) {
        auto buffer = client.next();
        REQUIRE(buffer != nullptr);
        REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        GError* error = nullptr;
        CHECK(arv_chunk_parser_get_integer_value(parser.get(), buffer.get(), "ChunkSequencerSetActive",
                                                 &error) == i % 3);
        check(error, "set");
        CHECK(arv_chunk_parser_get_float_value(parser.get(), buffer.get(), "ChunkExposureTime", &error) ==
              1000.0 * static_cast<double>(i % 3 + 1));
        check(error, "exposure");
        client.give_back(std::move(buffer));
    }
    client.execute("AcquisitionStop");
    CHECK(client.integer("CounterValue") >= 7);
    client.set("CounterSelector", "Counter0");
    CHECK(client.integer("CounterValue") == 0);
    client.set("SequencerMode", "Off");
}

TEST_CASE("Locked features cannot be changed while streaming, the others can") {
    Bench bench(limits());
    GigeClient client(address);
    client.open_stream(4);
    client.execute("AcquisitionStart");
    CHECK_THROWS(client.set("Width", std::int64_t{128}));
    CHECK_THROWS(client.set("PixelFormat", "Mono8"));
    client.set("ExposureTime", 500.0);
    CHECK(client.real("ExposureTime") == 500.0);
    client.execute("AcquisitionStop");
    client.set("Width", std::int64_t{128});
}

TEST_CASE("Every register that the XML names is in the table with the same length and access, and back") {
    Bench bench(limits());
    GigeClient client(address);
    ArvGc* gc = arv_device_get_genicam(client.device());
    REQUIRE(gc != nullptr);
    ArvDomNode* root = arv_dom_node_get_first_child(ARV_DOM_NODE(gc));
    int checked = 0;
    for (ArvDomNode* node = arv_dom_node_get_first_child(root); node != nullptr;
         node = arv_dom_node_get_next_sibling(node)) {
        if (!ARV_IS_GC_FEATURE_NODE(node)) continue;
        const char* name = arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(node));
        CAPTURE(name);
        if (!ARV_IS_GC_REGISTER(node)) continue;
        GError* error = nullptr;
        const guint64 where = arv_gc_register_get_address(ARV_GC_REGISTER(node), &error);
        const guint64 bytes = arv_gc_register_get_length(ARV_GC_REGISTER(node), &error);
        REQUIRE(error == nullptr);
        // Addresses in chunk data count from the beginning of the chunk: they are no registers.
        if (std::string(name).starts_with("Chunk") && where < 0xA000) continue;
        std::vector<std::uint8_t> data(bytes);
        const ArvGcAccessMode mode = arv_gc_feature_node_get_actual_access_mode(ARV_GC_FEATURE_NODE(node));
        CHECK(
            arv_device_read_memory(client.device(), where, static_cast<guint32>(bytes), data.data(), &error));
        g_clear_error(&error);
        if (mode == ARV_GC_ACCESS_MODE_RO) {
            // Refused with WRITE_PROTECT, not taken.
            CHECK_FALSE(arv_device_write_memory(client.device(), where, static_cast<guint32>(bytes),
                                                data.data(), &error));
            REQUIRE(error != nullptr);
            CHECK(std::string(error->message).find("write-protect") != std::string::npos);
            g_clear_error(&error);
        } else if (mode == ARV_GC_ACCESS_MODE_RW && where != 0xA00) {
            CHECK(arv_device_write_memory(client.device(), where, static_cast<guint32>(bytes), data.data(),
                                          &error));
            g_clear_error(&error);
        }
        ++checked;
    }
    CHECK(checked > 50);
}

TEST_CASE("Set-up errors are one line that says what is wrong") {
    MonotonicClock clock;
    PatternCamera source(limits());
    GigeSettings settings;
    settings.interface = "nosuch0";
    GigeCamera nowhere(settings, source, clock);
    try {
        nowhere.start();
        FAIL("started on an interface that does not exist");
    } catch (const HardwareError& e) {
        CHECK(std::string(e.what()).find("no interface \"nosuch0\"") != std::string::npos);
        CHECK(std::string(e.what()).find('\n') == std::string::npos);
    }
    Bench first(limits());
    settings.interface = address;
    GigeCamera second(settings, source, clock);
    try {
        second.start();
        FAIL("started on a port in use");
    } catch (const HardwareError& e) {
        CHECK(std::string(e.what()).find("cannot bind UDP " + address + ":3956") != std::string::npos);
    }
}

TEST_CASE("Aravis finds the camera by broadcast") {
    GigeSettings settings;
    settings.serial = "FINDME42";
    Bench bench(limits(), settings);
    arv_enable_interface("GigEVision");
    arv_update_device_list();
    bool found = false;
    for (unsigned i = 0; i < arv_get_n_devices(); ++i)
        found = found || std::strcmp(arv_get_device_serial_nbr(i), "FINDME42") == 0;
    CHECK(found);
}
