// Lines, counters, timers and sequencer: against a camera whose activity the test makes up.
#include "core/clock.hpp"
#include "tests/support/catch.hpp"
#include "transports/gige/device.hpp"

#include <utility>

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

/// Remembers what it is told and shows what it is given.
struct PaperCamera final : CameraControl {
    CameraLimits limits_;
    CameraSettings settings_;
    Sequence sequence;
    CameraActivity shown;
    bool running = false;

    PaperCamera() {
        limits_.sensor_width = 640;
        limits_.sensor_height = 480;
        limits_.black_level_max_dn = 2048;
        limits_.temperature_c = -31.5;
        settings_.region = {0, 0, 320, 240};
    }
    [[nodiscard]] CameraLimits limits() const override { return limits_; }
    [[nodiscard]] CameraSettings settings() const override { return settings_; }
    bool apply(const CameraSettings& s) override {
        settings_ = s;
        return true;
    }
    bool acquisition_start() override { return !std::exchange(running, true); }
    void acquisition_stop(bool) override { running = false; }
    [[nodiscard]] bool acquiring() const override { return running; }
    bool software_trigger(Time) override { return false; }
    bool set_sequence(const Sequence& s) override {
        if (!explain_invalid(s, settings_, limits_).empty()) return false;
        sequence = s;
        return true;
    }
    [[nodiscard]] CameraActivity activity() const override { return shown; }
};

