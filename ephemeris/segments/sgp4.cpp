// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/sgp4.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::ephemeris {
namespace {

/// Below it terms that divide by the eccentricity are left out.
constexpr double nearly_circular = 1e-4;

double power4(double x) noexcept {
    return x * x * x * x;
}

/// Solves U = E + a_y cos E - a_x sin E by Newton's method with bounded steps.
double eccentric_longitude(double mean, double a_x, double a_y) noexcept {
    double at = mean;
    for (int i = 0; i < 10; ++i) {
        const double s = std::sin(at), c = std::cos(at);
        const double step = (mean - a_y * c + a_x * s - at) / (1 - c * a_x - s * a_y);
        at += std::clamp(step, -0.95, 0.95);
        if (std::abs(step) < 1e-12) break;
    }
    return at;
}

} // namespace

Sgp4::Sgp4(const Sgp4Constants& constants, const TwoLineElements& elements) noexcept
    : c_(constants), e_(elements) {
    // From Kozai's mean motion to Brouwer's.
    const double cos_i = std::cos(e_.inclination), b2 = 1 - e_.eccentricity * e_.eccentricity;
    const double axis = std::pow(c_.ke / e_.motion, 2.0 / 3);
    const double d = 0.75 * c_.j2 * (3 * cos_i * cos_i - 1) / (std::sqrt(b2) * b2);
    const double d1 = d / (axis * axis);
    const double corrected = axis * (1 - d1 * d1 - d1 * (1.0 / 3 + 134 * d1 * d1 / 81));
    motion_ = e_.motion / (1 + d / (corrected * corrected));
    const double semi_major = std::pow(c_.ke / motion_, 2.0 / 3);
    constexpr double deep_min = 225, low_km = 220;
    const bool deep = full_turn_rad / motion_ >= deep_min;
    simple_drag_ = deep || semi_major * (1 - e_.eccentricity) < low_km / c_.radius_km + 1;
    set_rates(semi_major * b2);
    set_drag(semi_major);
    if (deep) deep_.emplace(e_, c_.ke, motion_, DeepSpace::Rates{anomaly_rate_, perigee_rate_, node_rate_});
}

void Sgp4::set_rates(double semi_latus) noexcept {
    const double cos_i = std::cos(e_.inclination), c2 = cos_i * cos_i, c4 = c2 * c2;
    const double b = std::sqrt(1 - e_.eccentricity * e_.eccentricity);
    const double p2 = 1 / (semi_latus * semi_latus);
    const double first = 1.5 * c_.j2 * p2 * motion_, second = 0.5 * first * c_.j2 * p2,
                 fourth = -0.46875 * c_.j4 * p2 * p2 * motion_;
    anomaly_rate_ =
        motion_ + 0.5 * first * b * (3 * c2 - 1) + 0.0625 * second * b * (13 - 78 * c2 + 137 * c4);
    perigee_rate_ = 0.5 * first * (5 * c2 - 1) + 0.0625 * second * (7 - 114 * c2 + 395 * c4) +
                    fourth * (3 - 36 * c2 + 49 * c4);
    const double node_first = -first * cos_i;
    node_rate_ = node_first + (0.5 * second * (4 - 19 * c2) + 2 * fourth * (3 - 7 * c2)) * cos_i;
    node_drag_ = 3.5 * b * b * node_first; // times C1, which set_drag() finds
}

