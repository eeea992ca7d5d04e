// SPDX-License-Identifier: Apache-2.0
// SPK type 10: two-line elements, each good around its epoch.
#include "core/error.hpp"
#include "ephemeris/segments/generic_segment.hpp"
#include "ephemeris/segments/interpolation.hpp"
#include "ephemeris/segments/sgp4.hpp"
#include "ephemeris/segments/spk_data.hpp"
#include "ephemeris/segments/teme.hpp"
#include "ephemeris/time/leap_seconds.hpp"
#include "ephemeris/time/time_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace obscura::ephemeris {
namespace {

/// UTC as days since 1949-12-31; before 1960, when there was none, a constant offset from TDB.
double utc_days(double tdb_s, const LeapSeconds& leap_seconds) {
    constexpr double day_s = 86400, days_to_1970 = 7306, j2000_days = 18263.5, before_utc_s = 32;
    if (tdb_s < (first_utc_day - 10957 + 1) * day_s) return (tdb_s - before_utc_s) / day_s + j2000_days;
    const DayTime utc = reading(to_epoch(TdbTime{} + tdb_s), TimeScale::utc, leap_seconds);
    return static_cast<double>(utc.day) + days_to_1970 + static_cast<double>(utc.ns) / (day_s * 1e9);
}

/// Between two epochs the orbits of both, blended by a cosine; outside that of the nearest.
class TwoLineOrbits final : public SpkData {
public:
    TwoLineOrbits(const std::string& place, std::span<const double> words) : segment_(place, words) {
        const std::span<const double> c = segment_.constants();
        if (c.size() != 8) throw InputError(fmt::format("{}: {} constants, allowed 8", place, c.size()));
        constants_ = {c[0], c[1], c[2], c[3], c[4], c[5], c[6]};
        if (!(constants_.ke > 0 && constants_.radius_km > 0 && constants_.j2 > 0 && c[7] == 1) ||
            !std::all_of(c.begin(), c.end(), [](double v) { return std::isfinite(v); }))
            throw InputError(
                fmt::format("{}: J2 {}, KE {}, radius {} km (allowed above 0), AE {} (allowed 1)", place,
                            constants_.j2, constants_.ke, constants_.radius_km, c[7]));
        const LeapSeconds leap_seconds = erfa_leap_seconds();
        for (std::size_t i = 0; i < segment_.size(); ++i) {
            const std::span<const double> p = segment_.packet(i);
            constexpr double max_s = 7e9; // nanoseconds of a year beyond do not fit
            if (p.size() < packet_words ||
                !std::all_of(p.begin(), p.end(), [](double v) { return std::isfinite(v); }) ||
                !(p[eccentricity] >= 0 && p[eccentricity] < 1 && p[mean_motion] > 0) ||
                !(std::abs(p[epoch]) < max_s) || p[epoch] != segment_.references()[i])
                throw InputError(fmt::format("{}: packet {} of {} values holds no two-line elements", place,
                                             i + 1, p.size()));
            epoch_days_.push_back(utc_days(p[epoch], leap_seconds));
        }
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        const std::span<const double> epochs = segment_.references();
        const auto after = static_cast<std::size_t>(
            std::upper_bound(epochs.begin(), epochs.end(), time.seconds()) - epochs.begin());
        StateKm teme;
        if (after == 0 || after == epochs.size()) {
            if (!at(after == 0 ? 0 : after - 1, time, teme)) return false;
        } else {
            StateKm early, late;
            if (!at(after - 1, time, early) || !at(after, time, late)) return false;
            teme = blended_states(early, late, since(time, epochs[after - 1]),
                                  epochs[after] - epochs[after - 1]);
        }
        // The packets' nutation is that of the IAU of 1980 at their epochs, which is evaluated at the time
        // itself instead, as SPICE does since N64.
        state = teme_to_j2000(time, teme);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override {
        return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    }

private:
    /// Words of a packet; two derivatives of the mean motion before, that SGP4 does not use, and two angles
    /// of nutation with their rates behind.
    enum Word : std::size_t {
        bstar = 2,
        inclination,
        node,
        eccentricity,
        perigee,
        anomaly,
        mean_motion,
        epoch,
        packet_words = 14
    };

    [[nodiscard]] bool at(std::size_t index, TdbTime time, StateKm& teme) const noexcept {
        const std::span<const double> p = segment_.packet(index);
        constexpr double s_per_min = 60;
        const Sgp4 orbit(constants_, {p[bstar], p[inclination], p[node], p[eccentricity], p[perigee],
                                      p[anomaly], p[mean_motion], epoch_days_[index]});
        return orbit.propagate(since(time, p[epoch]) / s_per_min, teme);
    }

    GenericSegment segment_;
    Sgp4Constants constants_;
    std::vector<double> epoch_days_;
};

} // namespace

std::shared_ptr<const SpkData> make_spk_two_line(const std::string& place, std::span<const double> words) {
    return std::make_shared<TwoLineOrbits>(place, words);
}

} // namespace obscura::ephemeris
