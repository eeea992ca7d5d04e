// SPDX-License-Identifier: Apache-2.0
// Progress of the daemon's start: step, share that is done, time left.
#pragma once

#include "core/time.hpp"

#include <mutex>
#include <optional>
#include <string>

namespace obscura::emulator {

/// Written by the main thread while scenes and tiles are loaded, read by all others. Thread-safe.
class StartProgress {
public:
    /// A step has begun, or has come so far: the same name goes on. `share` that is done, 0 to 1; none: not
    /// known. `now`: of the scheduling clock.
    void note(const std::string& step, std::optional<double> share, Time now);

    struct Report {
        std::string step;
        std::optional<double> share;
        std::optional<double> left_s; ///< as the step has gone on so far; none: not known yet
        /// "tiles 40 %, 4 min left"
        [[nodiscard]] std::string words() const;
        /// The same for clients: "starting: tiles 40 %, 4 min left"
        [[nodiscard]] std::string text() const { return "starting: " + words(); }
    };
    [[nodiscard]] Report report() const;

private:
    mutable std::mutex mutex_;
    Report report_{"configuration", {}, {}};
    Time begun_;              ///< of the step
    double first_share_ = -1; ///< stated first in it; negative: none was
};

} // namespace obscura::emulator
