// SPDX-License-Identifier: Apache-2.0
// One trigger, one camera, three ways out at once: GigE Vision to libaravis, a V4L2 node and a USB display.
// Whatever leaves is the same frame everywhere.
#include "tests/integration/gige_client.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"
#include "tests/unit/transports/stimulator_fake_bus.hpp"
#include "tests/unit/transports/v4l2_fake_driver.hpp"
#include "transports/gige/gige.hpp"
#include "transports/stimulator/stimulator_output.hpp"
#include "transports/v4l2/v4l2_output.hpp"

#include <cstring>
#include <functional>
#include <map>
#include <thread>
#include <vector>

namespace three_transports_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr std::int32_t width = 96, height = 80;
using Pixels = std::vector<std::uint16_t>;

void wait_until(const std::function<bool()>& condition) {
    while (!condition())
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

transports::gige::GigeSettings gige_settings(const std::string& address) {
    transports::gige::GigeSettings s;
    s.interface = address;
    return s;
}

transports::V4l2Settings v4l2_settings(const FakeV4l2Driver& driver) {
    transports::V4l2Settings s;
    s.device = driver.path;
    return s;
}

transports::V4l2Context v4l2_context() {
    transports::V4l2Context context;
    context.width = width, context.height = height, context.bits_per_pixel = 12;
    return context;
}

/// High and low byte in two colours: every digital number has a level of its own.
transports::StimulatorSettings stimulator_settings() {
    transports::StimulatorSettings s;
    s.dither = transports::Dither::none;
    s.format = transports::DisplayFormat::rgb888;
    s.grey = transports::GreyCoding::high_low;
    return s;
}

std::shared_ptr<FakeBench> make_display() {
    tools::GudDeviceSettings display;
    display.width = width, display.height = height;
    display.formats = {gud::Format::rgb888};
    return std::make_shared<FakeBench>(display);
}

/// Camera and transports, taken down in the right order.
struct Bench : MakerBench {
    explicit Bench(const std::string& address)
        : MakerBench(small_sensor(width, height)),
          releaser({.max_rows = height}, std::make_unique<MonotonicClock>(), &timing),
          camera(CameraBench::config(sensor, {}, sync::OverTrigger::count), maker, releaser, frames, clock,
                 log),
          display(make_display()),
          gige(gige_settings(address), camera, clock),
          v4l2(v4l2_settings(driver), v4l2_context(), driver),
          stimulator(stimulator_settings(), {.sensor = {width, height, 16}},
                     std::make_unique<FakeBus>(display)) {
        for (transports::Transport* transport : all()) {
            camera.add_transport(*transport);
            transport->start();
        }
        wait_until([this] { return stimulator.status().connected; });
    }
    ~Bench() {
        camera.acquisition_stop(true);
        for (transports::Transport* transport : all())
            transport->stop();
    }
    std::vector<transports::Transport*> all() { return {&gige, &v4l2, &stimulator}; }

    /// What the display shows.
    Pixels shown() {
        return display->with([](FakeBench& b) {
            Pixels pixels;
            const auto screen = b.display.screen();
            for (std::size_t i = 0; i + 2 < screen.size(); i += 3)
                pixels.push_back(static_cast<std::uint16_t>(screen[i + 2] << 8 | screen[i + 1]));
            return pixels;
        });
    }

    LogRing log;
    emulator::TimingLog timing;
    FramePool frames{12, std::size_t{width} * height, height};
    emulator::Releaser releaser;
    emulator::Camera camera;
    FakeV4l2Driver driver;
    std::shared_ptr<FakeBench> display;
    transports::gige::GigeCamera gige;
    transports::V4l2Output v4l2;
    transports::StimulatorOutput stimulator;
};

Pixels pixels_of(const void* data, std::size_t bytes) {
    Pixels pixels(bytes / 2);
    std::memcpy(pixels.data(), data, pixels.size() * 2);
    return pixels;
}

} // namespace

