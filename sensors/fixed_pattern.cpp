// SPDX-License-Identifier: Apache-2.0
#include "sensors/fixed_pattern.hpp"

#include "core/error.hpp"
#include "sensors/fits_map.hpp"
#include "sensors/kernels.hpp"
#include "sensors/response_pattern.hpp"
#include "sensors/streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace obscura::sensors {
namespace {

using Map = std::vector<float>;

/// Two independent white normal maps.
struct Normals {
    Map z0, z1;
};
Normals normals(Effect effect, std::uint64_t seed, std::size_t n) {
    Normals out{Map(n + kernels::padding), Map(n + kernels::padding)};
    kernels::normal_row(n, stream_of(effect, seed, 0, 0), out.z0.data(), out.z1.data());
    out.z0.resize(n);
    out.z1.resize(n);
    return out;
}

double mean_of(const Map& map) {
    return std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
}

/// Dark current map: log-normal with the given rms, with an exponential tail on hot pixels, scaled to the
/// given mean.
Map dark_map(const DetectorSettings& s, std::size_t n, std::uint64_t seed) {
    const bool tail = s.hot_fraction > 0 && s.hot_current_e_per_s > 0;
    if (s.dark_current_e_per_s == 0 || (s.dark_nonuniformity_e_per_s == 0 && !tail)) return {};
    const double relative = s.dark_nonuniformity_e_per_s / s.dark_current_e_per_s;
    const double sigma2 = std::log1p(relative * relative);
    Normals white = normals(Effect::dark, seed, n);
    Map exponent(n + kernels::padding), map(n + kernels::padding);
    for (std::size_t i = 0; i < n; ++i)
        exponent[i] = static_cast<float>(
            std::clamp(std::sqrt(sigma2) * static_cast<double>(white.z0[i]) - sigma2 / 2, -80.0, 80.0));
    kernels::exp_row(exponent.data(), n, map.data());
    map.resize(n);
    for (float& v : map)
        v *= static_cast<float>(s.dark_current_e_per_s);
    if (tail) {
        const kernels::Stream chosen = stream_of(Effect::defects, seed, 0, 0);
        white = normals(Effect::hot, seed, n);
        for (std::size_t i = 0; i < n; ++i)
            if (uniform_double(words_of(chosen, static_cast<std::uint32_t>(i))[0]) < s.hot_fraction) {
                // Half the square of a Gaussian radius is exponential with mean 1.
                const double e = 0.5 * (static_cast<double>(white.z0[i]) * static_cast<double>(white.z0[i]) +
                                        static_cast<double>(white.z1[i]) * static_cast<double>(white.z1[i]));
                map[i] += static_cast<float>(s.hot_current_e_per_s * e);
            }
    }
    const double scale = s.dark_current_e_per_s / mean_of(map);
    for (float& v : map)
        v = static_cast<float>(static_cast<double>(v) * scale);
    return map;
}

Map offset_map(const SensorDescription& d, std::uint64_t seed) {
    const DetectorSettings& s = d.detector;
    if (s.offset_fpn_e == 0 && s.column_fpn_e == 0) return {};
    const auto width = static_cast<std::size_t>(d.readout.width);
    const std::size_t n = width * static_cast<std::size_t>(d.readout.height);
    const Normals white = normals(Effect::offset, seed, n);
    const Normals columns = normals(Effect::column_offset, seed, width);
    Map map(n);
    for (std::size_t i = 0; i < n; ++i)
        map[i] = static_cast<float>(s.offset_fpn_e * static_cast<double>(white.z0[i]) +
                                    s.column_fpn_e * static_cast<double>(columns.z0[i % width]));
    return map;
}

/// Draws `count` distinct rows or columns out of `size`.
std::vector<bool> dead_lines(std::int32_t count, std::int32_t size, std::uint64_t seed, std::uint32_t which) {
    if (count == 0) return {};
    std::vector<bool> dead(static_cast<std::size_t>(size));
    const kernels::Stream stream = stream_of(Effect::defects, seed, 1, 0, which);
    std::int32_t found = 0;
    for (std::uint32_t i = 0; found < std::min(count, size); ++i) {
        const auto at = static_cast<std::size_t>(uniform_double(words_of(stream, i)[0]) * size);
        if (!dead[at]) ++found;
        dead[at] = true;
    }
    return dead;
}

} // namespace

