// SPDX-License-Identifier: Apache-2.0
// Rules of injected faults of a transport, to be listed and replaced while it runs.
#pragma once

#include "config/section.hpp"

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace obscura::transports {

/// Fault injection of a transport, by the keys that a rule has in the configuration.
class FaultRules {
public:
    /// A value of the key `kind` of rules.
    struct Kind {
        std::string_view name, help;
    };
    /// A rule of its own.
    struct Row {
        std::shared_ptr<void> rule; ///< what `section` is bound to
        config::Section section;
        std::string_view origin{}; ///< who armed it: "configuration", "call", "feature"
        std::uint64_t struck = 0;  ///< packets, frames or commands since it was armed
    };

    virtual ~FaultRules() = default;
    [[nodiscard]] virtual std::vector<Kind> kinds() const = 0;
    /// A rule with the defaults of its keys, to be read into and then armed.
    [[nodiscard]] virtual Row blank() const = 0;
    /// The rules in force. Thread-safe.
    [[nodiscard]] virtual std::vector<Row> armed() const = 0;
    /// Number of the newest frame, as `first` and `last` of a rule count them; 0: there was none.
    /// Thread-safe.
    [[nodiscard]] virtual std::uint64_t newest_frame() const noexcept = 0;
    /// Replaces all rules by `rows`, which blank() made; those in force already keep their strikes. Holds
    /// from the next frame on. Within Transport::run_between_commands().
    virtual void arm(const std::vector<Row>& rows) = 0;
};

} // namespace obscura::transports
