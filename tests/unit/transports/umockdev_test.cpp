// SPDX-License-Identifier: Apache-2.0
// Discovery, use and loss of a USB display and of a video node through the real system calls, libusb and
// sysfs, which umockdev answers in place of the kernel. To be run by umockdev-wrapper. GPIO lines cannot be
// had that way (a request for one gives a new descriptor); tests/kernel has those.
#include "core/camera/frame.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/umockdev_devices.hpp"
#include "transports/stimulator/libusb_bus.hpp"
#include "transports/stimulator/stimulator_output.hpp"
#include "transports/v4l2/v4l2_output.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <thread>
#include <vector>

namespace umockdev_test {

using namespace obscura;
using namespace obscura::test;
using namespace obscura::transports;

namespace {

constexpr std::uint16_t vendor = UsbDisplay::vendor, product = UsbDisplay::product;
constexpr std::int32_t width = UsbDisplay::width, height = UsbDisplay::height;

template<typename F>
bool eventually(F truth) {
    for (int i = 0; i < 120'000; ++i) { // two minutes: only a test that fails waits that long
        if (truth()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

std::uint16_t value(std::uint64_t frame, std::size_t pixel) {
    return static_cast<std::uint16_t>((frame * 7 + pixel) & 255u);
}

/// A whole frame; the transport has it when this returns.
template<typename Output>
void shoot(Output& output, FramePool& pool, std::uint64_t id) {
    const FrameRef frame = pool.acquire();
    REQUIRE(frame);
    frame->info.frame_id = id;
    frame->info.width = width, frame->info.height = height;
    frame->info.bits_per_pixel = 8;
    frame->info.windows[0].sensor = {0, 0, width, height};
    for (std::size_t i = 0; i < frame->pixels().size(); ++i)
        frame->pixels()[i] = value(id, i);
    frame->publish_rows(height);
    output.submit(frame);
    REQUIRE(eventually([&] {
        const auto c = output.counters();
        return c.delivered + c.dropped == c.submitted;
    }));
}

} // namespace

TEST_CASE("libusb finds the display among others, asks its serial number and misses it when it has gone") {
    Testbed bed;
    const auto bus = make_libusb_bus();
    CHECK(bus->list(vendor, product).empty());
    UsbDisplay other(bed, "OTHER");
    other.plug(0x1234);
    CHECK(bus->list(vendor, product).empty());
    other.unplug();
    UsbDisplay display(bed, "MOCK\n7");
    display.plug();
    const auto found = bus->list(vendor, product);
    REQUIRE(found.size() == 1);
    CHECK(found[0].serial == "MOCK?7");
    CHECK(found[0].bus == 1);
    CHECK(found[0].address == 2);
    CHECK(found[0].problem.empty());
    const auto device = bus->open(found[0]);
    CHECK(device->description() == "1d50:614d serial MOCK?7 at bus 1 address 2, 480 Mbit/s");
    display.unplug();
    CHECK(bus->list(vendor, product).empty());
    std::array<std::uint8_t, 1> status{};
    CHECK_FALSE(device->control_in(0, 0, status).ok());
}

TEST_CASE("frames reach the display through libusb, and again when it was pulled out and put back") {
    Testbed bed;
    UsbDisplay display(bed, "MOCK-1");
    StimulatorSettings settings;
    settings.white_dn = 255;
    settings.dither = Dither::none;
    const StimulatorContext context{
        .sensor = {width, height, 8}, .look_ns = 5 * ns_per_ms, .reconnect_ns = 5 * ns_per_ms};
    StimulatorOutput output(settings, context, make_libusb_bus());
    output.start();
    FramePool pool(4, std::size_t{width} * height, height);
    std::uint64_t id = 0;
    for (int turn = 0; turn < 3; ++turn) {
        CHECK_FALSE(output.status().connected);
        display.plug();
        REQUIRE(eventually([&] { return output.status().connected; }));
        for (int i = 0; i < 3; ++i) {
            const auto before = output.counters();
            shoot(output, pool, ++id);
            REQUIRE(output.counters().delivered == before.delivered + 1);
            const std::vector<std::uint8_t> screen = display.screen();
            REQUIRE(screen.size() == std::size_t{width} * height);
            std::size_t wrong = 0;
            for (std::size_t p = 0; p < screen.size(); ++p)
                wrong += screen[p] != value(id, p);
            CHECK(wrong == 0);
        }
        display.unplug();
        REQUIRE(eventually([&] { return !output.status().connected; }));
    }
    output.stop();
    CHECK(pool.in_use() == 0);
}

TEST_CASE("images reach a video node through the system calls, also after it went and came back") {
    Testbed bed;
    VideoNode node(bed);
    V4l2Settings settings;
    settings.device = VideoNode::path;
    settings.format = V4l2Format::grey;
    V4l2Context context;
    context.width = width, context.height = height, context.bits_per_pixel = 8;
    context.retry_first_ns = context.retry_last_ns = 5 * ns_per_ms;
    V4l2Output output(settings, context);
    output.start(); // the node may come later
    FramePool pool(4, std::size_t{width} * height, height);
    std::uint64_t id = 0;
    shoot(output, pool, ++id);
    CHECK(output.counters().dropped == 1);
    for (int turn = 0; turn < 3; ++turn) {
        // Something else by that name first.
        node.plug(V4L2_CAP_VIDEO_CAPTURE);
        shoot(output, pool, ++id);
        node.unplug();
        node.plug();
        const std::size_t before = node.images().size();
        REQUIRE(eventually([&] {
            shoot(output, pool, ++id);
            return node.images().size() > before;
        }));
        const auto image = node.images().back();
        REQUIRE(image.size() == std::size_t{width} * height);
        std::size_t wrong = 0;
        for (std::size_t p = 0; p < image.size(); ++p)
            wrong += image[p] != value(id, p);
        CHECK(wrong == 0);
        node.unplug();
        const auto dropped = output.counters().dropped;
        REQUIRE(eventually([&] {
            shoot(output, pool, ++id);
            return output.counters().dropped > dropped;
        }));
    }
    output.stop();
    CHECK(pool.in_use() == 0);
}

} // namespace umockdev_test
