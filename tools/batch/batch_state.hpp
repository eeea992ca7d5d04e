// SPDX-License-Identifier: Apache-2.0
// State of a batch from its records: frames done, shards, speed and time left.
#pragma once

#include "tools/batch/plan.hpp"
#include "tools/batch/records.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {

/// A frame that has a record but is not done, or whose records differ.
struct BadFrame {
    std::uint64_t frame = 0;
    std::string file, why;
};

/// State of all shards.
struct BatchState {
    std::uint64_t frames = 0, done = 0, bytes = 0;
    std::uint64_t shards = 0, shards_done = 0, shards_begun = 0; ///< begun: some frames done, not all
    std::vector<std::uint64_t> unfinished;                       ///< shards
    std::vector<BadFrame> bad;
    std::uint64_t hosts = 0;  ///< that made the frames
    double seconds = 0;       ///< sum over the frames done
    std::uint64_t recent = 0; ///< frames finished in the last `recent_s`
    double recent_s = 0;      ///< at most 900; less where the batch began later
    /// Work that is left, at the mean time of a frame; none before the first frame.
    [[nodiscard]] std::optional<double> work_left_s() const;
    /// Time that is left at the rate of late; none if nothing was finished of late.
    [[nodiscard]] std::optional<double> left_s() const;
};

/// Looks at every frame, on `threads` threads (0: one per core). Throws InputError.
[[nodiscard]] BatchState batch_state(const Plan& plan, const std::filesystem::path& batch, FrameCheck check,
                                     std::int64_t now_s, std::uint32_t threads = 1);

} // namespace obscura::tools
