// SPDX-License-Identifier: Apache-2.0
// Calls of control clients against a camera: settings by their names, triggers and their outcomes.
#include "emulator/control/camera_calls.hpp"
#include "emulator/control/camera_features.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

namespace camera_calls_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using service::Failure;
using service::FailureCode;

namespace {

class TestWork final : public service::Work {
public:
    std::atomic<bool> stop{false};

    [[nodiscard]] const std::atomic<bool>& cancelled() const noexcept override { return stop; }
    void progress(std::uint64_t /*done*/, std::uint64_t /*total*/) override {}
    [[nodiscard]] service::Permission permission() const noexcept override { return allowed; }
    service::Permission allowed = service::Permission::scene;
};

/// A camera that waits for software triggers, and the calls of one client.
struct CallsBench : CameraBench {
    explicit CallsBench(std::int64_t exposure_ns = 100 * ns_per_us,
                        sync::OverTrigger policy = sync::OverTrigger::count)
        : CameraBench(
              small_sensor(), 5,
              [exposure_ns](CameraSettings& s) {
                  s.frame_trigger.source = TriggerSource::software;
                  s.exposure_ns = exposure_ns;
              },
              policy) {
        cameras.push_back(std::unique_ptr<ControlledCamera>(new ControlledCamera{
            camera, clock, [this](const transports::Transport::ControlWork& run) { run(controller); }}));
        client = std::make_unique<CameraCalls>(cameras);
        calls = client->calls();
    }
    /// What a client with a connection of its own is told.
    json trigger_as_another_client() {
        CameraCalls another(cameras);
        json none = json::object();
        return service::bind(service::find_call(another.calls(), "camera.trigger"), none).run(work).head;
    }
    json ask(const std::string& call, json fields = json::object()) {
        return service::bind(service::find_call(calls, call), fields).run(work).head;
    }
    Failure refusal(const std::string& call, const json& fields = json::object()) {
        try {
            (void)ask(call, fields);
        } catch (const Failure& failure) {
            return failure;
        }
        FAIL(call << " was not refused");
        return {FailureCode::internal, ""};
    }

    std::string controller;
    CameraCalls::Cameras cameras;
    std::unique_ptr<CameraCalls> client;
    service::Calls calls;
    TestWork work;
};

} // namespace

TEST_CASE("settings go to their names and back without a loss") {
    CameraSettings settings = whole_sensor(small_sensor());
    settings.region = {4, 2, 20, 10};
    settings.exposure_ns = 123'456'789;
    settings.trigger_delay_ns = 987'654;
    settings.gain_db = 6.25;
    settings.exposure_auto = ExposureAuto::continuous;
    settings.acquisition_mode = AcquisitionMode::multi_frame;
    settings.acquisition_frame_count = 4'000'000'000U;
    settings.frame_trigger = {true, TriggerSource::timer1_end, TriggerActivation::any_edge};
    settings.trigger_overlap = TriggerOverlap::previous_frame;
    settings.test_pattern = ImagePattern::vertical_ramp_moving;
    settings.more_count = 2; // is kept, too
    CHECK(CameraFeatures(settings).settings() == settings);

    CameraLimits limits;
    limits.sensor_width = 40, limits.sensor_height = 30;
    limits.black_level_max_dn = 2048;
    CameraFeatures from(settings), to(whole_sensor(small_sensor()));
    service::read_values("test", values_of(from.keys(limits)), to.keys(limits));
    CameraSettings all = to.settings();
    all.more_count = settings.more_count;
    CHECK(all == settings);
}

TEST_CASE("each value of an enumeration has a name of its own") {
    CameraFeatures features{CameraSettings{}};
    for (const config::Key& key : features.keys({}))
        for (const std::string_view choice : key.choices()) {
            INFO(key.name << " " << choice);
            const std::string name(choice);
            service::read_values("test", {{std::string(key.name), name}}, {key});
            CHECK(values_of({key}) == json{{std::string(key.name), name}});
        }
}