FixedPattern::FixedPattern(const SensorDescription& d) : width(d.readout.width), height(d.readout.height) {
    const DetectorSettings& s = d.detector;
    const auto w = static_cast<std::size_t>(width);
    const std::size_t n = w * static_cast<std::size_t>(height);
    const std::uint64_t seed = d.serial ^ pattern_key;

    response = s.response_map.empty() ? response_pattern(d) : read_fits_map(s.response_map, width, height, 0);
    dark_e_per_s = s.dark_map.empty() ? dark_map(s, n, seed) : read_fits_map(s.dark_map, width, height, 0);
    offset_e = s.offset_map.empty() ? offset_map(d, seed) : read_fits_map(s.offset_map, width, height, -1e9);

    if (s.dead_fraction > 0) {
        if (response.empty()) response.assign(n, 1.0F);
        if (dark_e_per_s.empty()) dark_e_per_s.assign(n, static_cast<float>(s.dark_current_e_per_s));
    }
    const bool special = s.dead_fraction > 0 || s.stuck_fraction > 0 || s.rts_fraction > 0;
    if (special) {
        const kernels::Stream chosen = stream_of(Effect::defects, seed, 0, 0);
        const kernels::Stream drawn = stream_of(Effect::rts_pixels, seed, 0, 0);
        const Normals white = normals(Effect::rts_pixels, seed, n);
        const double codes = std::exp2(s.adc_bits);
        for (std::size_t i = 0; i < n; ++i) {
            if (i % w == 0) {
                dark_rts.first.push_back(static_cast<std::uint32_t>(dark_rts.items.size()));
                stuck.first.push_back(static_cast<std::uint32_t>(stuck.items.size()));
            }
            const auto index = static_cast<std::uint32_t>(i);
            const auto x = static_cast<std::int32_t>(i % w);
            const auto words = words_of(chosen, index);
            if (uniform_double(words[1]) < s.rts_fraction) {
                const auto more = words_of(drawn, index);
                const double z0 = static_cast<double>(white.z0[i]), z1 = static_cast<double>(white.z1[i]);
                // Time constants from 1 s to 1 h, uniform in the logarithm.
                dark_rts.items.push_back(
                    {x, static_cast<float>(s.rts_current_e_per_s * 0.5 * (z0 * z0 + z1 * z1)),
                     static_cast<float>(std::pow(3600.0, uniform_double(more[0]))), index});
            }
            if (uniform_double(words[2]) < s.dead_fraction) response[i] = dark_e_per_s[i] = 0;
            if (uniform_double(words[3]) < s.stuck_fraction)
                stuck.items.push_back(
                    {x, static_cast<std::uint16_t>(uniform_double(words_of(drawn, index)[1]) * codes)});
        }
        dark_rts.first.push_back(static_cast<std::uint32_t>(dark_rts.items.size()));
        stuck.first.push_back(static_cast<std::uint32_t>(stuck.items.size()));
    }
    for (Map* map : {&response, &dark_e_per_s, &offset_e})
        if (!map->empty()) map->resize(n + kernels::padding);
    dead_row = dead_lines(s.dead_rows, height, seed, 0);
    dead_column = dead_lines(s.dead_columns, width, seed, 1);
}

void FixedPattern::write_fits(const std::filesystem::path& folder, const SensorDescription& d) const {
    const std::size_t n = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    const auto whole = [&](Map map, double uniform) {
        map.resize(n, static_cast<float>(uniform));
        return map;
    };
    const std::string of = fmt::format("sensor {}, serial {}", d.name, d.serial);
    write_fits_map(folder / "response.fits", whole(response, 1), width, height, "",
                   "relative response, mean 1, of " + of);
    write_fits_map(folder / "dark_e_per_s.fits", whole(dark_e_per_s, d.detector.dark_current_e_per_s), width,
                   height, "electron/s",
                   fmt::format("dark current at {} degC of {}", d.detector.dark_reference_c, of));
    write_fits_map(folder / "offset_e.fits", whole(offset_e, 0), width, height, "electron",
                   "offset of " + of);
}

} // namespace obscura::sensors