TEST_CASE("one trigger feeds GigE Vision, V4L2 and the stimulator the same frame") {
    const std::string address = own_loopback_address();
    Bench bench(address);
    GigeClient client(address);
    client.set("PixelFormat", "Mono16");
    client.open_stream(8);
    client.execute("AcquisitionStart");

    Pixels before;
    for (std::uint64_t id = 1; id <= 40; ++id) {
        wait_until([&] { return bench.camera.trigger_ready(); });
        const Time edge = bench.clock.now();
        bench.camera.on_trigger({id, edge, edge});

        const auto buffer = client.next(20'000);
        REQUIRE(buffer != nullptr);
        REQUIRE(arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS);
        wait_until([&] { return bench.driver.image_count() >= id; });
        wait_until([&] {
            const auto counters = bench.stimulator.counters();
            return counters.delivered + counters.dropped >= id;
        });

        std::size_t bytes = 0;
        const void* data = arv_buffer_get_data(buffer.get(), &bytes);
        const Pixels received = pixels_of(data, bytes);
        const FakeV4l2Driver::Image image = bench.driver.images().at(id - 1);
        REQUIRE(received.size() == std::size_t{width} * height);
        REQUIRE((pixels_of(image.bytes.data(), image.bytes.size()) == received));
        REQUIRE((bench.shown() == received));
        // There is something in it, and it is not the frame before.
        CHECK((received != before));
        before = received;

        // One edge, one time: TAI in nanoseconds here, the scheduling clock in microseconds there.
        const auto stamp = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer.get()));
        CHECK(std::abs(stamp - edge.ns - bench.clock.tai_offset_ns()) < 50 * ns_per_ms);
        CHECK(image.stamp_us == edge.ns / 1000);
        CHECK(arv_buffer_get_frame_id(buffer.get()) == id);
        arv_stream_push_buffer(client.stream(), ARV_BUFFER(g_object_ref(buffer.get())));
    }
    client.execute("AcquisitionStop");
    for (const transports::Transport* transport : bench.all()) {
        INFO(transport->kind());
        CHECK(transport->counters().submitted == 40);
        CHECK(transport->counters().dropped == 0);
    }
    CHECK(bench.camera.counters().frames == 40);
}

TEST_CASE("a display pulled out and a node taken away do not disturb the transport that is left") {
    const std::string address = own_loopback_address();
    Bench bench(address);
    GigeClient client(address);
    client.set("PixelFormat", "Mono16");
    client.open_stream(8);
    client.execute("AcquisitionStart");
    int received = 0;
    const auto shoot = [&](std::uint64_t id) {
        wait_until([&] { return bench.camera.trigger_ready(); });
        const Time edge = bench.clock.now();
        bench.camera.on_trigger({id, edge, edge});
        const auto buffer = client.next(20'000);
        received += buffer && arv_buffer_get_status(buffer.get()) == ARV_BUFFER_STATUS_SUCCESS ? 1 : 0;
        if (buffer) arv_stream_push_buffer(client.stream(), ARV_BUFFER(g_object_ref(buffer.get())));
    };
    std::uint64_t id = 0;
    for (int round = 0; round < 5; ++round) {
        for (int i = 0; i < 3; ++i)
            shoot(++id);
        bench.display->unplug();
        bench.driver.remove();
        for (int i = 0; i < 5; ++i)
            shoot(++id);
        bench.display->plug();
        bench.driver.give_back();
        const auto v4l2_before = bench.v4l2.counters().delivered;
        const auto shown_before = bench.stimulator.counters().delivered;
        // Both come back by themselves, and the camera goes on all the while.
        while (bench.v4l2.counters().delivered == v4l2_before ||
               bench.stimulator.counters().delivered == shown_before)
            shoot(++id);
    }
    CHECK(received == static_cast<int>(id));
    CHECK(bench.gige.counters().dropped == 0);
    CHECK(bench.v4l2.counters().dropped > 0);
    CHECK(bench.stimulator.counters().dropped > 0);
    client.execute("AcquisitionStop");
}

} // namespace three_transports_test