TEST_CASE("a write changes all that it names, or nothing, and tells what has changed") {
    CallsBench bench;
    CHECK(bench.ask("camera.set", {{"values", {{"ExposureTime", 200}, {"Gain", 0}}}})["changed"] ==
          json{{"ExposureTime", 200.0}});
    CHECK(bench.camera.settings().exposure_ns == 200 * ns_per_us);
    const Failure range = bench.refusal("camera.set", {{"values", {{"Gain", 3}, {"ExposureTime", 1e10}}}});
    CHECK(range.code == FailureCode::bad_argument);
    CHECK(range.field == "ExposureTime");
    CHECK(range.allowed == "1 to 3.6e9 us");
    CHECK(bench.camera.settings().gain_db == 0);
    // Within the range of each, but not together.
    const Failure window = bench.refusal("camera.set", {{"values", {{"OffsetX", 30}}}});
    CHECK(window.field == "OffsetX");
    CHECK(bench.camera.settings().region.x == 0);
    CHECK(bench.refusal("camera.set", {{"values", 3}}).field == "values");
    CHECK(bench.refusal("camera.set", {{"camera", 1}, {"values", json::object()}}).allowed == "0 to 0");
    CHECK(bench.refusal("camera.get", {{"names", {"Gian"}}}).field == "names");
}

TEST_CASE("camera.features has units, ranges, categories and locks of the setting table") {
    CallsBench bench;
    REQUIRE(bench.camera.acquisition_start());
    const json told = bench.ask("camera.features");
    REQUIRE(told["features"].size() == camera_settings_table.size());
    for (const json& row : told["features"]) {
        INFO(row.dump());
        const Setting* const setting = find_setting(row["name"].get<std::string>());
        REQUIRE(setting != nullptr);
        CHECK(row.value("unit", "") == setting->unit);
        CHECK(row["category"] == setting->category);
        CHECK(row["help"].get<std::string>().starts_with(setting->help));
        CHECK(row["locked"] == setting->is_locked(true));
        CHECK(row.contains("why") == setting->is_locked(true));
        CHECK(row.contains("increment") == (setting->unit == "px"));
        const std::optional<SettingRange> range = setting->range_of(bench.camera.limits());
        REQUIRE(row.contains("min") == range.has_value());
        if (!range) continue;
        CHECK(row["min"] == range->minimum);
        CHECK(row["max"] == range->maximum);
    }
    const ReadoutAnswer answer = bench.camera.readout(bench.camera.settings());
    const double period_us = static_cast<double>(answer.frame_period_ns) / 1e3;
    CHECK(told["readout"]["frame_period_us"] == period_us);
    CHECK(told["readout"]["max_rate_hz"] == 1e6 / period_us);
    CHECK(told["readout"]["windows"].size() == answer.window_count);
}

TEST_CASE("the image keeps its size during acquisition") {
    CallsBench bench;
    REQUIRE(bench.ask("camera.start")["started"] == true);
    CHECK(bench.ask("camera.start")["started"] == false);
    const Failure locked = bench.refusal("camera.set", {{"values", {{"Width", 20}}}});
    CHECK(locked.code == FailureCode::not_now);
    CHECK(locked.field == "Width");
    CHECK(bench.ask("camera.set", {{"values", {{"Width", 40}}}})["changed"].empty()); // as it is
    REQUIRE(bench.ask("camera.stop")["stopped"] == true);
    CHECK(bench.ask("camera.set", {{"values", {{"Width", 20}}}})["changed"] == json{{"Width", 20}});
}

TEST_CASE("a trigger tells what became of it") {
    CallsBench bench;
    CHECK(bench.refusal("camera.trigger").hint == "camera.start");
    REQUIRE(bench.camera.acquisition_start());
    const json frame = bench.ask("camera.trigger");
    CHECK(frame["accepted"] == true);
    CHECK(frame["frame"] == 1);
    CHECK(frame["outcome"] == (bench.camera.counters().late > 0 ? "late" : "complete"));
    CHECK(bench.camera.counters().complete == 1);

    bench.wait_ready();
    render_gate().close(); // the next frame does not come to its end
    REQUIRE(bench.ask("camera.trigger", {{"wait", false}})["accepted"] == true);
    const json missed = bench.ask("camera.trigger");
    CHECK(missed["accepted"] == false);
    CHECK(missed["outcome"] == "missed");
    CHECK_FALSE(missed.contains("frame"));
    render_gate().open();
    bench.wait_ended(2);

    bench.wait_ready();
    CHECK(bench.ask("camera.trigger")["frame"] == 3);
    bench.ask("camera.set", {{"values", {{"TriggerSource", "Line0"}}}});
    CHECK_THAT(bench.refusal("camera.trigger").what(), ContainsSubstring("TriggerSource Line0"));
}

