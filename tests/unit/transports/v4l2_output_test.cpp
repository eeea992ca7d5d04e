// SPDX-License-Identifier: Apache-2.0
#include "core/camera/frame.hpp"
#include "core/error.hpp"
#include "core/philox.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/transports/v4l2_fake_driver.hpp"
#include "transports/v4l2/v4l2_output.hpp"

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace v4l2_output_test {

using namespace obscura;
using namespace obscura::transports;
using obscura::test::FakeV4l2Driver;
using Kind = FakeV4l2Driver::Kind;

namespace {

constexpr std::int32_t width = 16, height = 130; // more than two bands of rows

V4l2Settings settings_for(const FakeV4l2Driver& driver) {
    V4l2Settings settings;
    settings.device = driver.path;
    settings.queue_frames = 8;
    return settings;
}

V4l2Context quick_context() {
    V4l2Context context;
    context.width = width, context.height = height, context.bits_per_pixel = 12;
    context.retry_first_ns = ns_per_ms, context.retry_last_ns = 4 * ns_per_ms;
    context.buffer_wait_ns = ns_per_ms;
    return context;
}

/// Waits as long as it takes; the test program's own time limit ends a wait in vain.
void wait_until(const std::function<bool()>& condition) {
    while (!condition())
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

std::uint16_t dn_of(std::uint64_t id, std::int32_t x, std::int32_t y) {
    return static_cast<std::uint16_t>((static_cast<unsigned>(x) + static_cast<unsigned>(y) * 19 + id * 7) &
                                      4095);
}

/// A camera that fills its frames at once.
class Camera {
public:
    explicit Camera(V4l2Output& output) : output_(output) {}
    FramePool pool{12, std::size_t{width} * 2 * height, height};

    FrameRef begin(std::int32_t w = width) {
        FrameRef frame = pool.acquire();
        REQUIRE(frame);
        frame->info.frame_id = ++id;
        frame->info.trigger_edge = {static_cast<std::int64_t>(id) * 1'000'003'000};
        frame->info.width = w, frame->info.height = height;
        frame->info.bits_per_pixel = 12;
        return frame;
    }
    static void fill(Frame& frame, std::int32_t first, std::int32_t last) {
        for (std::int32_t y = first; y < last; ++y)
            for (std::int32_t x = 0; x < frame.info.width; ++x)
                frame.row(y)[static_cast<std::size_t>(x)] = dn_of(frame.info.frame_id, x, y);
        frame.publish_rows(last);
    }
    /// One whole frame; waits until the transport is through with it.
    void shoot(std::int32_t w = width) {
        FrameRef frame = begin(w);
        const auto before = finished();
        output_.submit(frame);
        fill(*frame, 0, height);
        frame = FrameRef{};
        wait_until([&] { return finished() > before; });
    }
    std::uint64_t finished() const {
        const auto counters = output_.counters();
        return counters.delivered + counters.dropped;
    }
    std::uint64_t id = 0;

private:
    V4l2Output& output_;
};

/// The frame that an image shows, all of its pixels checked.
std::uint64_t frame_shown(const FakeV4l2Driver::Image& image, std::int32_t w = width) {
    REQUIRE(image.bytes.size() == static_cast<std::size_t>(w) * height * 2);
    const auto at = [&](std::int32_t x, std::int32_t y) {
        const std::size_t i =
            2 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x));
        return static_cast<std::uint16_t>(image.bytes[i] | image.bytes[i + 1] << 8);
    };
    for (std::uint64_t id = 1; id < 500; ++id) {
        if (at(0, 0) != dn_of(id, 0, 0)) continue;
        for (std::int32_t y = 0; y < height; ++y)
            for (std::int32_t x = 0; x < w; ++x)
                if (at(x, y) != dn_of(id, x, y)) FAIL("frame " << id << " differs at " << x << "," << y);
        return id;
    }
    FAIL("an image of no frame");
    return 0;
}

void check_clean(const FakeV4l2Driver& driver, const Camera& camera) {
    CHECK(driver.complaints() == std::vector<std::string>{});
    CHECK(driver.open_descriptors() == 0);
    CHECK(driver.open_mappings() == 0);
    CHECK(camera.pool.in_use() == 0);
}

} // namespace

TEST_CASE("Every frame goes out whole with the time of its edge") {
    FakeV4l2Driver driver;
    driver.kind = GENERATE(Kind::strict, Kind::newer_loopback, Kind::older_loopback);
    V4l2Output output(settings_for(driver), quick_context(), driver);
    Camera camera(output);
    output.start();
    for (int i = 0; i < 40; ++i)
        camera.shoot();
    output.stop();
    const auto images = driver.images();
    REQUIRE(images.size() == 40);
    for (std::uint64_t i = 0; i < 40; ++i) {
        CHECK(frame_shown(images[i]) == i + 1);
        CHECK(images[i].stamp_us ==
              (driver.kind == Kind::older_loopback ? -1 : static_cast<std::int64_t>((i + 1) * 1'000'003)));
    }
    const auto counters = output.counters();
    CHECK(counters.submitted == 40);
    CHECK(counters.delivered == 40);
    CHECK(counters.dropped == 0);
    CHECK(counters.bytes == 40u * width * height * 2);
    CHECK(output.v4l2_counters().opened == 1);
    check_clean(driver, camera);
}

TEST_CASE("Rows are packed while the frame is made; a frame that is given up is not shown") {
    FakeV4l2Driver driver;
    V4l2Output output(settings_for(driver), quick_context(), driver);
    Camera camera(output);
    output.start();
    {
        const FrameRef frame = camera.begin();
        output.submit(frame);
        for (std::int32_t y = 0; y < height; y += 26) {
            CHECK(driver.image_count() == 0);
            Camera::fill(*frame, y, y + 26);
        }
    }
    wait_until([&] { return camera.finished() == 1; });
    {
        const FrameRef frame = camera.begin();
        output.submit(frame);
        Camera::fill(*frame, 0, 100);
        frame->abandon();
    }
    wait_until([&] { return camera.finished() == 2; });
    {
        const FrameRef frame = camera.begin();
        frame->flags |= frame_dropped;
        output.submit(frame);
        Camera::fill(*frame, 0, height);
    }
    wait_until([&] { return camera.finished() == 3; });
    camera.shoot();
    output.stop();
    REQUIRE(driver.image_count() == 2);
    CHECK(frame_shown(driver.images()[0]) == 1);
    CHECK(frame_shown(driver.images()[1]) == 4);
    CHECK(output.counters().dropped == 2);
    CHECK(output.v4l2_counters().partial == 2);
    check_clean(driver, camera);
}

TEST_CASE("Windows go out as they are composed in the frame") {
    FakeV4l2Driver driver;
    V4l2Output output(settings_for(driver), quick_context(), driver);
    Camera camera(output);
    output.start();
    {
        // A wide window above a narrow one, whose right side is 0.
        const FrameRef frame = camera.begin();
        frame->info.window_count = 2;
        frame->info.windows[0] = {{0, 0, width, 100}, 0, 0, 0};
        frame->info.windows[1] = {{40, 300, 5, 30}, 100, 0, 0};
        output.submit(frame);
        for (std::int32_t y = 0; y < height; ++y)
            for (std::int32_t x = 0; x < width; ++x)
                frame->row(y)[static_cast<std::size_t>(x)] =
                    y < 100 || x < 5 ? dn_of(1, x, y) : std::uint16_t{0};
        frame->publish_rows(height);
    }
    output.stop();
    REQUIRE(driver.image_count() == 1);
    const auto bytes = driver.images()[0].bytes;
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            REQUIRE((bytes[2 * (y * width + x)] | bytes[2 * (y * width + x) + 1] << 8) ==
                    (y < 100 || x < 5 ? dn_of(1, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y))
                                      : 0));
    check_clean(driver, camera);
}

