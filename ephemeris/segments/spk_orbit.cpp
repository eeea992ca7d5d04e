// SPDX-License-Identifier: Apache-2.0
// SPK types 5, 15 and 17: two-body motion between states, precessing conics, equinoctial elements.
#include "core/error.hpp"
#include "ephemeris/segments/interpolation.hpp"
#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/segments/spk_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace obscura::ephemeris {
namespace {

constexpr std::size_t orbit_state_words = 6;
constexpr Interval always{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

/// Rotation of `v` about the unit vector `axis`, right-handed.
Vec3 turned_about(Vec3 v, Vec3 axis, double angle_rad) {
    return rotate(axis_angle(axis, angle_rad), v);
}

/// Throws unless all values are finite, as many as `count`.
void require_values(const std::string& place, std::span<const double> words, std::size_t count) {
    if (words.size() != count)
        throw InputError(fmt::format("{}: {} values, allowed {}", place, words.size(), count));
    for (std::size_t i = 0; i < count; ++i)
        if (!std::isfinite(words[i]))
            throw InputError(fmt::format("{}: value {} is {}", place, i + 1, words[i]));
}

/// Type 5: two-body motion from the states before and after, blended by a cosine.
class BlendedOrbits final : public SpkData {
public:
    BlendedOrbits(const std::string& place, std::span<const double> words) {
        if (words.size() < 2) throw InputError(fmt::format("{}: {} values", place, words.size()));
        const std::size_t count = count_in(place, words.back(), words.size(), "states");
        gm_ = words[words.size() - 2];
        if (!(gm_ > 0) || !std::isfinite(gm_))
            throw InputError(fmt::format("{}: GM of {} km3/s2, allowed above 0", place, gm_));
        if (count * (orbit_state_words + 1) + directory_size(count) + 2 != words.size())
            throw InputError(
                fmt::format("{}: {} states do not fit into {} values", place, count, words.size()));
        states_ = words.first(count * orbit_state_words);
        times_ = words.subspan(states_.size(), count);
        require_increasing(place, times_, true, "time");
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        const auto after = static_cast<std::size_t>(
            std::upper_bound(times_.begin(), times_.end(), time.seconds()) - times_.begin());
        if (after == 0 || after == times_.size()) return at(after == 0 ? 0 : after - 1, time, state);
        StateKm early, late;
        if (!at(after - 1, time, early) || !at(after, time, late)) return false;
        state =
            blended_states(early, late, since(time, times_[after - 1]), times_[after] - times_[after - 1]);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override { return always; }

private:
    [[nodiscard]] bool at(std::size_t index, TdbTime time, StateKm& state) const noexcept {
        const std::span<const double> s = states_.subspan(index * orbit_state_words, orbit_state_words);
        return propagate_two_body(gm_, {{s[0], s[1], s[2]}, {s[3], s[4], s[5]}}, since(time, times_[index]),
                                  state);
    }

    std::span<const double> states_, times_;
    double gm_ = 0;
};

/// Type 15: a conic whose node and periapsis precess with the oblateness of the centre.
class PrecessingConic final : public SpkData {
public:
    PrecessingConic(const std::string& place, std::span<const double> w) {
        require_values(place, w, 16);
        epoch_s_ = w[0];
        pole_ = {w[1], w[2], w[3]};
        periapsis_ = {w[4], w[5], w[6]};
        parameter_km_ = w[7];
        eccentricity_ = w[8];
        nodes_move_ = w[9] != 2 && w[9] != 3;
        apsides_move_ = w[9] != 1 && w[9] != 3;
        centre_pole_ = {w[10], w[11], w[12]};
        gm_ = w[13];
        j2_ = w[14];
        radius_km_ = w[15];
        if (!(parameter_km_ > 0 && eccentricity_ >= 0 && gm_ > 0 && radius_km_ >= 0))
            throw InputError(fmt::format(
                "{}: semi-latus rectum {} km, eccentricity {}, GM {} km3/s2, radius {} km: allowed above 0",
                place, parameter_km_, eccentricity_, gm_, radius_km_));
        for (Vec3* const axis : {&pole_, &periapsis_, &centre_pole_}) {
            if (!(length(*axis) > 0)) throw InputError(fmt::format("{}: an axis has no length", place));
            *axis = normalized(*axis);
        }
        if (std::abs(dot(pole_, periapsis_)) > 1e-5)
            throw InputError(fmt::format("{}: the periapsis is not in the plane of the orbit", place));
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        const double dt = since(time, epoch_s_);
        const double nearest = parameter_km_ / (1 + eccentricity_);
        const double speed = std::sqrt(gm_ / parameter_km_) * (1 + eccentricity_);
        const StateKm start{nearest * periapsis_, speed * cross(pole_, periapsis_)};
        if (!propagate_two_body(gm_, start, dt, state)) return false;
        if (j2_ == 0 || eccentricity_ >= 1 || nearest <= radius_km_) return true;

        // True anomaly since the epoch, with whole revolutions.
        const double flat = 1 - eccentricity_ * eccentricity_;
        const double mean = flat / parameter_km_ * std::sqrt(gm_ * flat / parameter_km_) * dt;
        const double part = std::remainder(mean, 2 * std::numbers::pi);
        const double angle =
            std::atan2(length(cross(periapsis_, state.position)), dot(periapsis_, state.position));
        const double anomaly = std::copysign(angle, part) + (mean - part);

        const double cos_inclination = dot(centre_pole_, pole_);
        const double ratio = radius_km_ / parameter_km_;
        const double rate = 1.5 * j2_ * ratio * ratio * anomaly;
        const auto precess = [&](Vec3 axis, double by) {
            state = {turned_about(state.position, axis, by), turned_about(state.velocity, axis, by)};
        };
        if (apsides_move_) precess(pole_, rate * (2.5 * cos_inclination * cos_inclination - 0.5));
        if (nodes_move_) precess(centre_pole_, -rate * cos_inclination);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override { return always; }

private:
    double epoch_s_ = 0, parameter_km_ = 0, eccentricity_ = 0, gm_ = 0, j2_ = 0, radius_km_ = 0;
    Vec3 pole_, periapsis_, centre_pole_;
    bool nodes_move_ = true, apsides_move_ = true;
};

/// Type 17.
class EquinoctialOrbit final : public SpkData {
public:
    EquinoctialOrbit(const std::string& place, std::span<const double> w) {
        require_values(place, w, 12);
        epoch_s_ = w[0];
        elements_ = {w[1], w[2], w[3], w[4], w[5], w[6], w[7], w[8], w[9], w[10], w[11]};
        const double eccentricity = std::hypot(elements_.h, elements_.k);
        if (!(elements_.semi_major_axis_km > 0 && eccentricity <= 0.9 && elements_.mean_longitude_rate != 0))
            throw InputError(fmt::format(
                "{}: semi-major axis {} km (allowed above 0), eccentricity {} (at most 0.9), mean motion {} rad/s",
                place, elements_.semi_major_axis_km, eccentricity, elements_.mean_longitude_rate));
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        state = equinoctial_state(elements_, since(time, epoch_s_));
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override { return always; }

private:
    double epoch_s_ = 0;
    EquinoctialElements elements_;
};

} // namespace

std::shared_ptr<const SpkData> make_spk_orbit(const std::string& place, std::int32_t type,
                                              std::span<const double> words) {
    switch (type) {
    case 5:
        return std::make_shared<BlendedOrbits>(place, words);
    case 15:
        return std::make_shared<PrecessingConic>(place, words);
    default:
        return std::make_shared<EquinoctialOrbit>(place, words);
    }
}

} // namespace obscura::ephemeris
