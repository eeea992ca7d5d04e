// SPDX-License-Identifier: Apache-2.0
// Requests to a daemon through its call server ([control]).
#pragma once

#include "instrument/link/camera_link.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::instrument {

/// Where the calls of a daemon are made.
struct DaemonAddress {
    std::string address;    ///< path of a Unix socket, or "HOST:PORT"; empty: see `find`
    std::string token_file; ///< of the token that the daemon wants; empty: none
    /// Finds the address, for each connection anew, since another daemon may have another one. Throws
    /// LinkError. Thread-safe.
    std::function<std::string()> find{};
};

/// What the call `timing` answers.
struct TimingAnswer {
    std::vector<std::string> columns;
    std::vector<std::vector<std::optional<std::int64_t>>> rows; ///< of consecutive frames, oldest first
    std::uint64_t last = 0;                                     ///< number of the newest frame
    std::optional<std::int64_t> tai_offset_ns;                  ///< from the columns' clock to TAI
};

/// Connects when it is first used, and again after a connection was lost; a request other than a trigger is
/// then made once more. Triggers have a connection of their own, so that others are answered meanwhile.
class DaemonLink final : public CameraLink {
public:
    explicit DaemonLink(DaemonAddress address);
    ~DaemonLink() override;

    [[nodiscard]] DaemonState state() override;
    [[nodiscard]] std::vector<Feature> features(std::uint32_t camera) override;
    void set(std::uint32_t camera, const std::string& feature, const FeatureValue& value) override;
    void start(std::uint32_t camera) override;
    void stop(std::uint32_t camera) override;
    void begin_trigger(std::uint32_t camera) override;
    [[nodiscard]] bool trigger_pending() const override { return pending_; }
    [[nodiscard]] std::optional<TriggerResult> trigger_result(double wait_s) override;
    /// Time stamps of the frames after the one with the number `after`, the newest 256 of them, as soon as
    /// they have ended, with the number of their saturated pixels. Never made once more: frames are counted
    /// since the daemon's start, and it may be another daemon.
    [[nodiscard]] TimingAnswer timing(std::uint32_t camera, std::uint64_t after);

private:
    class Connection;

    const DaemonAddress address_;
    std::unique_ptr<Connection> calls_, triggers_;
    bool pending_ = false;
};

} // namespace obscura::instrument
