// SPDX-License-Identifier: Apache-2.0
#include "sensors/sample_effects.hpp"

#include "sensors/rts_noise.hpp"
#include "sensors/streams.hpp"

#include <cmath>

namespace obscura::sensors {
namespace {

/// RTS noise of the source followers.
class FollowerRts final : public SampleEffect {
public:
    explicit FollowerRts(const SensorDescription& d) : pixels_(follower_rts_pixels(d)) {}

    void add(const RowSample& sample, float* sum_e) const noexcept override {
        constexpr std::uint64_t follower_key =
            0x666f6c6c6f776572; // "follower": independent of dark-current RTS
        for (const FollowerRtsPixel& p : pixels_.row(sample.array_row)) {
            const std::int32_t x = p.x - sample.first_column;
            if (x < 0 || x >= static_cast<std::int32_t>(sample.columns)) continue;
            if (rts_is_high(sample.seed ^ follower_key, p.pixel, static_cast<double>(p.time_constant_s),
                            sample.time_s))
                sum_e[x] += sample.weight * p.step_e;
        }
    }

private:
    PerRow<FollowerRtsPixel> pixels_;
};

} // namespace

SampleEffects make_sample_effects(const SensorDescription& description) {
    const DetectorSettings& s = description.detector;
    SampleEffects effects;
    if (s.follower_rts_fraction > 0 && s.follower_rts_e > 0)
        effects.push_back(std::make_unique<FollowerRts>(description));
    return effects;
}

PerRow<FollowerRtsPixel> follower_rts_pixels(const SensorDescription& d) {
    const DetectorSettings& s = d.detector;
    const auto width = static_cast<std::size_t>(d.readout.width);
    const std::size_t n = width * static_cast<std::size_t>(d.readout.height);
    const kernels::Stream drawn = stream_of(Effect::follower_rts_pixels, d.serial ^ pattern_key, 0, 0);
    PerRow<FollowerRtsPixel> pixels;
    for (std::size_t i = 0; i < n; ++i) {
        if (i % width == 0) pixels.first.push_back(static_cast<std::uint32_t>(pixels.items.size()));
        const auto index = static_cast<std::uint32_t>(i);
        const auto words = words_of(drawn, index);
        if (!(uniform_double(words[0]) < s.follower_rts_fraction)) continue;
        // Time constants from 1 us to 10 ms, uniform in the logarithm.
        pixels.items.push_back({static_cast<std::int32_t>(i % width),
                                static_cast<float>(-s.follower_rts_e * std::log(uniform_double(words[1]))),
                                static_cast<float>(1e-6 * std::pow(1e4, uniform_double(words[2]))), index});
    }
    pixels.first.push_back(static_cast<std::uint32_t>(pixels.items.size()));
    return pixels;
}

} // namespace obscura::sensors
