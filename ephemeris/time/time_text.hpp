// SPDX-License-Identifier: Apache-2.0
// Times as text: ISO 8601, SPICE-like calendar strings, Julian dates and counts of seconds, read and written.
#pragma once

#include "core/error.hpp"
#include "core/text/enum_names.hpp"
#include "ephemeris/time/time_scale.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace obscura::ephemeris {

/// A text that is no time: what() names the text, the character (from 1), the cause and what is allowed.
class TimeTextError : public ConfigError {
public:
    TimeTextError(std::string_view text, std::size_t at, std::string_view what);
    /// Index of the character, from 0.
    [[nodiscard]] std::size_t at() const noexcept { return at_; }

private:
    std::size_t at_;
};

/// Forms that read_time() takes, for help texts.
inline constexpr const char* time_forms =
    "\"2007-02-28T12:00:00Z\", \"2007-059T12:00:00\", \"2007 FEB 28 12:00:00.5 TDB\", \"JD 2454160.0 TDB\", \"MJD 54159.5\", \"ET 225936065.18\" (s of TDB since J2000), \"PTP 1172664033\" (s of TAI since 1970), \"GPS 1416 302414\" (week, s)";

/// Reads a time, to the nanosecond. Forms, of any case:
/// - `2007-02-28`, `2007-02-28T12:00[:00[.0...]]`, T or spaces before the time of day; `2007-059...` with the
///   day of the year; after them Z, an offset from UTC like +02:00, or a scale: UTC, TAI, TT (TDT), TDB (ET)
///   or GPS
/// - `2007 FEB 28 12:00:00`, `28 FEB 2007 ...`, `FEB 28, 2007 ...`, with spaces or "-" between
/// - `JD 2454160.0 [scale]`, `MJD 54159.5 [scale]`; JDUTC, JDTDB, JDTDT as in SPICE. A fraction of a UTC day
///   with a leap second is a fraction of 86401 s, as in ERFA
/// - `ET s`, `PTP s`, `GPS week s`
/// Without a scale the reading is in `scale`. Second 60 is allowed in a leap second of UTC. 1678 to 2261; UTC
/// from 1960 on. Throws TimeTextError; the text is untrusted.
[[nodiscard]] Epoch read_time(std::string_view text, const LeapSeconds& leap_seconds,
                              TimeScale scale = TimeScale::utc);

/// Form of a time that is written.
enum class TimeForm : std::uint8_t {
    iso,         ///< 2007-02-28T12:00:00Z, or with " TDB"
    day_of_year, ///< 2007-059T12:00:00Z
    spice,       ///< 2007 FEB 28 12:00:00 UTC
    jd,          ///< JD 2454160.0 UTC
    mjd,         ///< MJD 54159.5 UTC
    count,       ///< TAI: PTP s; TDB: ET s; GPS: GPS week s
};
constexpr auto enum_names(TimeForm /*type*/) {
    return std::array{EnumName{TimeForm::iso, "iso"},     EnumName{TimeForm::day_of_year, "doy"},
                      EnumName{TimeForm::spice, "spice"}, EnumName{TimeForm::jd, "jd"},
                      EnumName{TimeForm::mjd, "mjd"},     EnumName{TimeForm::count, "count"}};
}

/// Writes `epoch` in a form that read_time() takes. `decimals` (0 to 9) of a second, to the nearest; Julian
/// dates have five digits more. Throws ConfigError for UTC before 1960, for TimeForm::count of UTC or TT, and
/// for counts of GPS before its first week.
[[nodiscard]] std::string write_time(Epoch epoch, TimeScale scale, TimeForm form,
                                     const LeapSeconds& leap_seconds, int decimals = 9);

/// Nanoseconds as seconds with `decimals` digits, rounded down.
[[nodiscard]] std::string seconds_text(std::int64_t ns, int decimals = 9);

} // namespace obscura::ephemeris
