// SPDX-License-Identifier: Apache-2.0
// Interface of edge inputs, whose edges have their own time stamps: GPIO line, PPS or PTP device, socket.
#pragma once

#include "core/time.hpp"

#include <cstdint>
#include <span>

namespace obscura::sync {

struct Edge {
    Time at; ///< scheduling clock
    /// Number of the edge, if the input counts edges; a gap means lost edges. 0: the input does not count.
    std::uint64_t sequence = 0;
    bool falling = false; ///< only from inputs that distinguish edges
};

/// Opened on construction, closed on destruction.
class EdgeInput {
public:
    virtual ~EdgeInput() = default;
    static constexpr int gone = -1;

    /// Blocks until edges arrive or `timeout_ns` (at most 1 s) has passed. Returns the number of edges
    /// written to `edges`, 0 on timeout, or `gone` when the input has vanished and must be reopened. Neither
    /// allocates nor throws.
    virtual int wait(std::int64_t timeout_ns, std::span<Edge> edges) noexcept = 0;
    /// What arrived so far and was no edge. Called on the thread of wait().
    [[nodiscard]] virtual std::uint64_t refused() const noexcept { return 0; }
};

} // namespace obscura::sync
