// SPDX-License-Identifier: Apache-2.0
// Settings of one kind of transport: section of the configuration, checks, identities and maker.
#pragma once

#include "config/section.hpp"
#include "core/camera/camera.hpp"
#include "core/clock.hpp"
#include "core/ptp_status.hpp"
#include "core/realtime/realtime.hpp"
#include "transports/control_listener.hpp"
#include "transports/transport.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports {

/// Properties of the sensor that transport settings are checked against.
struct SensorFacts {
    std::int32_t width = 0, height = 0; ///< px
    int adc_bits = 12;
};

/// Camera that transport settings are checked against.
struct CameraFacts {
    SensorFacts sensor{};
    CameraLimits limits{};
    CameraSettings reset{}; ///< settings after reset
};

/// Resources for making transports, besides their own settings. `control` and `clock` outlive the transports.
struct TransportContext {
    CameraControl& control;
    const Clock& clock;
    SensorFacts sensor{};
    /// Threads of network senders; control threads run one priority above.
    ThreadSettings transmit{};
    ThreadSettings display{};    ///< threads that feed video nodes and displays
    std::uint64_t seed = 1;      ///< for settings whose own seed is 0
    double trigger_rate_hz = 0;  ///< nominal rate of the external trigger
    std::string configuration{}; ///< file that the settings were read from, for messages
    /// Reads the state of the PTP clock; empty: no PTP. Called on threads of the transport.
    std::function<PtpStatus()> ptp_status{};
    /// Acquires while no client controls the camera, which then returns to its settings after the start.
    /// Null: settings stay as the last client left them.
    ControlListener* control_listener = nullptr;
};

/// A value that two cameras of one daemon must not share.
struct Identity {
    std::string_view key;  ///< key of the section at which a conflict is reported
    std::string value;     ///< two cameras with the same value conflict
    std::string shown;     ///< the value as shown in the message
    std::string_view what; ///< name of the value in the message, "serial number"
};

/// Settings of one kind of transport. Reentrant.
class TransportSettings {
public:
    virtual ~TransportSettings() = default;
    [[nodiscard]] virtual std::unique_ptr<TransportSettings> clone() const = 0;
    /// Name of the kind and of its section.
    [[nodiscard]] virtual std::string_view kind() const = 0;
    /// The section, bound to these settings, which outlive it. Its check opens nothing but files.
    [[nodiscard]] virtual config::Section section() = 0;
    /// Checks the settings against the camera, after both were read without a mistake.
    virtual void check_with(const CameraFacts& camera, const config::ReadTable& table) const = 0;
    [[nodiscard]] virtual bool enabled() const = 0;
    /// Frames of the pool that the transport may hold at once.
    [[nodiscard]] virtual std::size_t frames_held() const = 0;
    [[nodiscard]] virtual std::vector<Identity> identities() const = 0;
    /// Ground truth that frames must carry.
    [[nodiscard]] virtual KeptTruth wanted_truth() const = 0;
    /// True if a client of the transport starts and stops the acquisition.
    [[nodiscard]] virtual bool controls_acquisition() const = 0;
    /// Makes the transport, not started. Throws HardwareError or OutputError with a one-line message.
    [[nodiscard]] virtual std::unique_ptr<Transport> make(const TransportContext& context) const = 0;
};

/// TransportSettings of a plain struct with `static constexpr std::string_view kind` and `bool enabled`. It
/// calls functions declared beside the struct:
///     config::Section section_of(X& settings);
///     std::size_t frames_held_by(const X& settings);
///     std::unique_ptr<Transport> make_transport(const X& settings, const TransportContext& context);
/// and these if they exist:
///     void check_against(const X& settings, const CameraFacts& camera, const config::ReadTable& table);
///     std::vector<Identity> identities_of(const X& settings);
///     KeptTruth truth_wanted_by(const X& settings);
///     bool acquisition_controlled_by(const X& settings);
template<typename Settings>
class TransportSettingsOf final : public TransportSettings {
public:
    Settings settings{};

    [[nodiscard]] std::unique_ptr<TransportSettings> clone() const override {
        return std::make_unique<TransportSettingsOf>(*this);
    }
    [[nodiscard]] std::string_view kind() const override { return Settings::kind; }
    [[nodiscard]] config::Section section() override { return section_of(settings); }
    void check_with(const CameraFacts& camera, const config::ReadTable& table) const override {
        if constexpr (requires { check_against(settings, camera, table); })
            check_against(settings, camera, table);
    }
    [[nodiscard]] bool enabled() const override { return settings.enabled; }
    [[nodiscard]] std::size_t frames_held() const override { return frames_held_by(settings); }
    [[nodiscard]] std::vector<Identity> identities() const override {
        if constexpr (requires { identities_of(settings); })
            return identities_of(settings);
        else
            return {};
    }
    [[nodiscard]] KeptTruth wanted_truth() const override {
        if constexpr (requires { truth_wanted_by(settings); })
            return truth_wanted_by(settings);
        else
            return {};
    }
    [[nodiscard]] bool controls_acquisition() const override {
        if constexpr (requires { acquisition_controlled_by(settings); })
            return acquisition_controlled_by(settings);
        else
            return false;
    }
    [[nodiscard]] std::unique_ptr<Transport> make(const TransportContext& context) const override {
        return make_transport(settings, context);
    }
};

} // namespace obscura::transports
