// SPDX-License-Identifier: Apache-2.0
// Frame reports of the rows of the call `timing`: each frame once, and how many have none.
#pragma once

#include "instrument/link/daemon_link.hpp"
#include "instrument/packets/telemetry.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace obscura::instrument {

/// Position of one camera in the daemon's count of frames. Thread-bound.
class FrameReports {
public:
    /// Any number of frames that a daemon does not reach: an answer to it has no rows.
    static constexpr std::uint64_t none = 8'000'000'000'000'000;

    /// Number of the last frame that is known, for the next request; before the first answer `none`, so that
    /// frames of the past are left out.
    [[nodiscard]] std::uint64_t after() const noexcept { return after_.value_or(none); }
    /// Another daemon counts from 1: all of its frames are wanted.
    void begin_anew() noexcept { after_ = 0; }
    /// The reports of an answer to after(), oldest first. `tai_offset_ns`: added to its instants.
    [[nodiscard]] std::vector<FrameReport> take(std::uint32_t camera, const TimingAnswer& answer,
                                                std::int64_t tai_offset_ns);

private:
    std::optional<std::uint64_t> after_;
};

} // namespace obscura::instrument
