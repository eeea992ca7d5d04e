// SPDX-License-Identifier: Apache-2.0
// Frames whose rows come late, received by Aravis.
#include "core/time.hpp"
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/gige_bench.hpp"

#include <cstdint>
#include <string>

namespace gige_late_rows_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr std::int32_t width = 256, height = 200;
constexpr unsigned timeout_us = 300'000;

struct Received {
    ArvBufferStatus status = ARV_BUFFER_STATUS_UNKNOWN;
    std::uint64_t repeated_packets = 0;
    std::uint64_t right_pixels = 0;
};

/// Receives one frame of which the bands of `band_rows` rows come `stall_ns` apart, by a client that gives a
/// frame up after `timeout_us` of silence.
Received receive(double keep_alive_ms, std::int32_t band_rows, std::int64_t stall_ns) {
    CameraLimits limits;
    limits.sensor_width = width;
    limits.sensor_height = height;
    limits.adc_bits = 12;
    transports::gige::GigeSettings settings;
    settings.interface = own_loopback_address();
    settings.keep_alive_ms = keep_alive_ms;
    GigeBench bench(limits, settings);
    bench.source.set_bands(band_rows, stall_ns);
    GigeClient client(settings.interface);
    client.set("PixelFormat", "Mono16");
    client.set("AcquisitionMode", "SingleFrame");
    client.open_stream(2);
    // What Aravis does by default, but for a longer timeout: a test machine may be busy with anything.
    g_object_set(client.stream(), "frame-retention", timeout_us, "packet-request-ratio", 0.25, nullptr);
    client.execute("AcquisitionStart");
    Received result;
    const Object<ArvBuffer> buffer = client.next(20'000);
    REQUIRE(buffer != nullptr);
    result.status = arv_buffer_get_status(buffer.get());
    std::size_t bytes = 0;
    const auto* data = static_cast<const std::uint16_t*>(arv_buffer_get_data(buffer.get(), &bytes));
    for (std::size_t i = 0; i < bytes / 2; ++i)
        result.right_pixels +=
            data[i] == pattern_pixel(1, static_cast<std::int32_t>(i) % width,
                                     static_cast<std::int32_t>(i) / width, limits.adc_bits);
    client.execute("AcquisitionStop");
    result.repeated_packets = bench.camera.gige_counters().repeated_packets;
    return result;
}

} // namespace

TEST_CASE("a frame whose rows come later than a client waits arrives complete") {
    // Silence before the first row, as in a long exposure, and between the halves of the image.
    const Received r = receive(transports::gige::GigeSettings().keep_alive_ms, height / 2, ns_per_s);
    CHECK(r.status == ARV_BUFFER_STATUS_SUCCESS);
    CHECK(r.right_pixels == std::uint64_t{width} * height);
    // In two seconds one every 10 ms, unless the machine is busy.
    CHECK(r.repeated_packets >= 6);
    CHECK(r.repeated_packets <= 220);
}

TEST_CASE("without repeated packets the client gives that frame up") {
    const Received r = receive(0, height / 2, ns_per_s);
    CHECK(r.status == ARV_BUFFER_STATUS_TIMEOUT);
    CHECK(r.repeated_packets == 0);
}

} // namespace gige_late_rows_test
