// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/two_body.hpp"

#include <cmath>
#include <numbers>

namespace obscura::ephemeris {
namespace {

/// Stumpff's functions c2 and c3.
struct Stumpff {
    double c2, c3;
};
Stumpff stumpff(double z) {
    // Series near 0, where the closed forms cancel.
    if (std::abs(z) < 0.5) {
        double c2 = 0, c3 = 0, term2 = 0.5, term3 = 1.0 / 6;
        for (int k = 1; k < 14; ++k) {
            c2 += term2;
            c3 += term3;
            term2 *= -z / ((2 * k + 1) * (2 * k + 2));
            term3 *= -z / ((2 * k + 2) * (2 * k + 3));
        }
        return {c2, c3};
    }
    if (z > 0) {
        const double s = std::sqrt(z);
        return {(1 - std::cos(s)) / z, (s - std::sin(s)) / (z * s)};
    }
    const double s = std::sqrt(-z);
    return {(std::cosh(s) - 1) / -z, (std::sinh(s) - s) / (-z * s)};
}

} // namespace

StateKm blended_states(const StateKm& early, const StateKm& late, double after_s, double span_s) noexcept {
    const double angle = std::numbers::pi * after_s / span_s;
    const double weight = 0.5 + 0.5 * std::cos(angle);
    const double weight_rate = -0.5 * std::numbers::pi / span_s * std::sin(angle);
    return {weight * early.position + (1 - weight) * late.position,
            weight * early.velocity + (1 - weight) * late.velocity +
                weight_rate * (early.position - late.position)};
}

bool propagate_two_body(double gm, const StateKm& from, double dt_s, StateKm& to) noexcept {
    const double r0 = length(from.position);
    if (!(r0 > 0) || !(gm > 0) || !std::isfinite(dt_s)) return false;
    const double root = std::sqrt(gm);
    const double sigma = dot(from.position, from.velocity) / root;
    const double alpha = 2 / r0 - dot(from.velocity, from.velocity) / gm;
    // Whole revolutions change nothing.
    if (alpha > 0) dt_s = std::remainder(dt_s, 2 * std::numbers::pi / (root * alpha * std::sqrt(alpha)));

    // Kepler's equation, which increases with x: its slope is the distance.
    const auto kepler = [&](double x) {
        const Stumpff c = stumpff(alpha * x * x);
        return sigma * x * x * c.c2 + (1 - alpha * r0) * x * x * x * c.c3 + r0 * x - root * dt_s;
    };
    const double sign = dt_s < 0 ? -1 : 1;
    double low = 0, high = sign * root * std::abs(dt_s) / r0;
    for (int i = 0; i < 200 && sign * kepler(high) < 0; ++i) {
        low = high;
        high *= 2;
    }
    double x = (low + high) / 2;
    for (int i = 0; i < 100; ++i) {
        const double value = kepler(x);
        if (!(sign * value >= 0))
            low = x;
        else
            high = x;
        const Stumpff c = stumpff(alpha * x * x);
        const double slope = sigma * x * (1 - alpha * x * x * c.c3) + (1 - alpha * r0) * x * x * c.c2 + r0;
        double next = x - value / slope;
        if (!(sign * (next - low) >= 0 && sign * (high - next) >= 0)) next = (low + high) / 2;
        const bool settled = std::abs(next - x) <= 1e-15 * std::abs(x);
        x = next;
        if (settled) break;
    }

    const Stumpff c = stumpff(alpha * x * x);
    const double f = 1 - x * x / r0 * c.c2;
    const double g = dt_s - x * x * x / root * c.c3;
    to.position = f * from.position + g * from.velocity;
    const double r = length(to.position);
    const double f_rate = root / (r * r0) * x * (alpha * x * x * c.c3 - 1);
    const double g_rate = 1 - x * x / r * c.c2;
    to.velocity = f_rate * from.position + g_rate * from.velocity;
    return is_finite(to.position) && is_finite(to.velocity);
}

StateKm equinoctial_state(const EquinoctialElements& e, double dt_s) noexcept {
    // Elements at the time.
    const auto turned = [](double sine, double cosine, double angle) {
        return std::pair{sine * std::cos(angle) + cosine * std::sin(angle),
                         cosine * std::cos(angle) - sine * std::sin(angle)};
    };
    const auto [h, k] = turned(e.h, e.k, e.periapsis_rate * dt_s);
    const auto [p, q] = turned(e.p, e.q, e.node_rate * dt_s);
    const double turn = 2 * std::numbers::pi;
    const double longitude = e.mean_longitude + std::fmod(e.mean_longitude_rate * dt_s, turn);

    // Eccentric longitude: L = F + h cos F - k sin F.
    double f = longitude;
    for (int i = 0; i < 50; ++i) {
        const double step =
            (f + h * std::cos(f) - k * std::sin(f) - longitude) / (1 - h * std::sin(f) - k * std::cos(f));
        f -= step;
        if (std::abs(step) < 1e-15) break;
    }
    const double sf = std::sin(f), cf = std::cos(f);

    // Place and speed in the plane of the orbit; the periapsis turns in it.
    const double b = 1 / (1 + std::sqrt(1 - h * h - k * k));
    const double a = e.semi_major_axis_km;
    const double x = a * ((1 - b * h * h) * cf + h * k * b * sf - k);
    const double y = a * ((1 - b * k * k) * sf + h * k * b * cf - h);
    const double along = h * sf + k * cf;
    const double speed = e.mean_longitude_rate * a / (1 - along);
    const double still = 1 - e.periapsis_rate / e.mean_longitude_rate;
    const double turning = e.periapsis_rate - e.node_rate;
    const double dx = still * speed * (-sf + h * b * along) - turning * y;
    const double dy = still * speed * (cf - k * b * along) + turning * x;

    // Axes of the orbit in the reference plane, whose node moves.
    const double norm = 1 / (1 + p * p + q * q);
    const Vec3 vf{(1 - p * p + q * q) * norm, 2 * p * q * norm, -2 * p * norm};
    const Vec3 vg{2 * p * q * norm, (1 + p * p - q * q) * norm, 2 * q * norm};
    const Vec3 place = x * vf + y * vg;
    const Vec3 rate = dx * vf + dy * vg + e.node_rate * Vec3{-place.y, place.x, 0};

    // From the plane of the pole to the frame of the segment.
    const double sa = std::sin(e.pole_ra), ca = std::cos(e.pole_ra);
    const double sd = std::sin(e.pole_dec), cd = std::cos(e.pole_dec);
    const auto to_frame = [&](Vec3 v) {
        return Vec3{-sa * v.x - ca * sd * v.y + ca * cd * v.z, ca * v.x - sa * sd * v.y + sa * cd * v.z,
                    cd * v.y + sd * v.z};
    };
    return {to_frame(place), to_frame(rate)};
}

} // namespace obscura::ephemeris
