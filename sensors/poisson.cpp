#include "sensors/poisson.hpp"

#include "core/philox.hpp"

#include <cmath>

namespace obscura::sensors {
namespace {

double invert(double mean, double u) noexcept {
    double probability = std::exp(-mean);
    double k = 0;
    // The bound is never met by chance: at a mean of 10 the tail beyond 100 holds less than 1e-60.
    while (u > probability && k < 100) {
        u -= probability;
        k += 1;
        probability *= mean / k;
    }
    return k;
}

} // namespace

double draw_poisson(double mean, std::array<std::uint32_t, 4> counter,
                    std::array<std::uint32_t, 2> key) noexcept {
    if (!(mean > 0)) return 0;
    if (mean < 10) return invert(mean, uniform_double(philox4x32(counter, key)[0]));

    const double b = 0.931 + 2.53 * std::sqrt(mean);
    const double a = -0.059 + 0.02483 * b;
    const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
    const double squeeze = 0.9277 - 3.6224 / (b - 2);
    for (;; ++counter[3]) {
        const auto words = philox4x32(counter, key);
        for (int pair = 0; pair < 4; pair += 2) {
            const double u = uniform_double(words[static_cast<std::size_t>(pair)]) - 0.5;
            const double v = uniform_double(words[static_cast<std::size_t>(pair) + 1]);
            const double us = 0.5 - std::fabs(u);
            const double k = std::floor((2 * a / us + b) * u + mean + 0.43);
            if (us >= 0.07 && v <= squeeze) return k;
            if (k < 0 || (us < 0.013 && v > us)) continue;
            if (std::log(v * inverse_alpha / (a / (us * us) + b)) <=
                k * std::log(mean) - mean - std::lgamma(k + 1))
                return k;
        }
    }
}

} // namespace obscura::sensors
