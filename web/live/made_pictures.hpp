// SPDX-License-Identifier: Apache-2.0
// Pictures of one frame, each made once for all viewers of the same view.
#pragma once

#include "transports/watch/frame_ring_reader.hpp"
#include "web/live/view.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace obscura::web {

/// Digital numbers of a view, or the JPEG of it.
struct MadePicture {
    View view;
    std::shared_ptr<const std::vector<std::uint16_t>> pixels;
    std::shared_ptr<const std::vector<unsigned char>> jpeg{}; ///< null: not wanted, or it cannot be made
};

/// Thread-bound.
class MadePictures {
public:
    /// Of `view`, which is within the frame; those of other frames are forgotten. Any pixels give a result,
    /// also while they change.
    [[nodiscard]] MadePicture picture(const transports::RingFrame& frame, const View& view, bool jpeg);
    /// Forgets what was made of pixels that have changed meanwhile.
    void clear();

private:
    std::uint64_t serial_ = 0; ///< of the frame
    std::vector<MadePicture> made_;
    std::vector<std::uint8_t> levels_;  ///< of JPEGs; empty: not yet wanted
    std::vector<std::uint64_t> counts_; ///< memory to work with
};

} // namespace obscura::web
