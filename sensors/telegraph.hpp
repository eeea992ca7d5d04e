// Random telegraph signal: the state of a two-level process at any time, without its history.
#pragma once

#include <cstdint>

namespace obscura::sensors {

/// Whether the process `pixel` is in its upper level at `time_s`.
///
/// The process forgets its state at random instants of a grid of tau / 4 and then takes either level with
/// equal probability; between them it stays. Its state at a time is that of the latest such instant, found by
/// looking back: a stationary process with autocorrelation exp(-dt / tau), whose levels last 2 tau on
/// average.
[[nodiscard]] bool telegraph_up(std::uint64_t key, std::uint32_t pixel, double time_constant_s,
                                double time_s) noexcept;

} // namespace obscura::sensors
