// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_outcome.hpp"

namespace obscura::emulator {

std::uint64_t ended_edges(const CameraCounters& c) noexcept {
    return c.complete + c.abandoned + c.dropped + c.missed_triggers + c.masked_triggers + c.ignored;
}

const char* outcome_of(const CameraCounters& before, const CameraCounters& after) noexcept {
    if (after.complete > before.complete)
        return after.repeated > before.repeated ? "repeated" : after.late > before.late ? "late" : "complete";
    if (after.abandoned > before.abandoned)
        return after.partial > before.partial             ? "partial"
               : after.late_dropped > before.late_dropped ? "dropped"
                                                          : "abandoned";
    return after.dropped > before.dropped ? "dropped" : "missed";
}

} // namespace obscura::emulator