TEST_CASE("A frame of another size makes another format") {
    FakeV4l2Driver driver;
    V4l2Context context = quick_context();
    context.width = GENERATE(0, width); // with and without an announcement
    V4l2Output output(settings_for(driver), context, driver);
    Camera camera(output);
    output.start();
    camera.shoot();
    camera.shoot(2 * width);
    camera.shoot(2 * width);
    camera.shoot();
    output.stop();
    REQUIRE(driver.image_count() == 4);
    CHECK(frame_shown(driver.images()[0]) == 1);
    CHECK(frame_shown(driver.images()[1], 2 * width) == 2);
    CHECK(frame_shown(driver.images()[2], 2 * width) == 3);
    CHECK(frame_shown(driver.images()[3]) == 4);
    CHECK(output.v4l2_counters().lost == 0);
    check_clean(driver, camera);
}

TEST_CASE("A node that goes away and comes back") {
    FakeV4l2Driver driver;
    driver.kind = GENERATE(Kind::strict, Kind::newer_loopback, Kind::older_loopback);
    V4l2Output output(settings_for(driver), quick_context(), driver);
    Camera camera(output);
    output.start();
    for (int round = 0; round < 30; ++round) {
        camera.shoot();
        camera.shoot();
        driver.remove();
        camera.shoot(); // finds out
        camera.shoot();
        driver.give_back();
        const auto opened = output.v4l2_counters().opened;
        wait_until([&] { return output.v4l2_counters().opened > opened; });
        camera.shoot();
    }
    output.stop();
    const auto counters = output.counters();
    const auto node = output.v4l2_counters();
    CHECK(counters.submitted == 150);
    CHECK(counters.delivered == 90);
    CHECK(counters.dropped == 60);
    CHECK(node.lost == 30);
    CHECK(node.opened == 31);
    CHECK(node.no_node == 60);
    // "Is gone" each time, and "is not there" unless it was back before the first look.
    CHECK(node.problems >= 30);
    CHECK(node.problems <= 60);
    CHECK(driver.image_count() == 90);
    for (const auto& image : driver.images())
        CHECK(frame_shown(image) > 0);
    check_clean(driver, camera);
}