void Sgp4::set_drag(double semi_major) noexcept {
    const double e = e_.eccentricity, b2 = 1 - e * e;
    const double cos_i = std::cos(e_.inclination), sin_i = std::sin(e_.inclination), c2 = cos_i * cos_i;
    // Density model: its base is lower for low perigees.
    constexpr double low_km = 156, lowest_km = 98, least_km = 20;
    const double perigee_km = (semi_major * (1 - e) - 1) * c_.radius_km;
    double base_km = c_.base_km;
    if (perigee_km < low_km) base_km = perigee_km < lowest_km ? least_km : perigee_km - c_.base_km;
    const double base = base_km / c_.radius_km + 1;
    const double depth = power4((c_.top_km - base_km) / c_.radius_km);

    const double tsi = 1 / (semi_major - base), eta = semi_major * e * tsi, eta2 = eta * eta, e_eta = e * eta;
    const double psi2 = std::abs(1 - eta2), k = depth * power4(tsi), k1 = k / std::pow(psi2, 3.5);
    const double oblate = 3 * c2 - 1, tilt = 1 - c2;
    eta_ = eta;
    c1_ = e_.bstar * k1 * motion_ *
          (semi_major * (1 + 1.5 * eta2 + e_eta * (4 + eta2)) +
           0.375 * c_.j2 * tsi / psi2 * oblate * (8 + 3 * eta2 * (8 + eta2)));
    c4_ = 2 * motion_ * k1 * semi_major * b2 *
          (eta * (2 + 0.5 * eta2) + e * (0.5 + 2 * eta2) -
           c_.j2 * tsi / (semi_major * psi2) *
               (-3 * oblate * (1 - 2 * e_eta + eta2 * (1.5 - 0.5 * e_eta)) +
                0.75 * tilt * (2 * eta2 - e_eta * (1 + eta2)) * std::cos(2 * e_.perigee)));
    c5_ = 2 * k1 * semi_major * b2 * (1 + 2.75 * (eta2 + e_eta) + e_eta * eta2);
    node_drag_ *= c1_;
    if (e > nearly_circular) {
        perigee_drag_ =
            e_.bstar * -2 * k * tsi * (c_.j3 / c_.j2) * motion_ * sin_i / e * std::cos(e_.perigee);
        anomaly_drag_ = -2.0 / 3 * k * e_.bstar / e_eta;
    }
    longitude_[0] = 1.5 * c1_;
    if (simple_drag_) return;
    d2_ = 4 * semi_major * tsi * c1_ * c1_;
    const double t = d2_ * tsi * c1_ / 3;
    d3_ = (17 * semi_major + base) * t;
    d4_ = 0.5 * t * semi_major * tsi * (221 * semi_major + 31 * base) * c1_;
    const double c1_2 = c1_ * c1_;
    longitude_[1] = d2_ + 2 * c1_2;
    longitude_[2] = 0.25 * (3 * d3_ + c1_ * (12 * d2_ + 10 * c1_2));
    longitude_[3] = 0.2 * (3 * d4_ + 12 * c1_ * d3_ + 6 * d2_ * d2_ + 15 * c1_2 * (2 * d2_ + c1_2));
}

Sgp4::Elements Sgp4::secular(double t, double& shrinkage, double& eccentricity_loss,
                             double& drag_rad) const noexcept {
    Elements e{e_.eccentricity,
               e_.inclination,
               e_.node + node_rate_ * t + node_drag_ * t * t,
               e_.perigee + perigee_rate_ * t,
               e_.anomaly + anomaly_rate_ * t,
               motion_};
    shrinkage = 1 - c1_ * t;
    eccentricity_loss = e_.bstar * c4_ * t;
    drag_rad = longitude_[0] * t * t;
    if (simple_drag_) return e;
    const auto cube = [&](double anomaly) { return std::pow(1 + eta_ * std::cos(anomaly), 3); };
    const double turned = perigee_drag_ * t + anomaly_drag_ * (cube(e.anomaly) - cube(e_.anomaly));
    e.anomaly += turned;
    e.perigee -= turned;
    const double t2 = t * t;
    shrinkage -= t2 * (d2_ + t * (d3_ + t * d4_));
    eccentricity_loss += e_.bstar * c5_ * (std::sin(e.anomaly) - std::sin(e_.anomaly));
    drag_rad += t2 * t * (longitude_[1] + t * (longitude_[2] + t * longitude_[3]));
    return e;
}

