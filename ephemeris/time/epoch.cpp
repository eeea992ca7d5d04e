// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/time/epoch.hpp"

#include "core/time.hpp"

#include <erfa.h>

#include <cmath>

namespace obscura::ephemeris {
namespace {

constexpr std::int64_t seconds_per_day = 86'400;
constexpr double j2000_jd = 2451545.0;
/// TAI of J2000 TT less 32.184 s, from 1970-01-01T00:00:00 TAI: 10957.5 days.
constexpr std::int64_t j2000_tai_s = 10957 * seconds_per_day + seconds_per_day / 2;
/// TT - TAI.
constexpr std::int64_t tt_minus_tai_ns = 32'184'000'000;

/// TDB - TT, s, at `tt_s` of TT since J2000.
double tdb_minus_tt(double tt_s) {
    return eraDtdb(j2000_jd, tt_s / static_cast<double>(seconds_per_day), 0, 0, 0, 0);
}

} // namespace

TdbTime TdbTime::operator+(double span_s) const {
    const double whole_span = std::floor(span_s);
    const double part = part_s + (span_s - whole_span);
    const double carry = std::floor(part);
    return {whole_s + whole_span + carry, part - carry};
}

TdbTime to_tdb(Epoch epoch) {
    // Split before the offsets are added: nanoseconds since J2000 do not fit for 1678.
    std::int64_t whole = epoch.tai_ns / ns_per_s - j2000_tai_s;
    std::int64_t part_ns = epoch.tai_ns % ns_per_s;
    if (part_ns < 0) {
        part_ns += ns_per_s;
        --whole;
    }
    const TdbTime tt = TdbTime{static_cast<double>(whole + tt_minus_tai_ns / ns_per_s), 0} +
                       static_cast<double>(part_ns + tt_minus_tai_ns % ns_per_s) * 1e-9;
    return tt + tdb_minus_tt(tt.seconds());
}

Epoch to_epoch(TdbTime tdb) {
    // TDB - TT changes by less than 1e-9 s over itself.
    const TdbTime tt = tdb + -tdb_minus_tt(tdb.seconds());
    const std::int64_t whole_s = static_cast<std::int64_t>(tt.whole_s) + j2000_tai_s;
    return {whole_s * ns_per_s - tt_minus_tai_ns + std::llround(tt.part_s * 1e9)};
}

} // namespace obscura::ephemeris
