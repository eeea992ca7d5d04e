// SPDX-License-Identifier: Apache-2.0
// Registry of transport kinds, and the transports of one camera as they are configured.
#pragma once

#include "transports/transport_settings.hpp"

#include <memory>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace obscura::transports {

/// Settings of every kind of transport for one camera. A value: copies are independent.
class ConfiguredTransports {
public:
    /// Defaults of every kind.
    ConfiguredTransports();
    ConfiguredTransports(const ConfiguredTransports& other);
    ConfiguredTransports& operator=(const ConfiguredTransports& other);
    ConfiguredTransports(ConfiguredTransports&&) noexcept = default;
    ConfiguredTransports& operator=(ConfiguredTransports&&) noexcept = default;
    ~ConfiguredTransports() = default;

    /// In the order in which sections are printed.
    [[nodiscard]] std::vector<TransportSettings*> all();
    [[nodiscard]] std::vector<const TransportSettings*> all() const;

    /// The settings of one kind by their type, `get<gige::GigeSettings>()`.
    template<typename Settings>
    [[nodiscard]] Settings& get() {
        for (TransportSettings* one : all())
            if (auto* found = dynamic_cast<TransportSettingsOf<Settings>*>(one)) return found->settings;
        throw std::logic_error("no such kind of transport");
    }
    template<typename Settings>
    [[nodiscard]] const Settings& get() const {
        for (const TransportSettings* one : all())
            if (const auto* found = dynamic_cast<const TransportSettingsOf<Settings>*>(one))
                return found->settings;
        throw std::logic_error("no such kind of transport");
    }

    /// In the order in which they are printed; bound to this object.
    [[nodiscard]] std::vector<config::Section> sections();

    /// Checks the settings against the camera. `root` holds the tables that the settings were read from,
    /// `where` is its position.
    void check_with(const CameraFacts& camera, const config::Value& root, const config::Where& where,
                    config::Mistakes& mistakes) const;
    /// Reports identities that enabled transports here share with enabled transports of an `earlier` camera.
    /// `root` and `where` belong to these settings, `earlier_name` is "camera[0]".
    void check_apart(const ConfiguredTransports& earlier, std::string_view earlier_name,
                     const config::Value& root, const config::Where& where, config::Mistakes& mistakes) const;

    /// Sums and unions over the enabled transports.
    [[nodiscard]] std::size_t frames_held() const;
    [[nodiscard]] KeptTruth kept_truth() const;
    [[nodiscard]] bool controls_acquisition() const;

    /// Makes the enabled transports, in the order in which they start and receive frames. Throws
    /// HardwareError or OutputError with a one-line message.
    [[nodiscard]] std::vector<std::unique_ptr<Transport>> make(const TransportContext& context) const;

private:
    std::vector<std::unique_ptr<TransportSettings>> settings_; // as the registry's rows
};

} // namespace obscura::transports
