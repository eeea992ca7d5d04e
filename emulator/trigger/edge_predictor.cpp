// SPDX-License-Identifier: Apache-2.0
#include "emulator/trigger/edge_predictor.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::emulator {
namespace {

/// An edge further than this share of a period from its prediction does not belong to the series.
constexpr double max_offset = 0.2;
/// Edges whose mean the loop remembers.
constexpr double memory = 16;

} // namespace

void EdgePredictor::add(Time edge) noexcept {
    if (edges_ == 0 || edge <= phase_) {
        *this = EdgePredictor();
        edges_ = 1;
        phase_ = edge;
        return;
    }
    const double since_ns = static_cast<double>(edge - phase_) - fraction_ns_;
    if (edges_ == 1) {
        edges_ = 2;
        period_ns_ = since_ns;
        phase_ = edge;
        fraction_ns_ = 0;
        return;
    }
    const double periods = std::max(1.0, std::round(since_ns / period_ns_));
    const double off_ns = since_ns - periods * period_ns_;
    if (std::abs(off_ns) > max_offset * period_ns_) {
        edges_ = 1;
        phase_ = edge;
        fraction_ns_ = 0;
        return;
    }
    // Gains of a straight line fitted to all edges so far (Kalata, IEEE AES 20(2), 1984: expanding memory).
    const double n = std::min<double>(++edges_, memory);
    const double alpha = 2 * (2 * n - 1) / (n * (n + 1));
    const double beta = 6 / (n * (n + 1));
    const double filtered_ns = periods * period_ns_ + alpha * off_ns + fraction_ns_;
    period_ns_ += beta * off_ns / periods;
    const double whole = std::floor(filtered_ns);
    phase_ += static_cast<std::int64_t>(whole);
    fraction_ns_ = filtered_ns - whole;
}

std::optional<Time> EdgePredictor::next() const noexcept {
    if (edges_ < 3) return std::nullopt;
    return phase_ + std::llround(fraction_ns_ + period_ns_);
}

} // namespace obscura::emulator
