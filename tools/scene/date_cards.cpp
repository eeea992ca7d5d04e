// SPDX-License-Identifier: Apache-2.0
#include "tools/scene/date_cards.hpp"

#include "core/error.hpp"
#include "core/text/number.hpp"
#include "ephemeris/time/leap_seconds.hpp"
#include "ephemeris/time/time_scale.hpp"
#include "ephemeris/time/time_text.hpp"

#include <cmath>
#include <string>
#include <string_view>

namespace obscura::tools {
namespace {

using ephemeris::Epoch;
using ephemeris::TimeForm;
using ephemeris::TimeScale;

/// "2026-01-01T00:00:10.5": FITS has the scale in a card of its own, and no zeros are needed at the end.
std::string fits_date(std::string text) {
    text.erase(text.find_first_of("Z "), std::string::npos);
    if (text.find('.') != std::string::npos) {
        text.erase(text.find_last_not_of('0') + 1);
        if (text.back() == '.') text.pop_back();
    }
    return text;
}

/// The number of "MJD 61041.5 UTC".
double number_of(std::string_view mjd) {
    const std::size_t first = mjd.find(' ') + 1;
    return decimal_number(mjd.substr(first, mjd.find(' ', first) - first)).value_or(std::nan(""));
}

} // namespace

images::Cards date_cards(const std::optional<Epoch>& epoch, double start_s, double middle_s) {
    if (!epoch) return {};
    const ephemeris::LeapSeconds leap_seconds = ephemeris::system_leap_seconds();
    const auto cards = [&](TimeScale scale, const char* name) {
        images::Cards out{{"TIMESYS", std::string(name), "scale of the dates"}};
        const auto add = [&](const char* what, double seconds, const char* of) {
            const Epoch at{epoch->tai_ns + std::llround(seconds * 1e9)};
            const std::string comment(of);
            out.push_back({std::string("DATE-") + what,
                           fits_date(ephemeris::write_time(at, scale, TimeForm::iso, leap_seconds)),
                           comment + " of the exposure"});
            out.push_back({std::string("MJD-") + what,
                           number_of(ephemeris::write_time(at, scale, TimeForm::mjd, leap_seconds)),
                           "[d] " + comment + " of the exposure"});
        };
        add("OBS", start_s, "start");
        add("AVG", middle_s, "middle");
        return out;
    };
    try {
        return cards(TimeScale::utc, "UTC");
    } catch (const ConfigError&) {
        return cards(TimeScale::tt, "TT"); // there was no UTC
    }
}

} // namespace obscura::tools
