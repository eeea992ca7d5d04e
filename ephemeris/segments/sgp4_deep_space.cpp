// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/sgp4_deep_space.hpp"

#include <cmath>
#include <numbers>

namespace obscura::ephemeris {
namespace {

/// Rotation of the Earth, rad/min.
constexpr double earth_rate = 4.37526908801129966e-3;
/// Elements in the order of DeepSpace::Perturber.
enum PerturbedElement : std::size_t { of_eccentricity, of_inclination, of_anomaly, of_perigee, of_node };

double wrapped(double angle) noexcept {
    return std::fmod(angle, full_turn_rad);
}

/// Greenwich sidereal time by the formula of the Air Force, of 1970.
double sidereal_time(double days_since_1950) noexcept {
    const double since_1970 = days_since_1950 - 7305;
    const double whole = std::floor(since_1970 + 1e-8);
    constexpr double of_1970 = 1.7321343856509374, per_day = 1.72027916940703639e-2,
                     acceleration = 5.07551419432269442e-15;
    const double angle =
        wrapped(of_1970 + per_day * whole + (per_day + full_turn_rad) * (since_1970 - whole) +
                since_1970 * since_1970 * acceleration);
    return angle < 0 ? angle + full_turn_rad : angle;
}

/// a + b x + c x^2 + d x^3.
double cubic(double x, double a, double b, double c, double d = 0) noexcept {
    return a + x * (b + x * (c + x * d));
}

/// Functions of the eccentricity of the resonances of half a day (Hoots, Schumacher and Glover 2004).
struct HalfDayFunctions {
    double g201, g211, g310, g322, g410, g422, g520, g533, g521, g532;

