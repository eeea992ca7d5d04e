// SPDX-License-Identifier: Apache-2.0
// Prediction of the next trigger edge from those before: a phase-locked loop.
#pragma once

#include "core/time.hpp"

#include <cstdint>
#include <optional>

namespace obscura::emulator {

/// Second-order loop (alpha-beta filter) over the edges that became frames: phase and period follow the edges
/// with gains that fall from those of a mean over all edges to constants, so that jitter is averaged and
/// drift followed. Edges that are missing count as whole periods; one that is off by more than a fifth of the
/// period begins the phase anew. Thread-bound; real-time safe.
class EdgePredictor {
public:
    void restart() noexcept { *this = EdgePredictor(); }
    void add(Time edge) noexcept;
    [[nodiscard]] bool empty() const noexcept { return edges_ == 0; }
    /// The next edge; none before three edges.
    [[nodiscard]] std::optional<Time> next() const noexcept;

private:
    std::uint32_t edges_ = 0; ///< since the phase began
    Time phase_;              ///< of the last edge, filtered
    double fraction_ns_ = 0;  ///< of phase_
    double period_ns_ = 0;    ///< 0: not known
};

} // namespace obscura::emulator
