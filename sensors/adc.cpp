// SPDX-License-Identifier: Apache-2.0
#include "sensors/adc.hpp"

#include "sensors/streams.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::sensors {

AdcCurve::AdcCurve(const SensorDescription& description) {
    const DetectorSettings& s = description.detector;
    if (s.adc_inl_dn == 0 && s.adc_dnl_dn == 0) return;
    const std::size_t codes = std::size_t{1} << s.adc_bits;
    if (s.adc_bits > 14) steps_ = 4;

    const kernels::Stream stream = stream_of(Effect::adc, description.serial ^ pattern_key, 0, 0);
    std::vector<float> z0(codes + kernels::padding), z1(codes + kernels::padding);
    kernels::normal_row(codes, stream, z0.data(), z1.data());
    const auto phase = words_of(stream, static_cast<std::uint32_t>(codes) + 1);

    // Compute the upper threshold of each code. A code width is the difference of two thresholds, so each
    // threshold gets 1 / sqrt(2) of the rms. The sinusoids vanish at both ends of the range.
    std::vector<double> threshold(codes);
    const double sign = (phase[0] & 1) != 0 ? 1 : -1;
    for (std::size_t c = 0; c < codes; ++c) {
        const double x = static_cast<double>(c) / static_cast<double>(codes);
        const double bend =
            0.75 * sign * std::sin(std::numbers::pi * x) + 0.25 * std::sin(6 * std::numbers::pi * x);
        threshold[c] = static_cast<double>(c) + 0.5 + s.adc_inl_dn * bend +
                       s.adc_dnl_dn / std::numbers::sqrt2 * static_cast<double>(z0[c]);
    }
    std::sort(threshold.begin(), threshold.end());

    const auto entries = static_cast<std::size_t>(static_cast<double>(codes) * steps_);
    codes_.resize(entries + 2);
    std::size_t code = 0;
    for (std::size_t i = 0; i < codes_.size(); ++i) {
        const double v = (static_cast<double>(i) + 0.5) / steps_;
        while (code + 1 < codes && threshold[code] <= v)
            ++code;
        codes_[i] = static_cast<std::uint16_t>(code);
    }
}

} // namespace obscura::sensors