TEST_CASE("A node is missed even when there is nothing to send, and found again") {
    FakeV4l2Driver driver;
    V4l2Output output(settings_for(driver), quick_context(), driver);
    Camera camera(output);
    output.start();
    driver.remove();
    wait_until([&] { return output.v4l2_counters().lost == 1 && output.v4l2_counters().refused > 5; });
    driver.give_back();
    wait_until([&] { return output.v4l2_counters().opened == 2; });
    camera.shoot();
    output.stop();
    CHECK(output.v4l2_counters().problems == 2);
    CHECK(output.counters().delivered == 1);
    check_clean(driver, camera);
}

TEST_CASE("A node that is not there at start is waited for or required") {
    FakeV4l2Driver driver;
    driver.remove();
    V4l2Settings settings = settings_for(driver);
    SECTION("waited for") {
        V4l2Output output(settings, quick_context(), driver);
        Camera camera(output);
        output.start();
        camera.shoot();
        CHECK(output.counters().dropped == 1);
        driver.give_back();
        wait_until([&] { return output.v4l2_counters().opened == 1; });
        camera.shoot();
        output.stop();
        CHECK(output.counters().delivered == 1);
        CHECK(output.v4l2_counters().problems == 1);
        check_clean(driver, camera);
    }
    SECTION("required") {
        settings.required = true;
        V4l2Output output(settings, quick_context(), driver);
        CHECK_THROWS_WITH(output.start(), "v4l2: /dev/video-fake: is not there");
        driver.give_back();
        output.start();
        output.stop();
        CHECK(driver.open_descriptors() == 0);
    }
}

