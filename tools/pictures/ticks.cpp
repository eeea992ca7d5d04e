// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/ticks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::tools {

std::vector<double> round_ticks(double low, double high, int most) {
    std::vector<double> out;
    if (!(high > low) || !std::isfinite(high - low) || most < 1) return out;
    const double rough = (high - low) / most;
    const double decade = std::pow(10.0, std::floor(std::log10(rough)));
    for (const double step : {decade, 2 * decade, 5 * decade, 10 * decade}) {
        const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
        if (last - first + 1 > most) continue;
        for (double k = first; k <= last; ++k)
            out.push_back(k * step + 0.0); // no negative zero
        return out;
    }
    return out;
}

std::vector<double> decade_ticks(double low, double high) {
    std::vector<double> out;
    if (!(low > 0) || !(high > low) || !std::isfinite(high)) return out;
    const auto from = static_cast<int>(std::floor(std::log10(low))),
               to = static_cast<int>(std::ceil(std::log10(high)));
    for (const bool all : {false, true}) {
        out.clear();
        for (int e = from; e <= to; ++e)
            for (const double digit : {1.0, 2.0, 5.0}) {
                const double v = digit * std::pow(10.0, e);
                if ((all || digit == 1) && v >= low * (1 - 1e-9) && v <= high * (1 + 1e-9)) out.push_back(v);
            }
        if (out.size() >= 3) break;
    }
    return out;
}

std::vector<double> spread_ticks(double low, double high, const std::function<double(double)>& position,
                                 double distance) {
    std::vector<double> out;
    if (!(high > low) || !std::isfinite(high - low)) return out;
    const auto offer = [&](double v) {
        if (v < low || v > high) return;
        const double at = position(v);
        if (std::none_of(out.begin(), out.end(),
                         [&](double other) { return std::abs(position(other) - at) < distance; }))
            out.push_back(v);
    };
    offer(0);
    const double largest = std::max(std::abs(low), std::abs(high));
    const auto top = static_cast<int>(std::ceil(std::log10(largest)));
    constexpr int decades = 9;
    for (const double digit : {1.0, 5.0, 2.0, 3.0, 7.0})
        for (int e = top; e > top - decades; --e)
            for (const double sign : {1.0, -1.0})
                offer(sign * digit * std::pow(10.0, e));
    // A range far from zero: multiples of its own step.
    if (out.size() < 3)
        for (const double v : round_ticks(low, high, 5))
            offer(v);
    std::sort(out.begin(), out.end());
    return out;
}

std::vector<std::string> tick_labels(const std::vector<double>& ticks) {
    std::vector<std::string> out;
    constexpr int fewest = 4, most = 15;
    for (int digits = fewest; digits <= most; ++digits) {
        out.clear();
        for (const double v : ticks) {
            // Numbers below a million are written out.
            const double size = std::abs(v);
            const int whole = size >= 1 && size < 1e6 ? static_cast<int>(std::log10(size)) + 1 : 1;
            out.push_back(fmt::format("{:.{}g}", v, std::max(digits, whole)));
        }
        if (std::adjacent_find(out.begin(), out.end()) == out.end()) break;
    }
    return out;
}

} // namespace obscura::tools