    explicit HalfDayFunctions(double e) noexcept : g201(-0.306 - (e - 0.64) * 0.440) {
        if (e <= 0.65) {
            g211 = cubic(e, 3.616, -13.2470, 16.2900);
            g310 = cubic(e, -19.302, 117.3900, -228.4190, 156.5910);
            g322 = cubic(e, -18.9068, 109.7927, -214.6334, 146.5816);
            g410 = cubic(e, -41.122, 242.6940, -471.0940, 313.9530);
            g422 = cubic(e, -146.407, 841.8800, -1629.014, 1083.4350);
            g520 = cubic(e, -532.114, 3017.977, -5740.032, 3708.2760);
        } else {
            g211 = cubic(e, -72.099, 331.819, -508.738, 266.724);
            g310 = cubic(e, -346.844, 1582.851, -2415.925, 1246.113);
            g322 = cubic(e, -342.585, 1554.908, -2366.899, 1215.972);
            g410 = cubic(e, -1052.797, 4758.686, -7193.992, 3651.957);
            g422 = cubic(e, -3581.690, 16178.110, -24462.770, 12422.520);
            g520 = e > 0.715 ? cubic(e, -5149.66, 29936.92, -54087.36, 31324.56)
                             : cubic(e, 1464.74, -4664.75, 3763.64);
        }
        if (e < 0.7) {
            g533 = cubic(e, -919.22770, 4988.6100, -9064.7700, 5542.21);
            g521 = cubic(e, -822.71072, 4568.6173, -8491.4146, 5337.524);
            g532 = cubic(e, -853.66600, 4690.2500, -8624.7700, 5341.4);
        } else {
            g533 = cubic(e, -37995.780, 161616.52, -229838.20, 109377.94);
            g521 = cubic(e, -51752.104, 218913.95, -309468.16, 146349.42);
            g532 = cubic(e, -40023.880, 170470.89, -242699.48, 115605.82);
        }
    }
};

} // namespace

DeepSpace::DeepSpace(const TwoLineElements& at_epoch, double ke, double motion, const Rates& rates) noexcept
    : e_(at_epoch), motion_(motion), rates_(rates), sidereal_rad_(sidereal_time(at_epoch.epoch_days)) {
    const double days = e_.epoch_days + 18261.5; // since 1900-01-00.5
    const double cos_node = std::cos(e_.node), sin_node = std::sin(e_.node);
    sun_ = {wrapped(6.2565837 + 0.017201977 * days), 1.19459e-5, 0.01675, {}, 0, 0, {}};
    set_amplitudes({0.1945905, -0.98088458, 0.91744867, 0.39785416, cos_node, sin_node, 2.9864797e-6}, sun_);

    // Orbit of the Moon in the equator, by its node in the ecliptic.
    const double node = wrapped(4.5236020 - 9.2422029e-4 * days);
    const double cos_inclination = 0.91375164 - 0.03568096 * std::cos(node);
    const double sin_inclination = std::sqrt(1 - cos_inclination * cos_inclination);
    const double sin_moon = 0.089683511 * std::sin(node) / sin_inclination;
    const double cos_moon = std::sqrt(1 - sin_moon * sin_moon);
    const double apsides = 5.8351514 + 0.0019443680 * days;
    const double perigee = apsides - node +
                           std::atan2(0.39785416 * std::sin(node) / sin_inclination,
                                      cos_moon * std::cos(node) + 0.91744867 * sin_moon * std::sin(node));
    moon_ = {wrapped(4.7199672 + 0.22997150 * days - apsides), 1.5835218e-4, 0.05490, {}, 0, 0, {}};
    set_amplitudes({std::cos(perigee), std::sin(perigee), cos_inclination, sin_inclination,
                    cos_moon * cos_node + sin_moon * sin_node, sin_node * cos_moon - cos_node * sin_moon,
                    4.7968065e-7},
                   moon_);

    const double inverse_axis = std::pow(motion / ke, 2.0 / 3);
    if (motion > 0.0034906585 && motion < 0.0052359877)
        set_day_terms(inverse_axis);
    else if (motion >= 8.26e-3 && motion <= 9.24e-3 && e_.eccentricity >= 0.5)
        set_half_day_terms(inverse_axis);
}

void DeepSpace::set_amplitudes(const Plane& p, Perturber& body) const noexcept {
    const double e = e_.eccentricity, e2 = e * e, b2 = 1 - e2;
    const double cos_i = std::cos(e_.inclination), sin_i = std::sin(e_.inclination);
    const double cos_w = std::cos(e_.perigee), sin_w = std::sin(e_.perigee);
    // Axes of the perturber's orbit in those of the node, then of the perigee.
    const double a1 = p.cos_perigee * p.cos_node + p.sin_perigee * p.cos_inclination * p.sin_node;
    const double a3 = -p.sin_perigee * p.cos_node + p.cos_perigee * p.cos_inclination * p.sin_node;
    const double a7 = -p.cos_perigee * p.sin_node + p.sin_perigee * p.cos_inclination * p.cos_node;
    const double a8 = p.sin_perigee * p.sin_inclination;
    const double a9 = p.sin_perigee * p.sin_node + p.cos_perigee * p.cos_inclination * p.cos_node;
    const double a10 = p.cos_perigee * p.sin_inclination;
    const double a2 = cos_i * a7 + sin_i * a8, a4 = cos_i * a9 + sin_i * a10;
    const double a5 = -sin_i * a7 + cos_i * a8, a6 = -sin_i * a9 + cos_i * a10;
    const double x1 = a1 * cos_w + a2 * sin_w, x2 = a3 * cos_w + a4 * sin_w;
    const double x3 = -a1 * sin_w + a2 * cos_w, x4 = -a3 * sin_w + a4 * cos_w;
    const double x5 = a5 * sin_w, x6 = a6 * sin_w, x7 = a5 * cos_w, x8 = a6 * cos_w;

    const double z31 = 12 * x1 * x1 - 3 * x3 * x3, z32 = 24 * x1 * x2 - 6 * x3 * x4,
                 z33 = 12 * x2 * x2 - 3 * x4 * x4;
    const double z1 = 6 * (a1 * a1 + a2 * a2) + (1 + e2) * z31;
    const double z2 = 12 * (a1 * a3 + a2 * a4) + (1 + e2) * z32;
    const double z3 = 6 * (a3 * a3 + a4 * a4) + (1 + e2) * z33;
    const double z11 = -6 * a1 * a5 - e2 * (24 * x1 * x7 + 6 * x3 * x5);
    const double z12 = -6 * (a1 * a6 + a3 * a5) - e2 * (24 * (x2 * x7 + x1 * x8) + 6 * (x3 * x6 + x4 * x5));
    const double z13 = -6 * a3 * a6 - e2 * (24 * x2 * x8 + 6 * x4 * x6);
    const double z21 = 6 * a2 * a5 + e2 * (24 * x1 * x5 - 6 * x3 * x7);
    const double z22 = 6 * (a4 * a5 + a2 * a6) + e2 * (24 * (x2 * x5 + x1 * x6) - 6 * (x4 * x7 + x3 * x8));
    const double z23 = 6 * a4 * a6 + e2 * (24 * x2 * x6 - 6 * x4 * x8);

    const double s3 = p.strength / motion_, s2 = -0.5 * s3 / std::sqrt(b2), s4 = s3 * std::sqrt(b2),
                 s1 = -15 * e * s4;
    const double s5 = x1 * x3 + x2 * x4, s6 = x2 * x3 + x1 * x4, s7 = x2 * x4 - x1 * x3;
    body.amplitude = {{{2 * s1 * s6, 2 * s1 * s7},
                       {2 * s2 * z12, 2 * s2 * (z13 - z11)},
                       {-2 * s3 * z2, -2 * s3 * (z3 - z1)},
                       {2 * s4 * z32, 2 * s4 * (z33 - z31)},
                       {-2 * s2 * z22, -2 * s2 * (z23 - z21)}}};
    body.anomaly_once = 2 * s3 * (21 + 9 * e2) * body.eccentricity;
    body.perigee_once = -18 * s4 * body.eccentricity;

    const double n = body.motion;
    double node_rate = -n * s2 * (z21 + z23);
    constexpr double flat_rad = 5.2359877e-2;
    if (e_.inclination < flat_rad || e_.inclination > std::numbers::pi - flat_rad) node_rate = 0;
    if (sin_i != 0) node_rate /= sin_i;
    body.rate = {s1 * n * s5, s2 * n * (z11 + z13), -n * s3 * (z1 + z3 - 14 - 6 * e2),
                 s4 * n * (z31 + z33 - 6) - cos_i * node_rate, node_rate};
}

void DeepSpace::set_day_terms(double inverse_axis) noexcept {
    const double e2 = e_.eccentricity * e_.eccentricity;
    const double c = std::cos(e_.inclination), s = std::sin(e_.inclination), up = 1 + c;
    const double g200 = 1 + e2 * (-2.5 + 0.8125 * e2), g310 = 1 + 2 * e2, g300 = 1 + e2 * (-6 + 6.60937 * e2);
    const double f220 = 0.75 * up * up, f311 = 0.9375 * s * s * (1 + 3 * c) - 0.75 * up,
                 f330 = 1.875 * up * up * up;
    const double base = 3 * motion_ * motion_ * inverse_axis * inverse_axis;
    resonance_ = Resonance::day;
    term_count_ = 3;
    terms_[0] = {base * f311 * g310 * 2.1460748e-6 * inverse_axis, 0, 1, 0.13130908};
    terms_[1] = {2 * base * f220 * g200 * 1.7891679e-6, 0, 2, 2 * 2.8843198};
    terms_[2] = {3 * base * f330 * g300 * 2.2123015e-7 * inverse_axis, 0, 3, 3 * 0.37448087};
    longitude_ = wrapped(e_.anomaly + e_.node + e_.perigee - sidereal_rad_);
    longitude_rate_ = rates_.anomaly + rates_.perigee + rates_.node - earth_rate - motion_;
    for (const Perturber* body : {&sun_, &moon_})
        longitude_rate_ += body->rate[of_anomaly] + body->rate[of_perigee] + body->rate[of_node];
}

void DeepSpace::set_half_day_terms(double inverse_axis) noexcept {
    const HalfDayFunctions g(e_.eccentricity);
    const double c = std::cos(e_.inclination), s = std::sin(e_.inclination), c2 = c * c, s2 = s * s;
    const double f220 = 0.75 * (1 + 2 * c + c2), f221 = 1.5 * s2;
    const double f321 = 1.875 * s * (1 - 2 * c - 3 * c2), f322 = -1.875 * s * (1 + 2 * c - 3 * c2);
    const double f441 = 35 * s2 * f220, f442 = 39.3750 * s2 * s2;
    const double f522 = 9.84375 * s * (s2 * (1 - 2 * c - 5 * c2) + 0.33333333 * (-2 + 4 * c + 6 * c2));
    const double f523 = s * (4.92187512 * s2 * (-2 - 4 * c + 10 * c2) + 6.56250012 * (1 + 2 * c - 3 * c2));
    const double f542 = 29.53125 * s * (2 - 8 * c + c2 * (-12 + 8 * c + 10 * c2));
    const double f543 = 29.53125 * s * (-2 - 8 * c + c2 * (12 + 8 * c - 10 * c2));
    // Strengths of the terms of degrees 2 to 5 of the Earth's field.
    const double of2 = 3 * motion_ * motion_ * inverse_axis * inverse_axis, of3 = of2 * inverse_axis,
                 of4 = of3 * inverse_axis, of5 = of4 * inverse_axis;
    const double k22 = of2 * 1.7891679e-6, k32 = of3 * 3.7393792e-7, k44 = 2 * of4 * 7.3636953e-9,
                 k52 = of5 * 1.1428639e-7, k54 = 2 * of5 * 2.1765803e-9;
    constexpr double p22 = 5.7686396, p32 = 0.95240898, p44 = 1.8014998, p52 = 1.0508330, p54 = 4.4108898;
    resonance_ = Resonance::half_day;
    term_count_ = terms_.size();
    terms_ = {{{k22 * f220 * g.g201, 2, 1, p22},
               {k22 * f221 * g.g211, 0, 1, p22},
               {k32 * f321 * g.g310, 1, 1, p32},
               {k32 * f322 * g.g322, -1, 1, p32},
               {k44 * f441 * g.g410, 2, 2, p44},
               {k44 * f442 * g.g422, 0, 2, p44},
               {k52 * f522 * g.g520, 1, 1, p52},
               {k52 * f523 * g.g532, -1, 1, p52},
               {k54 * f542 * g.g521, 1, 2, p54},
               {k54 * f543 * g.g533, -1, 2, p54}}};
    longitude_ = wrapped(e_.anomaly + 2 * e_.node - 2 * sidereal_rad_);
    longitude_rate_ = rates_.anomaly + 2 * (rates_.node - earth_rate) - motion_;
    for (const Perturber* body : {&sun_, &moon_})
        longitude_rate_ += body->rate[of_anomaly] + 2 * body->rate[of_node];
}

void DeepSpace::add_secular(double minutes, Elements& e) const noexcept {
    for (const Perturber* body : {&sun_, &moon_}) {
        e.eccentricity += body->rate[of_eccentricity] * minutes;
        e.inclination += body->rate[of_inclination] * minutes;
        e.anomaly += body->rate[of_anomaly] * minutes;
        e.perigee += body->rate[of_perigee] * minutes;
        e.node += body->rate[of_node] * minutes;
    }
    if (resonance_ != Resonance::none) add_resonance(minutes, e);
}

void DeepSpace::add_resonance(double minutes, Elements& e) const noexcept {
    // Steps of half a day from the epoch, by Taylor series of order 2 in longitude and motion.
    constexpr double step_min = 720;
    double longitude = longitude_, motion = motion_, at = 0;
    for (;;) {
        const double perigee = e_.perigee + rates_.perigee * at;
        double rate = 0, acceleration = 0;
        for (std::size_t i = 0; i < term_count_; ++i) {
            const Term& t = terms_[i];
            const double angle = t.longitude_factor * longitude + t.perigee_factor * perigee - t.phase;
            rate += t.amplitude * std::sin(angle);
            acceleration += t.amplitude * t.longitude_factor * std::cos(angle);
        }
        const double speed = motion + longitude_rate_;
        acceleration *= speed;
        const double left = minutes - at;
        const bool last = !(std::abs(left) >= step_min);
        const double step = last ? left : std::copysign(step_min, left);
        longitude += speed * step + rate * step * step / 2;
        motion += rate * step + acceleration * step * step / 2;
        if (last) break;
        at += step;
    }
    e.motion = motion;
    const double sidereal = wrapped(sidereal_rad_ + minutes * earth_rate);
    e.anomaly = resonance_ == Resonance::day ? longitude - e.node - e.perigee + sidereal
                                             : longitude - 2 * e.node + 2 * sidereal;
}

void DeepSpace::add_periodic(double minutes, Elements& e) const noexcept {
    std::array<double, 5> change{};
    for (const Perturber* body : {&sun_, &moon_}) {
        const double anomaly = body->anomaly + body->motion * minutes;
        const double longitude = anomaly + 2 * body->eccentricity * std::sin(anomaly);
        const double s = std::sin(longitude);
        const double f2 = 0.5 * s * s - 0.25, f3 = -0.5 * s * std::cos(longitude);
        for (std::size_t i = 0; i < change.size(); ++i)
            change[i] += body->amplitude[i][0] * f2 + body->amplitude[i][1] * f3;
        change[of_anomaly] += body->anomaly_once * s;
        change[of_perigee] += body->perigee_once * s;
    }
    e.inclination += change[of_inclination];
    e.eccentricity += change[of_eccentricity];
    const double sin_i = std::sin(e.inclination), cos_i = std::cos(e.inclination);
    constexpr double lyddane_rad = 0.2;
    if (e.inclination >= lyddane_rad) {
        const double node = change[of_node] / sin_i;
        e.perigee += change[of_perigee] - cos_i * node;
        e.node += node;
        e.anomaly += change[of_anomaly];
        return;
    }
    // Lyddane's variables, which have no pole at inclination 0.
    const double sin_node = std::sin(e.node), cos_node = std::cos(e.node);
    const double tilt = change[of_inclination] * cos_i;
    const double y = sin_i * sin_node + change[of_node] * cos_node + tilt * sin_node;
    const double x = sin_i * cos_node - change[of_node] * sin_node + tilt * cos_node;
    const auto positive = [](double angle) { return angle < 0 ? angle + full_turn_rad : angle; };
    const double before = positive(wrapped(e.node));
    const double sum = e.anomaly + e.perigee + cos_i * before + change[of_anomaly] + change[of_perigee] -
                       change[of_inclination] * before * sin_i;
    e.node = positive(std::atan2(y, x));
    if (std::abs(before - e.node) > std::numbers::pi)
        e.node += e.node < before ? full_turn_rad : -full_turn_rad;
    e.anomaly += change[of_anomaly];
    e.perigee = sum - e.anomaly - cos_i * e.node;
}

} // namespace obscura::ephemeris
