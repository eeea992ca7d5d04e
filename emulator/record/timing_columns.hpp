// SPDX-License-Identifier: Apache-2.0
// Columns of the timing file that hold one whole number of a frame.
#pragma once

#include "emulator/record/timing_log.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace obscura::emulator {

/// Times are in ns of the scheduling clock; other units stand in the name.
struct TimingColumn {
    std::string_view name;
    std::int64_t (*value)(const FrameTiming& frame, const RenderFacts& render);
    bool is_instant = false; ///< 0: the frame does not have it
};

/// In the order of the file. Static storage.
[[nodiscard]] std::span<const TimingColumn> timing_columns();

} // namespace obscura::emulator
