// SPDX-License-Identifier: Apache-2.0
#include "sensors/particle_hits.hpp"

#include "sensors/streams.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::sensors {
namespace {

// Mean of the standard Moyal distribution: Euler's constant plus ln 2.
constexpr double moyal_mean = 1.2703628454614782;

/// Fractions of a point charge that diffuse to the pixel of its origin and to the two neighbours, along one
/// axis: quadratic B-spline of the offset from the pixel's centre, -0.5 to 0.5. Order: lower neighbour,
/// pixel, upper neighbour.
std::array<double, 3> diffusion(double offset) {
    const double low = 0.5 - offset, high = 0.5 + offset;
    return {0.5 * low * low, 0.75 - offset * offset, 0.5 * high * high};
}

} // namespace

ParticleFlux::ParticleFlux(const SensorDescription& d) noexcept
    : width_(d.readout.width),
      height_(d.readout.height),
      flux_per_px_s_(d.detector.hit_flux_per_cm2_s * 1e4 * d.pixel_pitch_m * d.row_pitch_m()),
      depth_px_(d.detector.hit_depth_m / d.pixel_pitch_m),
      rows_per_column_(d.pixel_pitch_m / d.row_pitch_m()),
      charge_e_(d.detector.hit_charge_e_per_m * d.detector.hit_depth_m) {}

void ParticleFlux::count_in(std::uint64_t key, std::uint64_t frame, std::int64_t span_ns,
                            std::int32_t first_strip,
                            std::array<float, counted_strips + kernels::padding>& counts) const noexcept {
    std::array<float, counted_strips + kernels::padding> mean{}, z0, z1;
    std::array<float, 4 * (counted_strips + kernels::padding)> scratch;
    for (std::int32_t i = 0; i < counted_strips; ++i) {
        const double rows = std::clamp(height_ - (first_strip + i) * strip_rows, 0, strip_rows);
        mean[static_cast<std::size_t>(i)] =
            static_cast<float>(flux_per_px_s_ * width_ * rows * to_seconds(span_ns));
    }
    kernels::poisson_row(mean.data(), counted_strips,
                         stream_of(Effect::hit_count, key, frame, static_cast<std::uint32_t>(first_strip)),
                         counts.data(), z0.data(), z1.data(), scratch.data());
}

ParticleHit ParticleFlux::hit(std::uint64_t key, std::uint64_t frame, Time begin, std::int64_t span_ns,
                              std::int32_t strip, std::uint32_t index) const noexcept {
    // Two counters: uniforms from the first, normals and two more uniforms from the second.
    kernels::Stream stream = stream_of(Effect::hit, key, frame, 2 * index);
    stream.effect |= static_cast<std::uint32_t>(strip) << 16;
    const auto words = words_of(stream);
    stream.first_pixel += 1;
    const auto more = words_of(stream);
    std::array<float, 1 + kernels::padding> z0{}, z1{};
    kernels::normal_row(1, stream, z0.data(), z1.data());

    ParticleHit out;
    out.x_px = uniform_double(words[0]) * width_;
    const double rows = std::min(strip_rows, height_ - strip * strip_rows);
    out.y_px = strip * strip_rows + uniform_double(words[1]) * rows;
    out.time = begin + static_cast<std::int64_t>(uniform_double(words[2]) * static_cast<double>(span_ns));
    const double cos_theta = std::sqrt(uniform_double(words[3]));
    const double across = depth_px_ * std::sqrt(1 - cos_theta * cos_theta) / cos_theta;
    const double cut =
        std::min(1.0, (reach_px - 2) / std::max(across * std::max(1.0, rows_per_column_), 1e-9));
    const double nx = static_cast<double>(z0[0]), ny = static_cast<double>(z1[0]);
    const double norm = std::max(std::sqrt(nx * nx + ny * ny), 1e-9);
    out.dx_px = cut * across * nx / norm;
    out.dy_px = cut * across * ny / norm * rows_per_column_;
    // Draw the Moyal variate as minus the logarithm of a squared normal; the normal is made from two uniforms
    // of `more` that normal_row() has not used.
    const double radius = std::sqrt(-2 * std::log(uniform_double(more[0])));
    const double normal = radius * std::cos(6.283185307179586 * uniform_double(more[1]));
    const double moyal = -std::log(std::max(normal * normal, 1e-300));
    out.charge_e = cut * charge_e_ / cos_theta * std::max(0.0, 1 + 0.2 * (moyal - moyal_mean));
    return out;
}

void deposit(const ParticleHit& hit, std::int32_t y, std::int32_t x0, std::int32_t n,
             float* charge) noexcept {
    const double low = std::min(hit.y_px, hit.y_px + hit.dy_px),
                 high = std::max(hit.y_px, hit.y_px + hit.dy_px);
    if (y + 2 < low || y - 1 > high) return;
    const double across = std::sqrt(hit.dx_px * hit.dx_px + hit.dy_px * hit.dy_px);
    const int points = static_cast<int>(2 * across) + 1;
    for (int p = 0; p < points; ++p) {
        const double along = (p + 0.5) / points;
        const double px = hit.x_px + along * hit.dx_px, py = hit.y_px + along * hit.dy_px;
        const double cx = std::floor(px), cy = std::floor(py);
        const double row = y - cy; // -1, 0, 1 where the point reaches this row
        if (row < -1 || row > 1) continue;
        const double share =
            diffusion(py - cy - 0.5)[static_cast<std::size_t>(row + 1)] * hit.charge_e / points;
        const auto wx = diffusion(px - cx - 0.5);
        for (int i = -1; i <= 1; ++i) {
            const double x = cx + i - x0;
            if (x < 0 || x >= n) continue;
            charge[static_cast<std::size_t>(x)] +=
                static_cast<float>(share * wx[static_cast<std::size_t>(i + 1)]);
        }
    }
}

} // namespace obscura::sensors
