// SPDX-License-Identifier: Apache-2.0
// Lines, counters, timers and sequencer: against a camera whose activity the test makes up.
#include "core/camera/io_state.hpp"
#include "core/clock.hpp"
#include "tests/support/catch.hpp"
#include "transports/gige/channels/binning.hpp"
#include "transports/gige/control/control_port.hpp"
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/genicam/description.hpp"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace gige_io_test {

using namespace obscura;
using namespace obscura::transports::gige;

namespace {

struct SilentStream final : StreamPort {
    bool begin(const StreamConfig&) override { return true; }
    void abort() noexcept override {}
    [[nodiscard]] bool idle() const noexcept override { return true; }
    bool wait_idle(std::int64_t) noexcept override { return true; }
    void resend(const ResendRequest&) noexcept override {}
    bool send_test_packet(const StreamConfig&) noexcept override { return true; }
    [[nodiscard]] std::uint16_t source_port() const noexcept override { return 4242; }
};

/// Word of an item of LineSource.
std::uint32_t line_source(std::string_view item) {
    for (const FeatureEntry& e : feature("LineSource").entries)
        if (e.name == item) return e.value;
    FAIL("no such item");
    return 0;
}

/// Remembers what it is told and shows what it is given.
struct PaperCamera final : CameraControl {
    CameraLimits limits_;
    CameraSettings settings_;
    Sequence sequence;
    CameraActivity shown;
    IoMarks marks;
    const Clock& clock;
    bool running = false;

