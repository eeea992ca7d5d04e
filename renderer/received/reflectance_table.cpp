// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/reflectance_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Midpoints of the squared cosine of emission, equal in projected solid angle, and of the azimuth.
constexpr int polar_steps = 64, azimuth_steps = 32;

} // namespace

ReflectanceTable::ReflectanceTable(const Material& material, std::size_t channels)
    : mirror_(material.mirror_reflectance() >= 0), spectral_(material.spectral()) {
    const std::size_t count = spectral_ ? channels : 1;
    table_.resize(count * nodes);
    diffuse_.resize(count);
    for (std::size_t n = 0; n < nodes; ++n) {
        // The first node stands for grazing light, which laws divide by.
        const double cos_in = std::max(1e-4, static_cast<double>(n) / (nodes - 1));
        const double sin_in = std::sqrt(1 - cos_in * cos_in);
        if (mirror_) {
            const double r = material.mirror_reflectance();
            for (std::size_t c = 0; c < count; ++c)
                table_[c * nodes + n] = {r, r * cos_in, -r * sin_in};
            continue;
        }
        for (int p = 0; p < polar_steps; ++p) {
            const double cos_out = std::sqrt((p + 0.5) / polar_steps),
                         sin_out = std::sqrt(1 - cos_out * cos_out);
            for (int a = 0; a < azimuth_steps; a += packet_size) {
                ScatterPacket s;
                Doubles towards;
                for (int i = 0; i < packet_size; ++i) {
                    // Half a turn: laws are the same on both sides of the plane of incidence.
                    towards[i] = std::cos(std::numbers::pi * (a + i + 0.5) / azimuth_steps) * sin_out;
                    s.cos_in[i] = cos_in;
                    s.cos_out[i] = cos_out;
                    s.cos_phase[i] = std::clamp(cos_in * cos_out + sin_in * towards[i], -1.0, 1.0);
                }
                Channels r;
                if (spectral_)
                    material.reflectances(s, r);
                else
                    material.reflectance(s, r.v[0]);
                for (std::size_t c = 0; c < count; ++c)
                    for (int i = 0; i < packet_size; ++i) {
                        // Radiant exitance in the cell over the irradiance normal to the beam, then per
                        // power.
                        const double part = std::max(0.0, r.v[c][i]) * std::numbers::pi / cos_in /
                                            (polar_steps * azimuth_steps);
                        Reflected& sum = table_[c * nodes + n];
                        sum.share += part;
                        sum.normal += part * cos_out;
                        sum.tangent += part * towards[i];
                    }
            }
        }
    }
    for (std::size_t c = 0; c < count; ++c) {
        double sum = 0, weight = 0;
        for (std::size_t n = 0; n < nodes; ++n) {
            const double cosine = static_cast<double>(n) / (nodes - 1);
            sum += table_[c * nodes + n].share * cosine;
            weight += cosine;
        }
        // Trapezoids: the last node counts half.
        const double half = 0.5;
        diffuse_[c] = (sum - half * table_[c * nodes + nodes - 1].share) / (weight - half);
    }
}

Reflected ReflectanceTable::at(double cos_in, std::size_t channel) const {
    const double place = std::clamp(cos_in, 0.0, 1.0) * (nodes - 1);
    const std::size_t n = std::min(static_cast<std::size_t>(place), nodes - 2);
    const double f = place - static_cast<double>(n);
    const Reflected* const t = &table_[(spectral_ ? channel : 0) * nodes + n];
    return {t[0].share + f * (t[1].share - t[0].share), t[0].normal + f * (t[1].normal - t[0].normal),
            t[0].tangent + f * (t[1].tangent - t[0].tangent)};
}

} // namespace obscura::renderer
