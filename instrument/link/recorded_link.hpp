// SPDX-License-Identifier: Apache-2.0
// Record of the changes that clients of the instrument make to cameras.
#pragma once

#include "instrument/link/camera_link.hpp"

#include <string>
#include <utility>

namespace obscura::instrument {

/// Passes requests on, and writes a line to the log for each change that has been made: who, from where,
/// which camera, what, from which value to which. A trigger is one once its outcome is known.
class RecordedLink final : public CameraLink {
public:
    /// `link` outlives this. `who`: how the client speaks, "SCPI".
    RecordedLink(CameraLink& link, std::string who) : link_(link), who_(std::move(who)) {}

    /// "ADDRESS:PORT" of the client of the requests that follow.
    void set_peer(std::string peer) { peer_ = std::move(peer); }

    [[nodiscard]] DaemonState state() override { return link_.state(); }
    [[nodiscard]] std::vector<Feature> features(std::uint32_t camera) override {
        return link_.features(camera);
    }
    void set(std::uint32_t camera, const std::string& feature, const FeatureValue& value) override;
    void start(std::uint32_t camera) override;
    void stop(std::uint32_t camera) override;
    void begin_trigger(std::uint32_t camera) override;
    [[nodiscard]] bool trigger_pending() const override { return link_.trigger_pending(); }
    [[nodiscard]] std::optional<TriggerResult> trigger_result(double wait_s) override;

private:
    void note(std::uint32_t camera, const char* what) const;

    CameraLink& link_;
    const std::string who_;
    std::string peer_;
    std::uint32_t triggered_ = 0; ///< camera of the pending trigger
};

} // namespace obscura::instrument