TEST_CASE("A driver that opens and fails every time is logged once and tried ever more rarely") {
    FakeV4l2Driver driver;
    std::atomic<bool> broken{true};
    driver.fault = [&](const std::string& call) { return call == "QBUF" && broken ? -EIO : 0; };
    auto context = quick_context();
    context.retry_first_ns = 10 * ns_per_ms, context.retry_last_ns = 40 * ns_per_ms;
    V4l2Output output(settings_for(driver), context, driver);
    Camera camera(output);
    const auto begin = std::chrono::steady_clock::now();
    output.start();
    while (output.v4l2_counters().lost < 8)
        camera.shoot();
    // Pauses of 10, 20 and five times 40 ms, at least.
    CHECK(std::chrono::steady_clock::now() - begin >= std::chrono::milliseconds(230));
    CHECK(output.v4l2_counters().problems == 1);
    broken = false;
    wait_until([&] { return output.v4l2_counters().opened > output.v4l2_counters().lost; });
    camera.shoot();
    output.stop();
    CHECK(output.counters().delivered == 1);
    CHECK(driver.image_count() == 1);
    check_clean(driver, camera);
}

TEST_CASE("A driver that turns out to mix its buffers up gets write() from then on") {
    FakeV4l2Driver driver;
    V4l2Output output(settings_for(driver), quick_context(), driver);
    Camera camera(output);
    output.start();
    driver.kind = Kind::older_loopback;
    for (int i = 0; i < 20; ++i)
        camera.shoot();
    output.stop();
    CHECK(output.counters().delivered == 19);
    CHECK(output.counters().dropped == 1);
    CHECK(driver.images().back().stamp_us == -1);
    check_clean(driver, camera);
}

TEST_CASE("Frames that find no room are dropped and counted, never waited for") {
    FakeV4l2Driver driver;
    driver.consumes = false;
    V4l2Settings settings = settings_for(driver);
    SECTION("no buffer in the driver") {
        V4l2Output output(settings, quick_context(), driver);
        Camera camera(output);
        output.start();
        for (int i = 0; i < 12; ++i)
            camera.shoot();
        output.stop();
        CHECK(output.counters().delivered == 8);
        CHECK(output.v4l2_counters().busy == 4);
        check_clean(driver, camera);
    }
    SECTION("no place in the queue") {
        settings.queue_frames = 2;
        V4l2Output output(settings, quick_context(), driver);
        Camera camera(output);
        output.start();
        std::vector<FrameRef> frames;
        for (int i = 0; i < 5; ++i) {
            frames.push_back(camera.begin());
            CHECK(output.submit(frames.back()) == (i < 2));
        }
        for (const FrameRef& frame : frames)
            Camera::fill(*frame, 0, height);
        frames.clear();
        output.stop();
        CHECK(output.counters().delivered == 2);
        CHECK(output.counters().dropped == 3);
        check_clean(driver, camera);
    }
}

TEST_CASE("Whatever fails whenever: every frame is shown whole or counted, and nothing leaks") {
    constexpr std::array errors{ENODEV, EIO, EBUSY, EINVAL, ENOMEM, EAGAIN, EACCES};
    for (std::uint32_t seed = 0; seed < 60; ++seed) {
        FakeV4l2Driver driver;
        driver.kind = static_cast<Kind>(seed % 3);
        std::uint32_t calls = 0; // under the driver's lock
        driver.fault = [&](const std::string&) {
            const auto random = philox4x32({++calls, 0, 0, 0}, {seed, 7});
            return random[0] % 16 == 0 ? -errors[random[1] % errors.size()] : 0;
        };
        V4l2Context context = quick_context();
        context.retry_first_ns = 1000, context.retry_last_ns = 10'000;
        V4l2Output output(settings_for(driver), context, driver);
        Camera camera(output);
        output.start();
        for (int i = 0; i < 40; ++i)
            camera.shoot(i % 8 == 7 ? 2 * width : width);
        output.stop();
        const auto counters = output.counters();
        CHECK(counters.submitted == 40);
        CHECK(counters.delivered + counters.dropped == 40);
        const auto images = driver.images();
        // STREAMON may fail after the first image of a node was queued.
        CHECK(images.size() >= counters.delivered);
        for (const auto& image : images)
            CHECK(frame_shown(image,
                              image.bytes.size() == std::size_t{2} * width * height ? width : 2 * width) > 0);
        check_clean(driver, camera);
    }
}

} // namespace v4l2_output_test
