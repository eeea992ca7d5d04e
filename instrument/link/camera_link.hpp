// SPDX-License-Identifier: Apache-2.0
// Interface to the cameras of a daemon, as instruments ask for them.
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace obscura::instrument {

/// Value of a setting, in the unit of its feature.
using FeatureValue = std::variant<bool, std::int64_t, double, std::string>;

/// A setting of a camera, as the call camera.features lists it.
struct Feature {
    std::string name;    ///< SFNC name
    std::string unit;    ///< "us", "dB"; empty: none
    std::string allowed; ///< "1 to 1e7 us", "Off | Once | Continuous"; empty: not known
    std::string help;
    FeatureValue value;
};

/// Quantiles of a latency in microseconds, as `state` tells.
struct Latency {
    std::string name; ///< "trigger_to_first_row"
    double count = 0, p50 = 0, p99 = 0, max = 0;
};

/// What `state` tells of a camera.
struct CameraState {
    bool acquiring = false, trigger_ready = false;
    std::string controller; ///< address of the GigE Vision client that has control; empty: none
    std::string health;     ///< "good", "idle", "bad"
    std::string verdict;    ///< one line
    std::string clock;      ///< "free", "locked", "holdover", "lockstep"
    std::uint64_t frame_id = 0;
    std::vector<std::pair<std::string, std::int64_t>> counters; ///< since the start
    std::vector<Latency> latencies;
};

/// What `state` tells.
struct DaemonState {
    std::string version;
    std::string run; ///< number and start of its process: another one after a restart
    std::vector<CameraState> cameras;
};

/// What became of a trigger.
struct TriggerResult {
    std::string outcome; ///< "complete", "late", "repeated", "partial", "dropped", "abandoned", "missed"
    std::uint64_t frame = 0, late_rows = 0;
    std::int64_t edge_tai_ns = 0;
    double seconds = 0; ///< from the trigger until the last row had left
};

/// A request that was refused, or did not reach the daemon. what() is one line.
class LinkError : public std::runtime_error {
public:
    LinkError(std::string the_code, std::string the_field, const std::string& message)
        : std::runtime_error(message), code(std::move(the_code)), field(std::move(the_field)) {}

    std::string code;  ///< of the call server: "bad-argument", "controlled", "connection-lost", ...
    std::string field; ///< of the request that is wrong; empty: not known
};

/// Requests to one daemon. All members throw LinkError. Thread-bound; cameras count from 0.
class CameraLink {
public:
    CameraLink() = default;
    CameraLink(const CameraLink&) = delete;
    CameraLink& operator=(const CameraLink&) = delete;
    virtual ~CameraLink() = default;

    [[nodiscard]] virtual DaemonState state() = 0;
    [[nodiscard]] virtual std::vector<Feature> features(std::uint32_t camera) = 0;
    virtual void set(std::uint32_t camera, const std::string& feature, const FeatureValue& value) = 0;
    virtual void start(std::uint32_t camera) = 0;
    virtual void stop(std::uint32_t camera) = 0;

    /// Triggers a frame; its outcome is asked for with trigger_result(). Not while another one is pending.
    virtual void begin_trigger(std::uint32_t camera) = 0;
    [[nodiscard]] virtual bool trigger_pending() const = 0;
    /// Outcome of the pending trigger, waiting at most so long; nullopt: not yet. After an outcome or an
    /// error it is not pending any more.
    [[nodiscard]] virtual std::optional<TriggerResult> trigger_result(double wait_s) = 0;
};

} // namespace obscura::instrument