bool Sgp4::propagate(double minutes, StateKm& state) const noexcept {
    // Nineteen years; elements are good for weeks.
    constexpr double max_min = 1e7;
    if (!(std::abs(minutes) <= max_min)) return false;
    double shrinkage = 1, eccentricity_loss = 0, drag_rad = 0;
    Elements e = secular(minutes, shrinkage, eccentricity_loss, drag_rad);
    if (deep_) deep_->add_secular(minutes, e);
    if (!(e.motion > 0)) return false;
    const double semi_major = std::pow(c_.ke / e.motion, 2.0 / 3) * shrinkage * shrinkage;
    e.motion = c_.ke / std::pow(semi_major, 1.5);
    e.eccentricity -= eccentricity_loss;
    if (!(e.eccentricity < 1 && e.eccentricity >= -0.001)) return false;
    e.eccentricity = std::max(e.eccentricity, 1e-6);
    e.anomaly += motion_ * drag_rad;
    if (deep_) {
        // Angles are within a turn, as Lyddane's variables are not periodic in the node.
        const double longitude = std::fmod(e.anomaly + e.perigee + e.node, full_turn_rad);
        e.node = std::fmod(e.node, full_turn_rad);
        e.perigee = std::fmod(e.perigee, full_turn_rad);
        e.anomaly = std::fmod(longitude - e.perigee - e.node, full_turn_rad);
        deep_->add_periodic(minutes, e);
        if (e.inclination < 0) {
            e.inclination = -e.inclination;
            e.node += std::numbers::pi;
            e.perigee -= std::numbers::pi;
        }
        if (!(e.eccentricity >= 0 && e.eccentricity <= 1)) return false;
    }
    return state_of(e, semi_major, state);
}

bool Sgp4::state_of(const Elements& e, double semi_major, StateKm& state) const noexcept {
    // Long-period terms. In deep space they follow the perturbed inclination.
    const double inclination = deep_ ? e.inclination : e_.inclination;
    const double cos_i = std::cos(inclination), sin_i = std::sin(inclination);
    constexpr double least = 1.5e-12; // at an inclination of 180 degrees
    const double odd = c_.j3 / c_.j2, up = std::abs(1 + cos_i) > least ? 1 + cos_i : least;
    const double p = 1 / (semi_major * (1 - e.eccentricity * e.eccentricity));
    const double a_x = e.eccentricity * std::cos(e.perigee);
    const double a_y = e.eccentricity * std::sin(e.perigee) - p * 0.5 * odd * sin_i;
    const double mean = e.anomaly + e.perigee - p * 0.25 * odd * sin_i * (3 + 5 * cos_i) / up * a_x;

    const double longitude = eccentric_longitude(std::fmod(mean, full_turn_rad), a_x, a_y);
    const double s = std::sin(longitude), c = std::cos(longitude);
    const double e_cos = a_x * c + a_y * s, e_sin = a_x * s - a_y * c, e2 = a_x * a_x + a_y * a_y;
    const double latus = semi_major * (1 - e2);
    if (!(latus >= 0)) return false;
    const double r = semi_major * (1 - e_cos);
    const double radial = std::sqrt(semi_major) * e_sin / r, across = std::sqrt(latus) / r;
    const double b = std::sqrt(1 - e2), part = e_sin / (1 + b);
    const double sin_u = semi_major / r * (s - a_y - a_x * part),
                 cos_u = semi_major / r * (c - a_x + a_y * part);
    const double sin_2u = 2 * cos_u * sin_u, cos_2u = 1 - 2 * sin_u * sin_u;

    // Short-period terms.
    const double k1 = 0.5 * c_.j2 / latus, k2 = k1 / latus;
    const double c2 = cos_i * cos_i, oblate = 3 * c2 - 1, tilt = 1 - c2;
    const double radius = r * (1 - 1.5 * k2 * b * oblate) + 0.5 * k1 * tilt * cos_2u;
    if (!(radius >= 1)) return false; // below the surface
    const double u = std::atan2(sin_u, cos_u) - 0.25 * k2 * (7 * c2 - 1) * sin_2u;
    const double node = e.node + 1.5 * k2 * cos_i * sin_2u;
    const double tilted = inclination + 1.5 * k2 * cos_i * sin_i * cos_2u;
    const double radial_rate = radial - e.motion * k1 * tilt * sin_2u / c_.ke;
    const double across_rate = across + e.motion * k1 * (tilt * cos_2u + 1.5 * oblate) / c_.ke;

    const Vec3 to_node{std::cos(node), std::sin(node), 0};
    const Vec3 to_top{-std::sin(node) * std::cos(tilted), std::cos(node) * std::cos(tilted),
                      std::sin(tilted)};
    const Vec3 outward = std::cos(u) * to_node + std::sin(u) * to_top;
    const Vec3 forward = std::cos(u) * to_top - std::sin(u) * to_node;
    constexpr double s_per_min = 60;
    state.position = radius * c_.radius_km * outward;
    state.velocity = c_.radius_km * c_.ke / s_per_min * (radial_rate * outward + across_rate * forward);
    return true;
}

} // namespace obscura::ephemeris