    explicit PaperCamera(const Clock& clock_) : clock(clock_) {
        limits_.sensor_width = 640;
        limits_.sensor_height = 480;
        limits_.black_level_max_dn = 2048;
        limits_.temperature_c = -31.5;
        limits_.windows_max = 4;
        settings_.region = {0, 0, 320, 240};
    }
    [[nodiscard]] CameraLimits limits() const override { return limits_; }
    [[nodiscard]] CameraSettings settings() const override { return settings_; }
    bool apply(const CameraSettings& s) override {
        if (!explain_invalid(s, limits_).empty()) return false;
        for (std::size_t i = 0; i < counter_count; ++i)
            if (settings_.counters[i].source != s.counters[i].source)
                marks.rebase_counter(i, count_of(s.counters[i].source, io_inputs(*this, clock)));
        settings_ = s;
        return true;
    }
    bool acquisition_start() override {
        for (std::size_t i = 0; i < counter_count; ++i)
            if (settings_.counters[i].reset == CounterReset::acquisition_start) reset_counter(i);
        return !std::exchange(running, true);
    }
    void reset_counter(std::size_t i) override {
        marks.reset_counter(settings_.counters[i], i, io_inputs(*this, clock));
    }
    void reset_timer(std::size_t i) override { marks.reset_timer(i, clock.now()); }
    void acquisition_stop(bool) override { running = false; }
    [[nodiscard]] bool acquiring() const override { return running; }
    bool software_trigger(Time) override { return false; }
    bool set_sequence(const Sequence& s) override {
        if (!explain_invalid(s, settings_, limits_).empty()) return false;
        sequence = s;
        return true;
    }
    [[nodiscard]] CameraActivity activity() const override {
        CameraActivity a = shown;
        marks.fill(a);
        return a;
    }
    /// A chip that exposes 5 us longer than asked, and reads non-destructive windows in several.
    [[nodiscard]] ReadoutAnswer readout(const CameraSettings& s) const override {
        ReadoutAnswer answer;
        answer.frame_period_ns = 20 * ns_per_ms;
        answer.readout_ns = ns_per_ms;
        for (std::size_t i = 0; i < s.window_count(); ++i) {
            const CameraWindow w = s.window(i);
            const int reads = w.sampling == Sampling::non_destructive ? w.reads : 1;
            for (int k = 0; k < reads; ++k) {
                FrameWindow& f = answer.windows[answer.window_count++];
                f.sensor = w.region;
                f.request = static_cast<std::uint32_t>(i);
                f.image_y = static_cast<std::int32_t>(100 * i);
                f.exposure_min_ns = f.exposure_max_ns = w.exposure_ns + 5000 + k * 1000;
                f.flags = 1U << k;
            }
        }
        return answer;
    }
};

struct Bench {
    FakeClock clock{Time{1'000'000'000}};
    PaperCamera camera{clock};
    SilentStream stream;
    MessageChannel messages{NetworkInterface{}};
    Device device{GigeSettings{}, NetworkInterface{}, camera, stream, messages, clock};

    std::uint32_t read(std::uint32_t address) {
        std::uint32_t value = 0xDEADBEEF;
        REQUIRE(device.registers().read_word(address, value) == Status::success);
        return value;
    }
    Status write(std::uint32_t address, std::uint32_t value) {
        return device.registers().write_word(address, value);
    }
    void set(std::uint32_t address, std::uint32_t value) {
        REQUIRE(write(address, value) == Status::success);
    }
    /// A frame whose trigger came now.
    void frame(std::int64_t exposure_ns, std::int64_t whole_ns) {
        CameraActivity& a = camera.shown;
        ++a.frames;
        ++a.frame_triggers;
        a.frame_start = a.exposure_start = clock.now();
        a.exposure_end = clock.now() + exposure_ns;
        a.frame_end = clock.now() + whole_ns;
    }
};

} // namespace

TEST_CASE("inputs show their edges, the output what it is wired to, all inverted on demand") {
    Bench b;
    CHECK(b.read(address_of("LineStatusAll")) == 0);
    b.camera.shown.lines[0].edges = 1;
    b.camera.shown.lines[0].edge = b.clock.now();
    CHECK(b.read(address_of("LineStatusAll")) == 1);
    b.clock.advance(ns_per_ms);
    CHECK(b.read(address_of("LineStatusAll")) == 0);
    b.set(address_of("LineInverter"), 1);
    CHECK(b.read(address_of("LineStatusAll")) == 1);
    b.set(address_of("LineInverter"), 0);

    const auto output = [&] { return b.read(address_of("LineStatusAll")) >> 4; };
    b.frame(1000, 3000);
    CHECK(output() == 1); // ExposureActive after reset
    b.set(address_of("LineInverter") + 16, 1);
    CHECK(output() == 0);
    b.set(address_of("LineInverter") + 16, 0);
    b.clock.advance(1000);
    CHECK(output() == 0);
    b.set(address_of("LineSource"), line_source("FrameActive"));
    CHECK(output() == 1);
    b.clock.advance(2000);
    CHECK(output() == 0);
    b.set(address_of("LineSource"), line_source("AcquisitionActive"));
    CHECK(output() == 0);
    b.camera.running = true;
    CHECK(output() == 1);
    b.set(address_of("LineSource"), line_source("FrameTriggerWait"));
    CHECK(output() == 0);
    b.camera.shown.trigger_ready = true;
    CHECK(output() == 1);
    b.set(address_of("LineSource"), line_source("UserOutput0"));
    CHECK(output() == 0);
    b.set(address_of("UserOutputValueAll"), 1);
    CHECK(output() == 1);
    CHECK(b.write(address_of("LineSource"), item_count(feature("LineSource"))) == Status::invalid_parameter);
    CHECK(b.write(address_of("LineStatusAll"), 0) == Status::write_protect);
}

TEST_CASE("Counters count from their reset on, and stop at their duration") {
    Bench b;
    b.camera.shown.lines[0].edges = 100;
    CHECK(b.read(address_of("CounterStatus", 1)) == static_cast<std::uint32_t>(IoStatus::idle));
    b.set(address_of("CounterEventSource", 1), static_cast<std::uint32_t>(IoEvent::line0));
    CHECK(b.read(address_of("CounterValue", 1)) == 0);
    b.camera.shown.lines[0].edges += 7;
    CHECK(b.read(address_of("CounterValue", 1)) == 7);
    CHECK(b.read(address_of("CounterValue")) == 0); // the other one is off
    CHECK(b.read(address_of("CounterStatus", 1)) == static_cast<std::uint32_t>(IoStatus::active));
    b.set(address_of("CounterReset", 1), 1);
    CHECK(b.read(address_of("CounterValue", 1)) == 0);
    CHECK(b.read(address_of("CounterValueAtReset", 1)) == 7);
    b.set(address_of("CounterDuration", 1), 3);
    b.camera.shown.lines[0].edges += 5;
    CHECK(b.read(address_of("CounterValue", 1)) == 3);
    CHECK(b.read(address_of("CounterStatus", 1)) == static_cast<std::uint32_t>(IoStatus::completed));
    b.set(address_of("CounterResetSource", 1), static_cast<std::uint32_t>(CounterReset::counter_end));
    CHECK(b.read(address_of("CounterValue", 1)) == 2); // begins anew after every three
    b.camera.shown.lines[0].edges += 1;
    CHECK(b.read(address_of("CounterValue", 1)) == 0);
    CHECK(b.read(address_of("CounterStatus", 1)) == static_cast<std::uint32_t>(IoStatus::active));

    // Frame events are counted when they happen, not when they are planned.
    b.set(address_of("CounterEventSource"), static_cast<std::uint32_t>(IoEvent::exposure_end));
    b.set(address_of("CounterResetSource"), 1);
    b.frame(1000, 3000);
    CHECK(b.read(address_of("CounterValue")) == 0);
    b.clock.advance(1000);
    CHECK(b.read(address_of("CounterValue")) == 1);
    b.set(address_of("AcquisitionStart"), 1);
    CHECK(b.read(address_of("CounterValue")) == 0);
    CHECK(b.read(address_of("CounterValueAtReset")) == 1);
    CHECK(b.write(address_of("CounterEventSource"), io_event_count) == Status::invalid_parameter);
}

TEST_CASE("Timers run their delay and duration after each trigger") {
    Bench b;
    const auto status = [&] { return static_cast<IoStatus>(b.read(address_of("TimerStatus"))); };
    const auto value = [&] { return b.read(address_of("TimerValue")); };
    b.set(address_of("LineSource"), line_source("Timer0Active"));
    const auto output = [&] { return b.read(address_of("LineStatusAll")) >> 4; };
    CHECK(status() == IoStatus::idle);
    b.set(address_of("TimerTriggerSource"), static_cast<std::uint32_t>(IoEvent::line0));
    b.set(address_of("TimerDelay"), 2000); // 20 us
    b.set(address_of("TimerDuration"), 5000);
    CHECK(status() == IoStatus::trigger_wait);
    b.camera.shown.lines[0].edges = 1;
    b.camera.shown.lines[0].edge = b.clock.now();
    CHECK(status() == IoStatus::active);
    CHECK(output() == 0); // delayed
    b.clock.advance(25'000);
    CHECK(status() == IoStatus::active);
    CHECK(value() == 500);
    CHECK(output() == 1);
    b.clock.advance(45'000);
    CHECK(status() == IoStatus::completed);
    CHECK(value() == 5000);
    CHECK(output() == 0);
    b.clock.advance(1);
    b.set(address_of("TimerReset"), 1);
    CHECK(status() == IoStatus::trigger_wait);
    CHECK(value() == 0);
}

TEST_CASE("The sequencer saves features into sets and runs along them") {
    Bench b;
    CHECK(b.write(address_of("SequencerSetSave"), 1) == Status::write_protect); // not configuring
    CHECK(b.write(address_of("SequencerSetNext"), 1) == Status::write_protect);
    b.set(address_of("SequencerConfigurationMode"), 1);
    CHECK(b.write(address_of("SequencerMode"), 1) == Status::write_protect);
    b.set(address_of("SequencerFeatureEnable"), 1);     // ExposureTime
    b.set(address_of("SequencerFeatureEnable") + 4, 1); // Gain
    for (const std::uint32_t set : {2U, 5U}) {
        b.set(address_of("ExposureTime"), set * 1000);
        b.set(address_of("Gain"), set * 1000);
        b.set(address_of("SequencerSetSelector"), set);
        b.set(address_of("SequencerSetSave"), 1);
    }
    b.set(address_of("SequencerSetNext", 2), 5);
    b.set(address_of("SequencerSetNext", 5), 2);
    b.set(address_of("SequencerSetStart"), 2);
    b.set(address_of("SequencerSetSelector"), 2);
    b.set(address_of("SequencerSetLoad"), 1);
    CHECK(b.read(address_of("ExposureTime")) == 2000);
    CHECK(b.camera.settings_.gain_db == 2);
    b.set(address_of("SequencerConfigurationMode"), 0);
    CHECK_FALSE(b.camera.sequence.enabled);
    b.set(address_of("SequencerMode"), 1);
    REQUIRE(b.camera.sequence.enabled);
    CHECK(b.camera.sequence.features == (sequenced_exposure | sequenced_gain));
    CHECK(b.camera.sequence.start == 2);
    CHECK(b.camera.sequence.steps[2].next == 5);
    CHECK(b.camera.sequence.steps[5].next == 2);
    CHECK(b.camera.sequence.steps[5].exposure_ns == 5'000'000);
    CHECK(b.camera.sequence.steps[5].gain_db == 5);
    CHECK(b.write(address_of("SequencerConfigurationMode"), 1) == Status::write_protect);
    b.camera.shown.sequence_step = 5;
    CHECK(b.read(address_of("SequencerSetActive")) == 5);
    b.set(address_of("AcquisitionStart"), 1);
    CHECK(b.write(address_of("SequencerMode"), 0) == Status::write_protect); // while streaming
    b.set(address_of("AcquisitionStop"), 1);
    b.set(address_of("DeviceReset"), 1);
    CHECK_FALSE(b.camera.sequence.enabled);
}

TEST_CASE("Small features are the camera's, not numbers on their own") {
    Bench b;
    CHECK(static_cast<std::int32_t>(b.read(address_of("DeviceTemperature"))) == -31'500);
    CHECK(b.read(address_of("BinningHorizontal")) == 1);
    b.set(address_of("BlackLevel"), 100'500);
    CHECK(b.camera.settings_.black_level_dn == 100.5);
    CHECK(b.write(address_of("BlackLevel"), 2'048'001) == Status::invalid_parameter);
    b.set(address_of("TestPattern"), 7);
    CHECK(b.camera.settings_.test_pattern == ImagePattern::frame_counter);
    CHECK(b.write(address_of("TestPattern"), image_pattern_count) == Status::invalid_parameter);
    b.set(address_of("AcquisitionFrameRateEnable"), 0);
    CHECK_FALSE(b.camera.settings_.frame_rate_enabled);
    CHECK(b.read(address_of("TriggerOverlap")) == 0);
    b.set(address_of("TriggerOverlap"), 2);
    CHECK(b.camera.settings_.trigger_overlap == TriggerOverlap::previous_frame);
    CHECK(b.write(address_of("TriggerOverlap"), 1) == Status::invalid_parameter); // not this chip
    CHECK(b.write(address_of("TriggerOverlap"), 3) == Status::invalid_parameter);
    b.set(address_of("TriggerDivider"), 4);
    CHECK(b.camera.settings_.trigger_divider == 4);
    CHECK(b.write(address_of("TriggerDivider"), 0) == Status::invalid_parameter);
}

TEST_CASE("Binning changes the sizes of the image, and is refused where it makes no sense") {
    Bench b;
    PaperCamera& camera = b.camera;
    const auto put = [&](Region r) { camera.settings_.region = r; };
    put({10, 6, 321, 239});
    CHECK(b.read(address_of("BinningHorizontal")) == 1);
    CHECK(b.read(address_of("WidthMax")) == 640);
    b.set(address_of("BinningHorizontal"), 2);
    CHECK(camera.settings_.region == Region{10, 6, 320, 239}); // whole binned pixels
    b.set(address_of("BinningVertical"), 4);
    CHECK(camera.settings_.region == Region{10, 4, 320, 236});
    CHECK(b.read(address_of("Width")) == 160);
    CHECK(b.read(address_of("Height")) == 59);
    CHECK(b.read(address_of("OffsetX")) == 5);
    CHECK(b.read(address_of("OffsetY")) == 1);
    CHECK(b.read(address_of("WidthMax")) == 320);
    CHECK(b.read(address_of("HeightMax")) == 120);
    CHECK(b.read(address_of("SensorWidth")) == 640);
    CHECK(b.read(address_of("PayloadSize")) == 160 * 59 * 2);
    b.set(address_of("Width"), 315);
    CHECK(b.write(address_of("Width"), 316) == Status::invalid_parameter); // 5 + 316 > 320
    CHECK(b.write(address_of("Width"), 0x7FFFFFFF) == Status::invalid_parameter);
    b.set(address_of("OffsetY"), 2);
    CHECK(camera.settings_.region == Region{10, 8, 630, 236});
    for (const std::uint32_t bad : {0U, 3U, 5U, 8U, 0x80000002U}) {
        CHECK(b.write(address_of("BinningHorizontal"), bad) == Status::invalid_parameter);
        CHECK(b.write(address_of("BinningVertical"), bad) == Status::invalid_parameter);
    }
    CHECK(b.write(address_of("BinningVerticalMode"), 2) == Status::invalid_parameter);
    b.set(address_of("BinningVerticalMode"), 1);
    CHECK(b.read(address_of("BinningHorizontalMode")) == 0);
    CHECK(b.read(address_of("BinningVerticalMode")) == 1);

    // One window, one part, one read; and not while streaming.
    constexpr std::uint32_t multipart = 0x40;
    constexpr std::uint32_t non_destructive = static_cast<std::uint32_t>(Sampling::non_destructive);
    CHECK(b.write(reg::stream_configuration, multipart) == Status::write_protect);
    CHECK(b.write(address_of("RegionMode", 1), 1) == Status::write_protect);
    CHECK(b.write(address_of("RegionSampling"), non_destructive) == Status::write_protect);
    b.set(address_of("Width", 1), 33); // while it is off, in sensor pixels
    CHECK(b.read(address_of("Width", 1)) == 33);
    camera.running = true;
    CHECK(b.write(address_of("BinningHorizontal"), 1) == Status::write_protect);
    CHECK(b.write(address_of("BinningVerticalMode"), 0) == Status::write_protect);
    b.set(address_of("OffsetX"), 0);
    camera.running = false;
    b.set(address_of("BinningHorizontal"), 1);
    b.set(address_of("BinningVertical"), 1);
    CHECK(camera.settings_.region == Region{0, 8, 630, 236});
    const auto refused = [&] {
        CHECK(b.write(address_of("BinningHorizontal"), 2) == Status::write_protect);
        CHECK(b.write(address_of("BinningVertical"), 2) == Status::write_protect);
        CHECK(b.write(address_of("BinningVertical"), 1) == Status::success);
    };
    b.set(reg::stream_configuration, multipart);
    refused();
    b.set(reg::stream_configuration, 0);
    b.set(address_of("RegionMode", 1), 1);
    refused();
    b.set(address_of("RegionMode", 1), 0);
    b.set(address_of("RegionSampling"), non_destructive);
    refused();
    b.set(address_of("RegionSampling"), 0);

    // A user set brings it back, whatever the region is meanwhile; in several parts the set cannot be had.
    b.set(address_of("BinningHorizontal"), 4);
    b.set(address_of("BinningVertical"), 2);
    b.set(address_of("OffsetX"), 3);
    b.set(address_of("Width"), 100);
    b.set(address_of("UserSetSelector"), 1);
    b.set(address_of("UserSetSave"), 1);
    b.set(address_of("UserSetSelector"), 0);
    b.set(address_of("UserSetLoad"), 1);
    CHECK(b.read(address_of("BinningHorizontal")) == 1);
    CHECK(b.read(address_of("BinningVerticalMode")) == 0);
    CHECK(camera.settings_.region == Region{0, 0, 320, 240});
    b.set(address_of("UserSetSelector"), 1);
    b.set(reg::stream_configuration, multipart);
    CHECK(b.write(address_of("UserSetLoad"), 1) == Status::write_protect);
    CHECK(camera.settings_.region == Region{0, 0, 320, 240});
    b.set(reg::stream_configuration, 0);
    put({639, 479, 1, 1}); // less than one binned pixel
    b.set(address_of("RegionSampling"), non_destructive);
    b.set(address_of("UserSetLoad"), 1);
    CHECK(b.read(address_of("BinningHorizontal")) == 4);
    CHECK(b.read(address_of("BinningVertical")) == 2);
    CHECK(b.read(address_of("BinningVerticalMode")) == 1);
    CHECK(camera.settings_.region == Region{12, 8, 400, 236});
    b.set(address_of("DeviceReset"), 1);
    CHECK(b.read(address_of("BinningVertical")) == 1);
}

TEST_CASE("Steps of the chip and of binning are obeyed together") {
    FakeClock clock;
    PaperCamera camera{clock};
    camera.limits_.width_step = 6;
    camera.limits_.width_min = 18;
    camera.limits_.sensor_width = 642;
    camera.settings_.region = {18, 0, 306, 240};
    SilentStream stream;
    MessageChannel messages{NetworkInterface{}};
    Device device{GigeSettings{}, NetworkInterface{}, camera, stream, messages, clock};
    RegisterBank& bank = device.registers();
    const auto read = [&](std::uint32_t address) {
        std::uint32_t value = 0;
        REQUIRE(bank.read_word(address, value) == Status::success);
        return value;
    };
    REQUIRE(bank.write_word(address_of("BinningHorizontal"), 4) == Status::success);
    CHECK(camera.settings_.region == Region{12, 0, 300, 240});
    CHECK(read(address_of("WidthMin")) == 6);   // 24 pixels, the first multiple of 12 from 18 on
    CHECK(read(address_of("WidthMax")) == 159); // 636 pixels
    CHECK(read(address_of("WidthStep")) == 3);  // 12 pixels
    for (std::uint32_t width = 0; width < 161; ++width) {
        CAPTURE(width);
        const bool fits = width >= 6 && width <= 156 && width % 3 == 0; // 3 + 156 = 159
        CHECK((bank.write_word(address_of("Width"), width) == Status::success) == fits);
    }
}

TEST_CASE("A sum stops at full scale, an average rounds half up") {
    FramePool pool(1, 64, 8);
    const FrameRef frame = pool.acquire();
    frame->info.width = 8;
    frame->info.height = 4;
    RowBinner binner;
    binner.reserve(8);
    const auto first = [&](PixelFormat format, int bits, std::uint16_t fill, std::uint16_t corner,
                           const Binning& binning) {
        frame->info.bits_per_pixel = bits;
        std::fill_n(frame->pixels().data(), 32, fill);
        frame->pixels()[0] = corner;
        return binner.row(*frame, 0, 8 / binning.horizontal, format, binning)[0];
    };
    const auto sum = BinningMode::sum, average = BinningMode::average;
    CHECK(first(PixelFormat::mono16, 16, 65535, 65535, {4, 4, sum, sum}) == 65535);
    CHECK(first(PixelFormat::mono16, 12, 4095, 4095, {4, 4, sum, sum}) == 16 * 4095);
    CHECK(first(PixelFormat::mono14, 12, 4095, 4095, {4, 4, sum, sum}) == 16383);
    CHECK(first(PixelFormat::mono12p, 12, 1024, 1023, {2, 2, sum, sum}) == 4095);
    CHECK(first(PixelFormat::mono12, 12, 1024, 1024, {2, 2, sum, sum}) == 4095);
    CHECK(first(PixelFormat::mono12, 10, 1023, 1023, {2, 2, sum, sum}) == 4092);
    CHECK(first(PixelFormat::mono8, 12, 1024, 1022, {2, 2, sum, sum}) == 4094); // 255 on the wire
    CHECK(first(PixelFormat::mono16, 16, 65535, 65535, {4, 4, average, average}) == 65535);
    CHECK(first(PixelFormat::mono16, 16, 7, 8, {2, 1, average, sum}) == 8);     // 7.5
    CHECK(first(PixelFormat::mono16, 16, 7, 8, {2, 2, average, average}) == 7); // 7.25
    CHECK(first(PixelFormat::mono16, 16, 7, 9, {2, 2, average, average}) == 8); // 7.5
    CHECK(first(PixelFormat::mono16, 16, 0, 7, {4, 4, average, average}) == 0); // 7/16
    CHECK(first(PixelFormat::mono16, 16, 0, 8, {4, 4, average, average}) == 1); // 8/16
    CHECK(first(PixelFormat::mono16, 16, 7, 8, {2, 4, average, sum}) == 29);    // 28.5
}

TEST_CASE("A binned row is reset with its first row and read with its last") {
    FramePool pool(1, 64, 8);
    const FrameRef frame = pool.acquire();
    frame->info.width = 8;
    frame->info.height = 7; // the last three rows are of no binned one
    for (std::int64_t row = 0; row < 7; ++row)
        frame->row_times()[static_cast<std::size_t>(row)] = {Time{100 + 10 * row}, Time{500 + 10 * row}};
    const std::uint32_t selection = chunk_bit(Chunk::row_times);
    std::vector<std::uint8_t> out(chunk_bytes(selection, 1));
    for (const std::int32_t vertical : {4, 2}) {
        out.assign(chunk_bytes(selection, 7 / vertical), 0);
        REQUIRE(write_chunks(out, selection, *frame, {.frame_id = 1, .binning = {1, vertical}}) ==
                out.size() - chunk_tag_bytes); // no tag of an image
        CHECK(out[3] == 7 / vertical);
        for (std::int32_t row = 0; row < 7 / vertical; ++row) {
            const auto low_word = [&](std::int32_t at) {
                const auto i = static_cast<std::size_t>(8 + 16 * row + at);
                return out[i + 6] << 8 | out[i + 7];
            };
            CHECK(low_word(0) == 100 + 10 * vertical * row);
            CHECK(low_word(8) == 500 + 10 * (vertical * row + vertical - 1));
        }
    }
}

TEST_CASE("Regions are the windows of the sensor, each with an integration time of its own") {
    Bench b;
    CHECK(b.read(address_of("RegionsMax")) == 4);
    CHECK(b.read(address_of("RegionMode")) == 1);
    CHECK(b.write(address_of("RegionMode"), 0) ==
          Status::invalid_parameter); // the first cannot be switched off
    CHECK(b.read(address_of("RegionMode", 2)) == 0);
    std::uint32_t none = 0;
    CHECK(b.device.registers().read_word(address_of("RegionMode", 4), none) == Status::invalid_address);

    // Set while it is off, then switched on: the camera gets it whole.
    b.set(address_of("Width", 2), 64);
    b.set(address_of("Height", 2), 32);
    b.set(address_of("OffsetX", 2), 10);
    b.set(address_of("OffsetY", 2), 300);
    b.set(address_of("RegionExposureTime", 2), 70);
    CHECK(b.write(address_of("OffsetX", 2), 600) ==
          Status::invalid_parameter); // off the sensor even when off
    CHECK(b.camera.settings_.window_count() == 1);
    CHECK(b.read(address_of("RegionExposureTimeMin", 2)) == 0);
    b.set(address_of("RegionMode", 2), 1);
    REQUIRE(b.camera.settings_.window_count() == 2);
    CHECK(b.camera.settings_.window(1).region == Region{10, 300, 64, 32});
    CHECK(b.camera.settings_.window(1).exposure_ns == 70'000);
    CHECK(b.read(address_of("RegionExposureTimeMin", 2)) == 75); // what is obtained
    CHECK(b.read(address_of("RegionImageY", 2)) == 100);
    CHECK(b.read(address_of("RegionExposureTimeMin")) == 10'005);
    CHECK(b.read(address_of("PayloadSize")) == 320 * (240 + 32) * 2);

    // One before it: order is by number.
    b.set(address_of("Width", 1), 16);
    b.set(address_of("Height", 1), 16);
    b.set(address_of("RegionMode", 1), 1);
    REQUIRE(b.camera.settings_.window_count() == 3);
    CHECK(b.camera.settings_.window(1).region == Region{0, 0, 16, 16});
    CHECK(b.camera.settings_.window(2).region == Region{10, 300, 64, 32});
    CHECK(b.read(address_of("RegionImageY", 2)) == 200);

    // Non-destructive reads are delivered one by one; too many rows are refused and change nothing.
    b.set(address_of("RegionSampling", 2), static_cast<std::uint32_t>(Sampling::non_destructive));
    b.set(address_of("RegionReads", 2), 3);
    CHECK(b.read(address_of("RegionExposureTimeMax", 2)) == 77);
    CHECK(b.read(address_of("RegionFlags", 2)) == 7);
    CHECK(b.write(address_of("RegionReads", 2), 60) == Status::invalid_parameter);
    CHECK(b.read(address_of("RegionReads", 2)) == 3);
    CHECK(b.write(address_of("RegionReads", 2), 10) == Status::invalid_parameter); // with the other windows
    CHECK(b.read(address_of("RegionReads", 2)) == 3);
    b.set(address_of("RegionSampling", 2), static_cast<std::uint32_t>(Sampling::ramp));
    CHECK(b.camera.settings_.window(2).reads == 3);
    b.set(address_of("RegionSampling", 2), static_cast<std::uint32_t>(Sampling::destructive));
    CHECK(b.camera.settings_.window(2).reads == 1);

    // While streaming a window can wander and change its integration time, but not its size.
    b.set(address_of("AcquisitionStart"), 1);
    CHECK(b.write(address_of("Width", 2), 32) == Status::write_protect);
    CHECK(b.write(address_of("RegionMode", 2), 0) == Status::write_protect);
    b.set(address_of("OffsetX", 2), 20);
    CHECK(b.camera.settings_.window(2).region.x == 20);
    b.set(address_of("AcquisitionStop"), 1);

    // User sets hold regions, too.
    b.set(address_of("UserSetSelector"), 1);
    b.set(address_of("UserSetSave"), 1);
    const CameraSettings saved = b.camera.settings_;
    b.set(address_of("DeviceReset"), 1);
    CHECK(b.camera.settings_.window_count() == 1);
    CHECK(b.read(address_of("RegionMode", 2)) == 0);
    b.set(address_of("UserSetSelector"), 1);
    b.set(address_of("UserSetLoad"), 1);
    CHECK(b.camera.settings_ == saved);
}

namespace {

/// A register of camera.xml, for one value of its selector.
struct XmlRegister {
    std::string name, access;
    std::uint32_t address = 0, bytes = 0;
    bool masked = false;
};

std::string between(const std::string& text, const std::string& from, const std::string& to) {
    const std::size_t begin = text.find(from);
    if (begin == std::string::npos) return {};
    const std::size_t end = text.find(to, begin + from.size());
    return text.substr(begin + from.size(), end - begin - from.size());
}

/// Reads the description as text: it is ours, and laid out as it is.
std::vector<XmlRegister> xml_registers() {
    const std::string xml = describe_camera(feature_table());
    // The largest value of a selector: of the integer itself, or of the one that shows its register.
    const auto maximum = [&](const std::string& index) {
        std::string node = between(xml, "<Integer Name=\"" + index + "\"", "</Integer>");
        if (node.find("<Max>") == std::string::npos) {
            const std::size_t use = xml.find("<pValue>" + index + "</pValue>");
            REQUIRE(use != std::string::npos);
            node = xml.substr(use, xml.find("</Integer>", use) - use);
        }
        REQUIRE(node.find("<Max>") != std::string::npos);
        return std::atoi(between(node, "<Max>", "<").c_str());
    };
    std::vector<XmlRegister> registers;
    for (const std::string tag : {"IntReg", "MaskedIntReg", "FloatReg", "StringReg"})
        for (std::size_t at = xml.find("<" + tag + " Name="); at != std::string::npos;
             at = xml.find("<" + tag + " Name=", at + 1)) {
            const std::string node = xml.substr(at, xml.find("</" + tag + ">", at) - at);
            if (between(node, "<pPort>", "<") != "Device") continue;
            XmlRegister r;
            r.name = between(node, "Name=\"", "\"");
            r.access = between(node, "<AccessMode>", "<");
            r.bytes = static_cast<std::uint32_t>(std::atoi(between(node, "<Length>", "<").c_str()));
            r.address = static_cast<std::uint32_t>(
                std::strtoul(between(node, "<Address>", "<").c_str(), nullptr, 16));
            r.masked = tag == "MaskedIntReg";
            const std::string index = between(node, "<pIndex", "/pIndex>");
            const int count = index.empty() ? 1 : maximum(between(index, ">", "<")) + 1;
            for (int i = 0; i < count; ++i) {
                registers.push_back(r);
                r.address += static_cast<std::uint32_t>(std::atoi(between(index, "Offset=\"", "\"").c_str()));
            }
        }
    return registers;
}

} // namespace

TEST_CASE("The table and camera.xml agree register by register, for every value of the selectors") {
    FakeClock clock;
    PaperCamera camera{clock};
    camera.limits_.windows_max = max_windows; // all regions there can be
    SilentStream stream;
    MessageChannel messages{NetworkInterface{}};
    Device device{GigeSettings{}, NetworkInterface{}, camera, stream, messages, clock};
    const ControlPort port{device, GigeSettings{}, NetworkInterface{}};
    const RegisterBank& bank = device.registers();

    std::set<std::uint32_t> named;
    for (const XmlRegister& r : xml_registers()) {
        CAPTURE(r.name, r.address);
        REQUIRE((r.access == "RO" || r.access == "RW" || r.access == "WO"));
        REQUIRE(r.bytes % 4 == 0);
        for (std::uint32_t a = r.address; a < r.address + r.bytes; a += 4) {
            named.insert(a);
            const Register* entry = bank.find(a);
            REQUIRE(entry != nullptr);
            if (r.access == "RW") CHECK(entry->access == Access::read_write);
            if (r.access == "WO") CHECK(entry->access == Access::write_only);
            if (r.access == "RO" && !r.masked) CHECK(entry->access == Access::read_only);
        }
        const Register* entry = bank.find(r.address);
        if (entry->bytes > 4) CHECK((entry->address == r.address && entry->bytes == r.bytes));
    }
    CHECK(named.size() > 700);

    // And back: nothing of the features' space that clients would not find, nor anything else to be written
    // but what belongs to the protocol.
    const std::set<std::uint32_t> protocol{reg::gvcp_configuration, reg::switchover_key};
    for (const Register& r : bank.table())
        for (std::uint32_t a = r.address; a < r.address + r.bytes; a += 4) {
            const bool of_a_feature = a >= manufacturer_begin && a < xml_file_address;
            if (!of_a_feature && (r.access == Access::read_only || protocol.count(a) != 0)) continue;
            CAPTURE(r.name, a);
            CHECK(named.count(a) == 1);
        }
}

} // namespace gige_io_test
