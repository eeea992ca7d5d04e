// SPDX-License-Identifier: Apache-2.0
// Degraded frames of a run: how far below full quality they were rendered, and why.
#pragma once

#include "tools/timing/timing_file.hpp"

#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// Why a frame was not rendered in full, as the camera stated it, with figures where the file has them; empty
/// for full frames.
[[nodiscard]] std::string degraded_because(const TimingRow& row);

/// One line about the quality of all frames; empty if none was degraded.
[[nodiscard]] std::string quality_remark(std::span<const TimingRow> rows);

/// Degraded frames of one acquisition by their reasons; with `each`, a line for each frame as well. Empty if
/// there is none.
[[nodiscard]] std::string degraded_text(std::span<const TimingRow> rows, bool each);

/// A CSV table with a line for each degraded frame.
[[nodiscard]] std::string degraded_csv(std::span<const TimingRow> rows);

} // namespace obscura::tools
