// SPDX-License-Identifier: Apache-2.0
// The stimulator transport against a display in memory: pictures, windows, compression, faults, hot plugging.
#include "core/camera/frame.hpp"
#include "core/philox.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/transports/stimulator_fake_bus.hpp"
#include "transports/stimulator/stimulator_output.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>

namespace stimulator_output_test {

using namespace obscura;
using namespace obscura::transports;
using Catch::Matchers::ContainsSubstring;
using obscura::test::FakeBench;
using obscura::test::FakeBus;

namespace {

constexpr std::int32_t width = 96, height = 80;

struct Rig {
    explicit Rig(tools::GudDeviceSettings display = {},
                 std::function<void(StimulatorSettings&)> change = {}) {
        display.width = width;
        display.height = height;
        bench = std::make_shared<FakeBench>(std::move(display));
        bench->display.on_update = [this](const tools::GudUpdate& u) { updates.push_back(u.buffer); };
        StimulatorSettings settings;
        settings.white_dn = 255;
        settings.dither = Dither::none;
        settings.compression = Compression::off;
        if (change) change(settings);
        output = std::make_unique<StimulatorOutput>(
            settings, StimulatorContext{.sensor = {width, height, 16}, .reconnect_ns = 2 * ns_per_ms},
            std::make_unique<FakeBus>(bench));
    }
    ~Rig() { output->stop(); }

