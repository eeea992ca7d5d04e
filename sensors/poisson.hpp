// Exact Poisson draws from counter-based random numbers.
#pragma once

#include <array>
#include <cstdint>

namespace obscura::sensors {

/// One draw of Poisson(mean). `counter` and `key` select the Philox stream: counter[3] is used up as the
/// number of the attempt, so callers vary the other three words. Means <= 0 give 0. Below 10 by sequential
/// inversion, above by transformed rejection with squeeze: W. Hoermann, The transformed rejection method for
/// generating Poisson random variables, Insurance: Mathematics and Economics 12 (1993), algorithm PTRS.
[[nodiscard]] double draw_poisson(double mean, std::array<std::uint32_t, 4> counter,
                                  std::array<std::uint32_t, 2> key) noexcept;

} // namespace obscura::sensors
