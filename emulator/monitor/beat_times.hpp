// SPDX-License-Identifier: Apache-2.0
// Ages of heartbeats, from polls of their counts several times a second.
#pragma once

#include "core/realtime/heartbeat.hpp"
#include "core/time.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Thread-bound.
class BeatTimes {
public:
    /// Looks at the heartbeats that there are; those that are not among them any more are forgotten.
    void note(Time now, const Heartbeats& heartbeats);

    struct Age {
        std::string name;
        double age_s = 0;    ///< since the look that saw the last beat; of a new one since the first look
        bool silent = false; ///< it has announced a blocking call, or rests
    };
    /// In the order of the heartbeats of the last look.
    [[nodiscard]] std::vector<Age> ages(Time now) const;

private:
    struct Seen {
        std::uint64_t beats = 0;
        Time last;
    };
    Heartbeats order_;
    std::map<const Heartbeat*, Seen> seen_;
};

} // namespace obscura::emulator