TEST_CASE("triggers of two clients, 1 ms apart, have their own outcomes") {
    // The second edge is latched, and its frame begins when the first one's exposure has ended.
    const std::int64_t exposure_ns = ns_per_s; // the second one is on time on a busy machine, too
    CallsBench bench(exposure_ns, sync::OverTrigger::latch);
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    json first, second;
    const Time begin = bench.clock.now();
    std::thread one([&] { first = bench.trigger_as_another_client(); });
    render_gate().wait_for_render();
    std::thread other([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        second = bench.trigger_as_another_client();
    });
    // Past the first frame's last row, and long before the second one's first.
    std::this_thread::sleep_for(
        std::chrono::nanoseconds(begin.ns + exposure_ns + 20 * ns_per_ms - bench.clock.now().ns));
    render_gate().open();
    one.join();
    other.join();
    CHECK(first["accepted"] == true);
    CHECK(first["outcome"] == "late");
    CHECK(first["frame"] == 1);
    CHECK(first["late_rows"] == bench.sensor.readout.height);
    CHECK(second["accepted"] == true);
    CHECK(second["outcome"] == "complete");
    CHECK(second["frame"] == 2);
    CHECK(second["late_rows"] == 0);
    CHECK(bench.camera.counters().latched_triggers == 1);
}

TEST_CASE("a trigger that the busy chip refuses does not end the wait for the one before") {
    CallsBench bench(2 * ns_per_s); // asked within that time
    REQUIRE(bench.camera.acquisition_start());
    json first;
    std::thread one([&] { first = bench.trigger_as_another_client(); });
    while (bench.camera.counters().frames == 0)
        std::this_thread::yield();
    bench.wait_ready(); // rendered: only the chip is busy
    const json refused = bench.ask("camera.trigger");
    one.join();
    CHECK(refused["accepted"] == false);
    CHECK(refused["outcome"] == "missed");
    CHECK(bench.camera.counters().missed_because[static_cast<std::size_t>(MissedReason::chip_busy)] == 1);
    CHECK(first["outcome"] == "complete");
    CHECK(first["frame"] == 1);
    CHECK(first["late_rows"] == 0);
}

TEST_CASE("edges that a divider skips are told as missed at once") {
    CallsBench bench;
    bench.ask("camera.set", {{"values", {{"TriggerDivider", 2}}}});
    REQUIRE(bench.camera.acquisition_start());
    CHECK(bench.ask("camera.trigger")["frame"] == 1);
    bench.wait_ready();
    const json skipped = bench.ask("camera.trigger");
    CHECK(skipped["accepted"] == true);
    CHECK(skipped["outcome"] == "missed");
    CHECK(bench.camera.counters().frames == 1);
}

TEST_CASE("edges of another source do not end the wait for a triggered frame") {
    CallsBench bench;
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    std::thread line([&] {
        render_gate().wait_for_render();
        const Time now = bench.clock.now();
        bench.camera.on_trigger({1, now, now}); // Line0, while Software is selected
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        render_gate().open();
    });
    const json frame = bench.ask("camera.trigger");
    line.join();
    CHECK(bench.camera.counters().ignored == 1);
    CHECK(frame["outcome"] != "missed");
    CHECK(frame["frame"] == 1);
}

TEST_CASE("a cancelled trigger no longer waits for its frame") {
    CallsBench bench;
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    bench.work.stop = true;
    CHECK(bench.refusal("camera.trigger").code == FailureCode::cancelled);
    render_gate().open();
    bench.wait_ended(1);
}

TEST_CASE("while another client controls the camera it can only be looked at") {
    CallsBench bench;
    bench.controller = "192.168.1.7:4000";
    for (const char* call : {"camera.start", "camera.stop", "camera.trigger"}) {
        const Failure failure = bench.refusal(call);
        CHECK(failure.code == FailureCode::controlled);
        CHECK(std::string(failure.what()) == "controlled by 192.168.1.7:4000");
    }
    CHECK(bench.refusal("camera.set", {{"values", {{"Gain", 1}}}}).code == FailureCode::controlled);
    CHECK(bench.camera.settings().gain_db == 0);
    CHECK(bench.ask("camera.get", {{"names", {"Gain"}}})["values"] == json{{"Gain", 0.0}});
    CHECK(bench.ask("camera.features")["features"][0]["value"] == 40);

    const json forced{{"values", {{"Gain", 1}}}, {"force", true}};
    const Failure forbidden = bench.refusal("camera.set", forced);
    CHECK(forbidden.code == FailureCode::forbidden);
    CHECK(forbidden.field == "force");
    CHECK(bench.camera.settings().gain_db == 0);
    bench.work.allowed = service::Permission::admin;
    CHECK(bench.refusal("camera.set", {{"values", {{"Gain", 1}}}}).code == FailureCode::controlled);
    CHECK(bench.ask("camera.set", forced)["changed"] == json{{"Gain", 1.0}});
}

} // namespace camera_calls_test
