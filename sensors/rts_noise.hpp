// SPDX-License-Identifier: Apache-2.0
// Random telegraph signal (RTS) noise: state of a two-level process at any time, without its history.
#pragma once

#include <cstdint>

namespace obscura::sensors {

/// Whether the process of pixel `pixel` is in its upper level at `time_s`.
///
/// At random instants of a grid of tau / 4 the process draws a new level, either with equal probability;
/// between these instants it stays. Its state at a time is that of the latest such instant, found by
/// searching backwards: a stationary process with autocorrelation exp(-dt / tau), whose levels last 2 tau on
/// average. tau = `time_constant_s`. Reentrant, real-time safe.
[[nodiscard]] bool rts_is_high(std::uint64_t key, std::uint32_t pixel, double time_constant_s,
                               double time_s) noexcept;

} // namespace obscura::sensors
