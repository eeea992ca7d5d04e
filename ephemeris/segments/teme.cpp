// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/teme.hpp"

#include <erfa.h>
#include <erfam.h>

#include <cmath>

namespace obscura::ephemeris {

Mat3 teme_to_j2000(TdbTime time) noexcept {
    constexpr double day_s = 86400;
    const double days = time.seconds() / day_s; // TDB for TT: the frame turns by 1e-11 rad/s
    double longitude = 0, obliquity = 0, precession[3][3], nutation[3][3], of_date[3][3];
    eraNut80(ERFA_DJ00, days, &longitude, &obliquity);
    const double mean_obliquity = eraObl80(ERFA_DJ00, days);
    eraPmat76(ERFA_DJ00, days, precession);
    eraNumat(mean_obliquity, longitude, obliquity, nutation);
    eraRxr(nutation, precession, of_date);
    eraRz(longitude * std::cos(mean_obliquity), of_date);
    Mat3 out;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            out.m[i][j] = of_date[j][i];
    return out;
}

StateKm teme_to_j2000(TdbTime time, const StateKm& state) noexcept {
    constexpr double step_s = 600; // the nutation's shortest period is days
    const Mat3 now = teme_to_j2000(time);
    const Vec3 turned =
        teme_to_j2000(time + step_s) * state.position - teme_to_j2000(time + -step_s) * state.position;
    return {now * state.position, now * state.velocity + turned / (2 * step_s)};
}

} // namespace obscura::ephemeris
