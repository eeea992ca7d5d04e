// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/fault_injector.hpp"

#include "core/philox.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::transports::gige {

const FaultRule* FaultInjector::strikes(Fault fault, std::uint64_t frame,
                                        std::uint32_t packet) const noexcept {
    for (const FaultRule& rule : rules_) {
        if (rule.fault != fault || frame < rule.first_frame) continue;
        if (rule.last_frame != 0 && frame > rule.last_frame) continue;
        if (rule.every_frames > 1 && (frame - rule.first_frame) % rule.every_frames != 0) continue;
        // All packets of a burst share one random number.
        const std::uint32_t draw = packet / std::max(rule.burst, 1U);
        const auto words =
            philox4x32({static_cast<std::uint32_t>(frame), static_cast<std::uint32_t>(frame >> 32), draw,
                        0x46415500U + static_cast<std::uint32_t>(fault)},
                       philox_key(rule.seed));
        if (static_cast<double>(words[0]) < rule.percent / 100 * 0x1p32) return &rule;
    }
    return nullptr;
}

} // namespace obscura::transports::gige
