// SPDX-License-Identifier: Apache-2.0
// Quality levels of the frames of an earlier run, to make them again.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/frame_quality.hpp"

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace obscura::tools {

/// Levels from the timing file of a run, of its last acquisition. Rows that were made of an earlier frame are
/// made of the last one before that had none of them (emulator/render/kept_frames.hpp).
class QualityReplay {
public:
    /// `file` empty: all frames are full. `readout`: of the frames that are made. Throws InputError `file:
    /// what, what is allowed`.
    QualityReplay(const std::string& file, const ReadoutAnswer& readout);
    /// By group of rows; empty: full, as are frames that the file does not have.
    [[nodiscard]] std::span<const QualityLevel> of(std::uint64_t frame_id) const;

    /// Whether rows of some frame were made of an earlier one.
    [[nodiscard]] bool needs_earlier() const { return needs_earlier_; }

private:
    std::map<std::uint64_t, std::vector<QualityLevel>> levels_;
    bool needs_earlier_ = false;
};

} // namespace obscura::tools
