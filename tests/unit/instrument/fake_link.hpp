// SPDX-License-Identifier: Apache-2.0
// Two cameras that only exist in memory, for tests of instruments.
#pragma once

#include "instrument/link/camera_link.hpp"

#include <string>
#include <utility>
#include <vector>

namespace obscura::test {

/// Notes what was asked of it; `refusal` is thrown by the next request that changes something.
class FakeLink final : public instrument::CameraLink {
public:
    std::vector<std::string> done;
    std::optional<instrument::LinkError> refusal;
    instrument::TriggerResult result{"complete", 7, 0, 1'000'000'000, 0.25};
    int looks_until_result = 0; ///< trigger_result() without one
    std::string health = "good";

    [[nodiscard]] instrument::DaemonState state() override {
        instrument::CameraState camera;
        camera.acquiring = camera.trigger_ready = true;
        camera.health = health;
        camera.verdict = "on time: 0 late rows in 600 frames, last 60 s";
        camera.clock = "free";
        camera.frame_id = 12;
        camera.counters = {{"frames", 12}, {"late", 1}};
        camera.latencies = {{"release_lateness", 12, 0.25, 3.5, 41}};
        return {"1.2", "1-1", {camera, camera}};
    }
    [[nodiscard]] std::vector<instrument::Feature> features(std::uint32_t camera) override {
        if (camera > 1) throw instrument::LinkError("bad-argument", "camera", "there is no such camera");
        return features_;
    }
    void set(std::uint32_t camera, const std::string& name, const instrument::FeatureValue& value) override {
        change(std::to_string(camera) + " set " + name);
        for (instrument::Feature& feature : features_)
            if (feature.name == name) feature.value = value;
    }
    void start(std::uint32_t camera) override { change(std::to_string(camera) + " start"); }
    void stop(std::uint32_t camera) override { change(std::to_string(camera) + " stop"); }
    void begin_trigger(std::uint32_t camera) override {
        change(std::to_string(camera) + " trigger");
        pending_ = true;
    }
    [[nodiscard]] bool trigger_pending() const override { return pending_; }
    [[nodiscard]] std::optional<instrument::TriggerResult> trigger_result(double /*wait_s*/) override {
        if (looks_until_result-- > 0) return std::nullopt;
        pending_ = false;
        return result;
    }

private:
    void change(const std::string& what) {
        if (refusal) throw *std::exchange(refusal, std::nullopt);
        done.push_back(what);
    }
    std::vector<instrument::Feature> features_{
        {"ExposureTime", "us", "1 to 1e7 us", "", 2500.0},
        {"Gain", "dB", "0 to 24 dB", "", 0.0},
        {"Width", "px", "16 to 64 px", "", std::int64_t{64}},
        {"AcquisitionFrameRateEnable", "", "", "", false},
        {"TriggerSource", "", "Line0 | Software", "", std::string("Line0")},
    };
    bool pending_ = false;
};

} // namespace obscura::test
