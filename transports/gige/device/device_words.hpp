// How quantities become the 32-bit words of feature registers, see features.hpp.
#pragma once

#include "transports/gige/registers/features.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace obscura::transports::gige {

inline std::uint32_t time_units(std::int64_t ns) {
    return static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(ns / feature::time_unit_ns, 0, std::int64_t{0xFFFFFFFF}));
}
inline std::uint32_t milli(double value) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(value * 1000)));
}
inline double from_milli(std::uint32_t word) {
    return static_cast<double>(static_cast<std::int32_t>(word)) / 1000;
}

} // namespace obscura::transports::gige