struct Bench {
    FakeClock clock{Time{1'000'000'000}};
    PaperCamera camera;
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

TEST_CASE("Line0 shows its edges, Line1 what it is wired to, both inverted on demand") {
    Bench b;
    CHECK(b.read(feature::line_status_all) == 0);
    b.camera.shown.line0_edges = 1;
    b.camera.shown.line0_edge = b.clock.now();
    CHECK(b.read(feature::line_status_all) == 1);
    b.clock.advance(ns_per_ms);
    CHECK(b.read(feature::line_status_all) == 0);
    b.set(feature::line_inverter, 1);
    CHECK(b.read(feature::line_status_all) == 1);
    b.set(feature::line_inverter, 0);

    const auto line1 = [&] { return b.read(feature::line_status_all) >> 1; };
    b.frame(1000, 3000);
    CHECK(line1() == 1); // ExposureActive after reset
    b.set(feature::line_inverter + 4, 1);
    CHECK(line1() == 0);
    b.set(feature::line_inverter + 4, 0);
    b.clock.advance(1000);
    CHECK(line1() == 0);
    b.set(feature::line_source, static_cast<std::uint32_t>(LineSource::frame_active));
    CHECK(line1() == 1);
    b.clock.advance(2000);
    CHECK(line1() == 0);
    b.set(feature::line_source, static_cast<std::uint32_t>(LineSource::acquisition_active));
    CHECK(line1() == 0);
    b.camera.running = true;
    CHECK(line1() == 1);
    b.set(feature::line_source, static_cast<std::uint32_t>(LineSource::frame_trigger_wait));
    CHECK(line1() == 0);
    b.camera.shown.trigger_ready = true;
    CHECK(line1() == 1);
    b.set(feature::line_source, static_cast<std::uint32_t>(LineSource::user_output0));
    CHECK(line1() == 0);
    b.set(feature::user_output_value, 1);
    CHECK(line1() == 1);
    CHECK(b.write(feature::line_source, line_source_count) == Status::invalid_parameter);
    CHECK(b.write(feature::line_status_all, 0) == Status::write_protect);
}

TEST_CASE("Counters count from their reset on, and stop at their duration") {
    Bench b;
    constexpr std::uint32_t c1 = feature::counters + feature::counter_stride;
    b.camera.shown.line0_edges = 100;
    CHECK(b.read(c1 + feature::counter::status) == static_cast<std::uint32_t>(IoStatus::idle));
    b.set(c1 + feature::counter::event_source, static_cast<std::uint32_t>(IoEvent::line0));
    CHECK(b.read(c1 + feature::counter::value) == 0);
    b.camera.shown.line0_edges += 7;
    CHECK(b.read(c1 + feature::counter::value) == 7);
    CHECK(b.read(feature::counters + feature::counter::value) == 0); // the other one is off
    CHECK(b.read(c1 + feature::counter::status) == static_cast<std::uint32_t>(IoStatus::active));
    b.set(c1 + feature::counter::reset, 1);
    CHECK(b.read(c1 + feature::counter::value) == 0);
    CHECK(b.read(c1 + feature::counter::value_at_reset) == 7);
    b.set(c1 + feature::counter::duration, 3);
    b.camera.shown.line0_edges += 5;
    CHECK(b.read(c1 + feature::counter::value) == 3);
    CHECK(b.read(c1 + feature::counter::status) == static_cast<std::uint32_t>(IoStatus::completed));

    // Frame events are counted when they happen, not when they are planned.
    b.set(feature::counters + feature::counter::event_source,
          static_cast<std::uint32_t>(IoEvent::exposure_end));
    b.set(feature::counters + feature::counter::reset_source, 1);
    b.frame(1000, 3000);
    CHECK(b.read(feature::counters + feature::counter::value) == 0);
    b.clock.advance(1000);
    CHECK(b.read(feature::counters + feature::counter::value) == 1);
    b.set(feature::acquisition_start, 1);
    CHECK(b.read(feature::counters + feature::counter::value) == 0);
    CHECK(b.read(feature::counters + feature::counter::value_at_reset) == 1);
    CHECK(b.write(feature::counters + feature::counter::event_source, io_event_count) ==
          Status::invalid_parameter);
}

TEST_CASE("Timers run their delay and duration after each trigger") {
    Bench b;
    const auto status = [&] {
        return static_cast<IoStatus>(b.read(feature::timers + feature::timer::status));
    };
    const auto value = [&] { return b.read(feature::timers + feature::timer::value); };
    b.set(feature::line_source, static_cast<std::uint32_t>(LineSource::timer0_active));
    const auto line1 = [&] { return b.read(feature::line_status_all) >> 1; };
    CHECK(status() == IoStatus::idle);
    b.set(feature::timers + feature::timer::trigger_source, static_cast<std::uint32_t>(IoEvent::line0));
    b.set(feature::timers + feature::timer::delay, 2000); // 20 us
    b.set(feature::timers + feature::timer::duration, 5000);
    CHECK(status() == IoStatus::trigger_wait);
    b.camera.shown.line0_edges = 1;
    b.camera.shown.line0_edge = b.clock.now();
    CHECK(status() == IoStatus::active);
    CHECK(line1() == 0); // delayed
    b.clock.advance(25'000);
    CHECK(status() == IoStatus::active);
    CHECK(value() == 500);
    CHECK(line1() == 1);
    b.clock.advance(45'000);
    CHECK(status() == IoStatus::completed);
    CHECK(value() == 5000);
    CHECK(line1() == 0);
    b.clock.advance(1);
    b.set(feature::timers + feature::timer::reset, 1);
    CHECK(status() == IoStatus::trigger_wait);
    CHECK(value() == 0);
}

TEST_CASE("The sequencer saves features into sets and runs along them") {
    Bench b;
    CHECK(b.write(feature::sequencer_set_save, 1) == Status::write_protect); // not configuring
    CHECK(b.write(feature::sequencer_set_next, 1) == Status::write_protect);
    b.set(feature::sequencer_configuration, 1);
    CHECK(b.write(feature::sequencer_mode, 1) == Status::write_protect);
    b.set(feature::sequencer_feature_enable, 1);     // ExposureTime
    b.set(feature::sequencer_feature_enable + 4, 1); // Gain
    for (const std::uint32_t set : {2U, 5U}) {
        b.set(feature::exposure_time, set * 1000);
        b.set(feature::gain, set * 1000);
        b.set(feature::sequencer_set_selector, set);
        b.set(feature::sequencer_set_save, 1);
    }
    b.set(feature::sequencer_set_next + 4 * 2, 5);
    b.set(feature::sequencer_set_next + 4 * 5, 2);
    b.set(feature::sequencer_set_start, 2);
    b.set(feature::sequencer_set_selector, 2);
    b.set(feature::sequencer_set_load, 1);
    CHECK(b.read(feature::exposure_time) == 2000);
    CHECK(b.camera.settings_.gain_db == 2);
    b.set(feature::sequencer_configuration, 0);
    CHECK_FALSE(b.camera.sequence.enabled);
    b.set(feature::sequencer_mode, 1);
    REQUIRE(b.camera.sequence.enabled);
    CHECK(b.camera.sequence.features == (sequenced_exposure | sequenced_gain));
    CHECK(b.camera.sequence.start == 2);
    CHECK(b.camera.sequence.steps[2].next == 5);
    CHECK(b.camera.sequence.steps[5].next == 2);
    CHECK(b.camera.sequence.steps[5].exposure_ns == 50'000);
    CHECK(b.camera.sequence.steps[5].gain_db == 5);
    CHECK(b.write(feature::sequencer_configuration, 1) == Status::write_protect);
    b.camera.shown.sequence_step = 5;
    CHECK(b.read(feature::sequencer_set_active) == 5);
    b.set(feature::acquisition_start, 1);
    CHECK(b.write(feature::sequencer_mode, 0) == Status::write_protect); // while streaming
    b.set(feature::acquisition_stop, 1);
    b.set(feature::device_reset, 1);
    CHECK_FALSE(b.camera.sequence.enabled);
}

TEST_CASE("Small features are the camera's, not numbers on their own") {
    Bench b;
    CHECK(static_cast<std::int32_t>(b.read(feature::temperature)) == -31'500);
    CHECK(b.read(feature::binning_horizontal) == 1);
    CHECK(b.write(feature::binning_horizontal, 2) == Status::write_protect);
    b.set(feature::black_level, 100'500);
    CHECK(b.camera.settings_.black_level_dn == 100.5);
    CHECK(b.write(feature::black_level, 2'048'001) == Status::invalid_parameter);
    b.set(feature::test_pattern, 7);
    CHECK(b.camera.settings_.test_pattern == ImagePattern::frame_counter);
    CHECK(b.write(feature::test_pattern, image_pattern_count) == Status::invalid_parameter);
    b.set(feature::frame_rate_enable, 0);
    CHECK_FALSE(b.camera.settings_.frame_rate_enabled);
    b.set(feature::trigger_divider, 4);
    CHECK(b.camera.settings_.trigger_divider == 4);
    CHECK(b.write(feature::trigger_divider, 0) == Status::invalid_parameter);
}