    /// The updates that arrived so far.
    std::vector<gud::SetBuffer> sent() {
        return bench->with([this](FakeBench&) { return updates; });
    }
    template<typename F>
    bool wait_until(F condition) {
        for (int i = 0; i < 120'000; ++i) { // two minutes: only a test that fails waits that long
            if (condition()) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        return false;
    }
    bool wait_connected() {
        return wait_until([&] { return output->status().connected; });
    }
    bool wait_settled() {
        return wait_until([&] {
            const auto c = output->counters();
            return c.delivered + c.dropped == c.submitted;
        });
    }
    /// A frame of the given windows, one below the other, filled by `value(sensor x, sensor y)` below 256.
    template<typename F>
    FrameRef make(std::uint64_t id, std::vector<Region> windows, F value) {
        FrameRef frame = pool.acquire();
        REQUIRE(frame);
        FrameInfo& info = frame->info;
        info.frame_id = id;
        info.bits_per_pixel = 8;
        info.window_count = static_cast<std::uint32_t>(windows.size());
        for (std::size_t i = 0; i < windows.size(); ++i) {
            info.windows[i].sensor = windows[i];
            info.windows[i].image_y = info.height;
            info.height += windows[i].height;
            info.width = std::max(info.width, windows[i].width);
        }
        for (std::size_t i = 0; i < windows.size(); ++i)
            for (std::int32_t y = 0; y < windows[i].height; ++y)
                for (std::int32_t x = 0; x < windows[i].width; ++x)
                    frame->row(info.windows[i].image_y + y)[static_cast<std::size_t>(x)] =
                        static_cast<std::uint16_t>(value(windows[i].x + x, windows[i].y + y));
        return frame;
    }
    template<typename F>
    FrameRef full(std::uint64_t id, F value) {
        FrameRef frame = make(id, {{0, 0, width, height}}, value);
        frame->publish_rows(height);
        return frame;
    }
    template<typename F>
    bool screen_is(F value) {
        return bench->with([&](FakeBench& b) {
            const auto screen = b.display.screen();
            for (std::int32_t y = 0; y < height; ++y)
                for (std::int32_t x = 0; x < width; ++x)
                    if (screen[static_cast<std::size_t>(y * width + x)] !=
                        static_cast<std::uint8_t>(value(x, y)))
                        return false;
            return true;
        });
    }

    std::vector<gud::SetBuffer> updates; // guarded by the bench
    std::shared_ptr<FakeBench> bench;
    FramePool pool{8, width* height * 2, height * 2};
    std::unique_ptr<StimulatorOutput> output;
};

int pattern(std::int32_t x, std::int32_t y) {
    return (x * 3 + y * 5) & 255;
}
int noise(std::int32_t x, std::int32_t y) {
    return static_cast<int>(
        philox4x32({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 0, 0}, {7, 7})[0] & 255u);
}

/// What is written to standard error while it lives.
class StderrCapture {
public:
    StderrCapture() : saved_(::dup(2)), file_(std::tmpfile()) {
        std::fflush(stderr);
        ::dup2(::fileno(file_), 2);
    }
    ~StderrCapture() { restore(); }
    /// What has been written so far.
    [[nodiscard]] std::string so_far() const {
        std::string all(1 << 16, '\0'); // pread: writers share the place in the file
        const ssize_t bytes = ::pread(::fileno(file_), all.data(), all.size(), 0);
        all.resize(static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
        return all;
    }
    std::string text() {
        restore();
        std::rewind(file_);
        std::string all;
        for (int c = std::fgetc(file_); c != EOF; c = std::fgetc(file_))
            all += static_cast<char>(c);
        return all;
    }

private:
    void restore() {
        if (saved_ < 0) return;
        ::dup2(saved_, 2);
        ::close(saved_);
        saved_ = -1;
    }
    int saved_;
    std::FILE* file_;
};

std::size_t lines_with(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        count += text.substr(at, end - at).find(part) != std::string::npos ? 1 : 0;
        at = end + 1;
    }
    return count;
}

} // namespace

TEST_CASE("A frame reaches the screen unchanged") {
    const bool full_update = GENERATE(false, true);
    tools::GudDeviceSettings display;
    display.full_update = full_update;
    Rig rig(display);
    rig.output->start();
    REQUIRE(rig.wait_connected());
    REQUIRE(rig.output->submit(rig.full(1, pattern)));
    REQUIRE(rig.wait_settled());
    CHECK(rig.screen_is(pattern));
    CHECK(rig.output->counters().delivered == 1);
    CHECK(rig.output->counters().bytes == width * height);
    rig.output->stop();
    CHECK(rig.pool.in_use() == 0);
    CHECK(rig.bench->with([](FakeBench& b) { return b.open_handles == 0 && !b.display.display_on(); }));
}

TEST_CASE("Colour formats carry grey in three channels") {
    tools::GudDeviceSettings display;
    display.formats = {gud::Format::rgb565, gud::Format::rgb888, gud::Format::xrgb8888};
    Rig rig(display, [](StimulatorSettings& s) {
        s.grey = GreyCoding::high_low;
        s.format = DisplayFormat::rgb888;
        s.white_dn = 65535;
    });
    rig.output->start();
    REQUIRE(rig.wait_connected());
    const auto value = [](std::int32_t x, std::int32_t y) { return (x * 601 + y * 877) & 65535; };
    REQUIRE(rig.output->submit(rig.full(1, value)));
    REQUIRE(rig.wait_settled());
    rig.bench->with([&](FakeBench& b) {
        REQUIRE(b.display.format() == gud::Format::rgb888);
        const auto screen = b.display.screen();
        REQUIRE(screen.size() == 3u * width * height);
        for (std::int32_t i = 0; i < width * height; ++i) {
            const auto at = static_cast<std::size_t>(3 * i);
            REQUIRE((screen[at + 2] << 8 | screen[at + 1]) == value(i % width, i / width));
            REQUIRE(screen[at] == 0);
        }
        return 0;
    });
}

TEST_CASE("Only what changed is sent") {
    Rig rig;
    rig.output->start();
    REQUIRE(rig.wait_connected());
    REQUIRE(rig.output->submit(rig.full(1, pattern)));
    REQUIRE(rig.wait_settled());
    rig.bench->with([&](FakeBench&) {
        rig.updates.clear();
        return 0;
    });

    SECTION("the same picture: nothing") {
        REQUIRE(rig.output->submit(rig.full(2, pattern)));
        REQUIRE(rig.wait_settled());
        CHECK(rig.sent().empty());
        CHECK(rig.output->status().unchanged == 1);
        CHECK(rig.output->counters().delivered == 2);
    }
    SECTION("a full frame that differs in a patch: the patch") {
        const auto patched = [](std::int32_t x, std::int32_t y) {
            return x >= 20 && x < 27 && y >= 33 && y < 35 ? 255 - pattern(x, y) : pattern(x, y);
        };
        REQUIRE(rig.output->submit(rig.full(2, patched)));
        REQUIRE(rig.wait_settled());
        REQUIRE(rig.sent().size() == 1);
        CHECK(rig.sent()[0].x == 20);
        CHECK(rig.sent()[0].y == 33);
        CHECK(rig.sent()[0].width == 7);
        CHECK(rig.sent()[0].height == 2);
        CHECK(rig.screen_is(patched));
    }
    SECTION("windows: each where it lies on the sensor") {
        const std::vector<Region> windows{{8, 4, 40, 10}, {50, 60, 30, 20}};
        const auto inverted = [](std::int32_t x, std::int32_t y) { return pattern(x, y) ^ 255; };
        FrameRef frame = rig.make(2, windows, inverted);
        frame->publish_rows(frame->info.height);
        REQUIRE(rig.output->submit(frame));
        REQUIRE(rig.wait_settled());
        REQUIRE(rig.sent().size() == 2);
        CHECK(rig.sent()[0].x == 8);
        CHECK(rig.sent()[0].width == 40);
        CHECK(rig.sent()[1].y == 60);
        CHECK(rig.sent()[1].height == 20);
        CHECK(rig.screen_is([&](std::int32_t x, std::int32_t y) {
            for (const Region& w : windows)
                if (x >= w.x && x < w.x + w.width && y >= w.y && y < w.y + w.height) return inverted(x, y);
            return pattern(x, y);
        }));
        CHECK(rig.output->counters().bytes == width * height + 400 + 600);
    }
}

TEST_CASE("Updates that are too large for the device go in parts") {
    tools::GudDeviceSettings display;
    display.max_buffer_size = width * 7 + 5;
    Rig rig(display);
    rig.output->start();
    REQUIRE(rig.wait_connected());
    REQUIRE(rig.output->submit(rig.full(1, pattern)));
    REQUIRE(rig.wait_settled());
    CHECK(rig.sent().size() == 12); // 80 rows, 7 at a time
    CHECK(rig.screen_is(pattern));
    CHECK(rig.output->counters().delivered == 1);
}

TEST_CASE("LZ4 is used when it makes an update smaller") {
    Rig rig({}, [](StimulatorSettings& s) { s.compression = Compression::always; });
    rig.output->start();
    REQUIRE(rig.wait_connected());
    const auto stripes = [](std::int32_t, std::int32_t y) { return y * 3; };
    REQUIRE(rig.output->submit(rig.full(1, stripes)));
    REQUIRE(rig.wait_settled());
    CHECK(rig.screen_is(stripes));
    CHECK(rig.sent().at(0).compression == gud::compression_lz4);
    CHECK(rig.output->counters().bytes < width * height / 4);

    REQUIRE(rig.output->submit(rig.full(2, noise)));
    REQUIRE(rig.wait_settled());
    CHECK(rig.screen_is(noise));
    CHECK(rig.sent().at(1).compression == 0); // noise does not shrink
    CHECK(rig.output->status().compressed == 1);
}

TEST_CASE(
    "Rows are shown though the producer publishes them one by one, and not before the frame is complete") {
    Rig rig;
    rig.output->start();
    REQUIRE(rig.wait_connected());
    FrameRef frame = rig.make(1, {{0, 0, width, height}}, pattern);
    REQUIRE(rig.output->submit(frame));
    for (std::int32_t rows = 1; rows < height; ++rows) {
        frame->publish_rows(rows);
        CHECK(rig.output->counters().delivered == 0);
    }
    frame->publish_rows(height);
    REQUIRE(rig.wait_settled());
    CHECK(rig.screen_is(pattern));
}

TEST_CASE("A frame that its producer gave up is dropped, and the next one is shown") {
    Rig rig;
    rig.output->start();
    REQUIRE(rig.wait_connected());
    FrameRef broken = rig.make(1, {{0, 0, width, height}}, noise);
    broken->publish_rows(10);
    REQUIRE(rig.output->submit(broken));
    broken->abandon();
    REQUIRE(rig.wait_settled());
    CHECK(rig.output->counters().dropped == 1);
    REQUIRE(rig.output->submit(rig.full(2, pattern)));
    REQUIRE(rig.wait_settled());
    CHECK(rig.screen_is(pattern));
}

TEST_CASE("A slow device makes frames late, then drops them, and holds no more than two transfers") {
    const bool full_update = GENERATE(false, true);
    tools::GudDeviceSettings display;
    display.full_update = full_update;
    Rig rig(display);
    rig.bench->with([](FakeBench& b) { return b.hold = true; });
    rig.output->start();
    REQUIRE(rig.wait_connected());
    int taken = 0;
    for (std::uint64_t id = 1; id <= 6; ++id) {
        taken += rig.output->submit(
                     rig.full(id, [&](int x, int y) { return pattern(x, y) ^ static_cast<int>(id); }))
                     ? 1
                     : 0;
        // The first frames have time to become transfers; the rest finds the queue full.
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    CHECK(taken < 6);
    CHECK(rig.output->counters().dropped == static_cast<std::uint64_t>(6 - taken));
    rig.bench->with([](FakeBench& b) {
        b.hold = false;
        return 0;
    });
    REQUIRE(rig.wait_settled());
    CHECK(rig.output->counters().delivered == static_cast<std::uint64_t>(taken));
    CHECK(rig.output->status().late >= 1);
    CHECK(rig.output->status().late < static_cast<std::uint64_t>(taken));
    // Double buffering: two under way where the protocol allows it, else the next one waits, computed.
    CHECK(rig.bench->with([](FakeBench& b) { return b.max_in_flight; }) == (full_update ? 2u : 1u));
}

TEST_CASE("stop() returns though the device hangs and the producer is gone") {
    Rig rig;
    rig.output->start();
    REQUIRE(rig.wait_connected());
    SECTION("a transfer that never ends") {
        rig.bench->with([](FakeBench& b) { return b.hold = true; });
        REQUIRE(rig.output->submit(rig.full(1, pattern)));
        rig.wait_until([&] { return rig.bench->with([](FakeBench& b) { return b.in_flight == 1; }); });
    }
    SECTION("a frame that never comes") {
        REQUIRE(rig.output->submit(rig.make(1, {{0, 0, width, height}}, pattern)));
    }
    rig.output->stop();
    const auto c = rig.output->counters();
    CHECK(c.delivered + c.dropped == c.submitted);
    CHECK(rig.pool.in_use() == 0);
    CHECK(rig.bench->with([](FakeBench& b) { return b.open_handles == 0 && b.in_flight == 0; }));
}

TEST_CASE("A hundred hot unplugs: it comes back each time, and nothing is left behind") {
    StderrCapture quiet;
    Rig rig;
    rig.output->start();
    std::uint64_t id = 0;
    for (int round = 0; round < 100; ++round) {
        REQUIRE(rig.wait_connected());
        // Pulled while idle, with a transfer under way, or with one that has just been queued.
        if (round % 3 == 1)
            rig.bench->with([](FakeBench& b) {
                b.hold = true;
                return 0;
            });
        if (round % 3 != 0)
            rig.output->submit(rig.full(++id, [&](int x, int y) { return (pattern(x, y) + round) & 255; }));
        if (round % 3 == 1)
            rig.wait_until([&] { return rig.bench->with([](FakeBench& b) { return b.in_flight > 0; }); });
        rig.bench->unplug();
        rig.bench->with([](FakeBench& b) {
            b.hold = false;
            return 0;
        });
        REQUIRE(rig.wait_until([&] {
            rig.output->submit(rig.full(++id, pattern)); // traffic notices a missing device at once
            return !rig.output->status().connected;
        }));
        REQUIRE(rig.wait_settled());
        rig.bench->plug();
    }
    REQUIRE(rig.wait_connected());
    CHECK(rig.output->status().connects == 101);
    CHECK(rig.bench->with([](FakeBench& b) { return b.open_handles == 1 && b.in_flight == 0; }));
    REQUIRE(rig.output->submit(rig.full(++id, pattern)));
    REQUIRE(rig.wait_settled());
    CHECK(rig.screen_is(pattern)); // whole, though the device forgot everything
    CHECK(rig.pool.in_use() == 0);
}

TEST_CASE("An idle device that is pulled is missed without traffic") {
    StderrCapture quiet;
    Rig rig;
    rig.output->start();
    REQUIRE(rig.wait_connected());
    rig.bench->unplug();
    CHECK(rig.wait_until([&] { return !rig.output->status().connected; }));
}

TEST_CASE("A failed transfer costs its frame only, and the screen is made whole again") {
    StderrCapture quiet;
    const UsbStatus how = GENERATE(UsbStatus::stall, UsbStatus::timeout, UsbStatus::error);
    Rig rig;
    rig.bench->on_bulk = [how](std::uint64_t count) -> std::optional<UsbResult> {
        if (count == 1) return UsbResult{how, 17};
        return std::nullopt;
    };
    rig.output->start();
    REQUIRE(rig.wait_connected());
    REQUIRE(rig.output->submit(rig.full(1, pattern)));
    REQUIRE(rig.wait_settled());
    const auto other = [](std::int32_t x, std::int32_t y) { return x < 50 ? pattern(x, y) : noise(x, y); };
    REQUIRE(rig.output->submit(rig.full(2, other)));
    REQUIRE(rig.wait_settled());
    CHECK(rig.output->counters().dropped == 1);
    REQUIRE(rig.wait_connected());
    REQUIRE(rig.wait_until([&] { return rig.output->submit(rig.full(3, other)); }));
    REQUIRE(rig.wait_settled());
    CHECK(rig.screen_is(other));
    CHECK(rig.output->status().failed == 1);
}

TEST_CASE("Devices that lie are named once, in one line, and asked again") {
    struct Case {
        const char* what;
        std::function<std::optional<UsbResult>(std::uint8_t, std::span<std::uint8_t>)> answer;
        const char* line;
    };
    const auto only = [](std::uint8_t which, UsbResult result, std::vector<std::uint8_t> bytes = {}) {
        return [which, result, bytes = std::move(bytes)](
                   std::uint8_t request, std::span<std::uint8_t> data) -> std::optional<UsbResult> {
            if (request != which) return std::nullopt;
            std::copy_n(bytes.begin(), std::min(bytes.size(), data.size()), data.begin());
            return result;
        };
    };
    std::vector<std::uint8_t> garbage(3072, 0xA5);
    const std::vector<Case> cases{
        {"stalls the descriptor", only(0x01, {UsbStatus::stall, 0}), "display descriptor refused: ok"},
        {"sends half a descriptor", only(0x01, {UsbStatus::ok, 15}),
         "display descriptor has 15 bytes instead of 30"},
        {"sends a garbage descriptor", only(0x01, {UsbStatus::ok, 30}, garbage), "begins with 0xa5a5a5a5"},
        {"claims more than it sent", only(0x01, {UsbStatus::ok, 4000}, garbage), "begins with 0xa5a5a5a5"},
        {"has no formats", only(0x40, {UsbStatus::ok, 0}), "format list is empty"},
        {"has foreign formats", only(0x40, {UsbStatus::ok, 2}, {0x01, 0x40}),
         "offers R1, RGB565, allowed: R8, XRGB8888, RGB888"},
        {"has odd properties", only(0x41, {UsbStatus::ok, 7}, garbage), "property list has 7 bytes"},
        {"has no connectors", only(0x50, {UsbStatus::ok, 0}), "connector list is empty"},
        {"is not connected", only(0x54, {UsbStatus::ok, 1}, {0}), "nothing is connected"},
        {"has garbage modes", only(0x55, {UsbStatus::ok, 48}, garbage), "entry 0 of the mode list"},
        {"has no modes", only(0x55, {UsbStatus::ok, 0}), "no mode within its own limits"},
        {"does not answer", only(0x50, {UsbStatus::timeout, 0}), "connector list: timed out"},
    };
    for (const Case& c : cases) {
        INFO(c.what);
        StderrCapture capture;
        Rig rig;
        std::atomic<int> asked{0};
        rig.bench->on_control_in = [&](std::uint8_t request, std::span<std::uint8_t> data) {
            if (request == 0x01) ++asked;
            return c.answer(request, data);
        };
        rig.output->start();
        REQUIRE(rig.wait_until([&] { return asked >= 4; })); // tried again and again
        CHECK_FALSE(rig.output->status().connected);
        CHECK_FALSE(rig.output->submit(rig.full(1, pattern)));
        rig.output->stop();
        const std::string text = capture.text();
        CHECK_THAT(text, ContainsSubstring(c.line));
        CHECK(lines_with(text, "fake display") == 1);
        CHECK(rig.bench->with([](FakeBench& b) { return b.open_handles == 0; }));
    }
}

TEST_CASE("The mode is that of the wanted refresh rate, or else the preferred one") {
    std::vector<std::uint8_t> modes;
    for (const auto& [hz, flags] : {std::pair{50.0, 0u}, {60.0, 1u << 10}, {75.0, 0u}}) {
        gud::Mode m;
        m.hdisplay = width, m.hsync_start = width + 8, m.hsync_end = width + 16, m.htotal = width + 32;
        m.vdisplay = height, m.vsync_start = height + 4, m.vsync_end = height + 8, m.vtotal = height + 16;
        m.clock_khz = static_cast<std::uint32_t>(std::lround(hz * m.htotal * m.vtotal / 1000));
        m.flags = flags;
        const auto bytes = gud::encode(m);
        modes.insert(modes.end(), bytes.begin(), bytes.end());
    }
    for (const auto& [wanted_hz, line] :
         {std::pair{0.0, "at 60.0 Hz"}, {52.0, "at 50.0 Hz"}, {90.0, "at 75.0 Hz"}}) {
        StderrCapture capture;
        Rig rig({}, [hz = wanted_hz](StimulatorSettings& s) { s.refresh_hz = hz; });
        rig.bench->on_control_in = [&](std::uint8_t request,
                                       std::span<std::uint8_t> data) -> std::optional<UsbResult> {
            if (request != 0x55) return std::nullopt; // get_connector_modes
            std::copy(modes.begin(), modes.end(), data.begin());
            return UsbResult{UsbStatus::ok, modes.size()};
        };
        rig.output->start();
        REQUIRE(rig.wait_connected());
        rig.output->stop();
        CHECK_THAT(capture.text(), ContainsSubstring(line));
    }
}

TEST_CASE("A device that refuses the mode or an update says so in one line") {
    StderrCapture capture;
    Rig rig;
    SECTION("the mode") {
        rig.bench->on_control_in = [](std::uint8_t request,
                                      std::span<std::uint8_t> data) -> std::optional<UsbResult> {
            static int after = 0;
            if (request == 0x55) after = 1; // the status after the next request is that of the state check
            if (request != 0x00 || after == 0) return std::nullopt;
            after = 0;
            data[0] = 4;
            return UsbResult{UsbStatus::ok, 1};
        };
        rig.output->start();
        CHECK(rig.wait_until([&] { return lines_with(capture.so_far(), "refused mode") >= 1; }));
        rig.output->stop();
        CHECK_THAT(capture.text(), ContainsSubstring("refused mode 96x80 in R8: invalid parameter"));
    }
    SECTION("every update: tried a few times, then from the start") {
        std::atomic<int> opened{0};
        rig.bench->on_control_out = [&](std::uint8_t request) -> std::optional<UsbResult> {
            if (request == 0x63) ++opened;
            if (request == 0x60) return UsbResult{UsbStatus::stall, 0};
            return std::nullopt;
        };
        rig.output->start();
        std::uint64_t id = 0;
        REQUIRE(rig.wait_until([&] {
            rig.output->submit(rig.full(++id, pattern));
            rig.wait_settled();
            return opened >= 3;
        }));
        rig.output->stop();
        const std::string text = capture.text();
        CHECK(lines_with(text, "refused an update: stalled") >= 1);
        CHECK(rig.output->counters().delivered == 0);
    }
}

TEST_CASE("Missing, foreign and forbidden devices are waited for, with one line") {
    StderrCapture capture;
    Rig rig({}, [](StimulatorSettings& s) { s.serial = "FAKE-2"; });
    const auto rest = [] { std::this_thread::sleep_for(std::chrono::milliseconds(30)); };
    SECTION("not plugged in") {
        rig.bench->plugged = false;
        rig.output->start();
        CHECK(rig.wait_until([&] { return lines_with(capture.so_far(), "waiting for it") >= 1; }));
        rest(); // several more tries
        rig.output->stop();
        CHECK(lines_with(capture.text(),
                         "stimulator 1d50:614d serial FAKE-2: not plugged in, waiting for it") == 1);
    }
    SECTION("another serial number, then the right one") {
        rig.output->start();
        CHECK(rig.wait_until([&] { return lines_with(capture.so_far(), "there are serials") >= 1; }));
        rest();
        CHECK_FALSE(rig.output->status().connected);
        rig.bench->with([](FakeBench& b) {
            b.serial = "FAKE-2";
            return 0;
        });
        CHECK(rig.wait_connected());
        rig.output->stop();
        const std::string text = capture.text();
        CHECK(lines_with(text, "there are serials FAKE-1") == 1);
        CHECK(lines_with(text, "fake display: 96x80 at 60.0 Hz, R8 with 256 levels, LZ4, frame status") == 1);
    }
    SECTION("no permission") {
        rig.bench->serial = "FAKE-2";
        rig.bench->problem = "Access denied (insufficient permissions)";
        rig.output->start();
        CHECK(rig.wait_until([&] { return lines_with(capture.so_far(), "cannot be opened") >= 1; }));
        rest();
        rig.output->stop();
        CHECK(lines_with(capture.text(), "cannot be opened: Access denied") == 1);
    }
}

TEST_CASE("The device's own account of what it showed is read where it has one") {
    const bool has = GENERATE(true, false);
    tools::GudDeviceSettings display;
    display.frame_status = has;
    Rig rig(display);
    rig.output->start();
    REQUIRE(rig.wait_connected());
    CHECK(rig.output->status().has_frame_status == has);
    REQUIRE(rig.output->submit(rig.full(1, pattern)));
    REQUIRE(rig.wait_settled());
    if (has) {
        CHECK(rig.wait_until([&] { return rig.output->status().device_shown == 1; }));
        // The fake's clock stands still at 1000 ns: shown "now" whenever it is asked.
        CHECK(rig.output->status().last_shown.ns > 0);
    }
    CHECK(rig.output->counters().delivered == 1);
}

TEST_CASE("Nonsense in the extension is asked for only once") {
    Rig rig;
    std::atomic<int> asked{0};
    rig.bench->on_control_in = [&](std::uint8_t request,
                                   std::span<std::uint8_t>) -> std::optional<UsbResult> {
        if (request != 0xC0) return std::nullopt;
        ++asked;
        return UsbResult{UsbStatus::ok, 3};
    };
    rig.output->start();
    REQUIRE(rig.wait_connected());
    REQUIRE(rig.output->submit(rig.full(1, pattern)));
    REQUIRE(rig.wait_settled());
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    CHECK(asked == 1);
    CHECK_FALSE(rig.output->status().has_frame_status);
    CHECK(rig.output->counters().delivered == 1);
}

} // namespace stimulator_output_test
