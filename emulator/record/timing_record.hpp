// SPDX-License-Identifier: Apache-2.0
// The numbers of a frame for the timing file.
#pragma once

#include "core/camera/frame_record.hpp"
#include "emulator/record/timing_log.hpp"

namespace obscura::emulator {

/// What the columns of the timing file (timing_columns()) show of a frame.
[[nodiscard]] FrameRecord record_of(const FrameTiming& frame, const RenderFacts& render);

} // namespace obscura::emulator
