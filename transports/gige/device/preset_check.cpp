// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/device/preset_check.hpp"

#include "core/clock.hpp"
#include "transports/gige/channels/message_channel.hpp"
#include "transports/gige/channels/network_interface.hpp"
#include "transports/gige/device/device.hpp"
#include "transports/gige/genicam/user_xml.hpp"

namespace obscura::transports::gige {
namespace {

/// Camera that has settings and limits, but never acquires.
class IdleCamera final : public CameraControl {
public:
    explicit IdleCamera(const CameraFacts& camera) : limits_(camera.limits), settings_(camera.reset) {}

    [[nodiscard]] CameraLimits limits() const override { return limits_; }
    [[nodiscard]] CameraSettings settings() const override { return settings_; }
    bool apply(const CameraSettings& settings) override {
        if (!explain(settings).empty()) return false;
        settings_ = settings;
        return true;
    }
    bool acquisition_start() override { return false; }
    void acquisition_stop(bool /*abort*/) override {}
    [[nodiscard]] bool acquiring() const override { return false; }
    bool software_trigger(Time /*edge*/) override { return false; }

private:
    const CameraLimits limits_;
    CameraSettings settings_;
};

/// Stream channel that sends nothing.
class NoStream final : public StreamPort {
public:
    bool begin(const StreamConfig& /*config*/) override { return false; }
    void abort() noexcept override {}
    [[nodiscard]] bool idle() const noexcept override { return true; }
    bool wait_idle(std::int64_t /*span_ns*/) noexcept override { return true; }
    void resend(const ResendRequest& /*request*/) noexcept override {}
    bool send_test_packet(const StreamConfig& /*config*/) noexcept override { return false; }
    [[nodiscard]] std::uint16_t source_port() const noexcept override { return 0; }
};

} // namespace

std::string explain_refused_values(const GigeSettings& settings, const CameraFacts& camera) {
    GigeSettings offline = settings;
    offline.state_file.clear();
    IdleCamera control(camera);
    NoStream stream;
    MessageChannel messages{NetworkInterface{}};
    const MonotonicClock clock;
    try {
        const Device device(offline, NetworkInterface{}, control, stream, messages, clock);
    } catch (const RefusedPreset& refused) {
        return refused.why;
    }
    return {};
}

} // namespace obscura::transports::gige
