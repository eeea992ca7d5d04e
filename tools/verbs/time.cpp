// SPDX-License-Identifier: Apache-2.0
// Verb `obscura time`: an instant in every time scale.
#include "core/error.hpp"
#include "ephemeris/time/calendar.hpp"
#include "ephemeris/time/time_text.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <ctime>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

using namespace ephemeris;
using Json = nlohmann::ordered_json;

/// Now by the system clock, whose count of seconds leaves leap seconds out.
Epoch now(const LeapSeconds& leap_seconds) {
    timespec t{};
    clock_gettime(CLOCK_REALTIME, &t);
    constexpr std::int64_t day_s = 86'400;
    return epoch_of({t.tv_sec / day_s, t.tv_sec % day_s * ns_per_s + t.tv_nsec}, TimeScale::utc,
                    leap_seconds);
}

/// TAI - UTC at `epoch`, s.
std::string tai_minus_utc(Epoch epoch, const LeapSeconds& leap_seconds) {
    const DayTime utc = reading(epoch, TimeScale::utc, leap_seconds);
    const std::int64_t ns = epoch.tai_ns - (utc.day * ns_per_day + utc.ns);
    return ns % ns_per_s == 0 ? seconds_text(ns, 0) : seconds_text(ns);
}

class TimeVerb final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints an instant in UTC, TAI, TT, TDB and GPS time, as date, Julian date and count";
        line.description =
            "Reads a time in any of these forms: 2007-02-28T12:00:00Z, 2007-059T12:00:00 (day of the year), \"2007 FEB 28 12:00:00.5 TDB\" and other SPICE-like orders, \"JD 2454160.0 TDB\", \"MJD 54159.5\", \"ET 225936065.185\" (seconds of TDB since J2000, the time of SPICE kernels), \"PTP 1172664033\" (seconds of TAI since 1970, the time of a PTP clock), \"GPS 1416 302414\" (week and second), now. "
            "Without a scale (UTC, TAI, TT, TDB, GPS) it is UTC. "
            "Scene files take the same texts as `epoch`. "
            "TT and TDB are computed with ERFA, to the nanosecond; TDB is that of the geocentre. "
            "Leap seconds are those of the system's time zone data, which expire every half year; "
            "after that the next ones are unknown, and the printed line says so.";
        line.positional("TIME", &text_, "The instant (default: now)").required = false;
        line.option("--to", &scale_, "SCALE", "Print the time of this scale only: UTC, TAI, TT, TDB or GPS");
        line.option(
                "--format", &form_, "FORM",
                "With --to: iso (2007-02-28T12:00:00Z), doy (2007-059T12:00:00Z), spice (2007 FEB 28 12:00:00 UTC), jd, mjd, count (PTP, ET or GPS seconds)")
            .choices = names(names_of_enum<TimeForm>());
        line.number("--decimals", &decimals_, "N", "Decimals of a second; Julian dates have five more", 0, 9);
        line.option("--leap-seconds", &leap_second_file_, "FILE",
                    "Leap seconds from this SPICE kernel (LSK) or IERS list, instead of the system's");
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {"obscura time", "obscura time 2007-02-28T12:00:00Z",
                         "obscura time \"JD 2451545.0 TDB\" --to UTC",
                         "obscura time \"2016-12-31T23:59:60.5Z\" --to TAI --format count --json"};
    }

    int run() override {
        if (scale_.empty() && !form_.empty()) throw host::UsageError("obscura time: --format needs --to");
        std::optional<TimeScale> scale;
        if (!scale_.empty()) {
            std::string capitals = scale_;
            std::transform(capitals.begin(), capitals.end(), capitals.begin(),
                           [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
            scale = enum_named<TimeScale>(capitals);
            if (!scale) throw host::UsageError("obscura time: --to: allowed are UTC, TAI, TT, TDB and GPS");
        }
        try {
            leap_seconds_ =
                leap_second_file_.empty() ? system_leap_seconds() : read_leap_seconds(leap_second_file_);
        } catch (const ConfigError& error) {
            throw InputError(error.what());
        }
        try {
            epoch_ = text_ == "now" ? now(leap_seconds_) : read_time(text_, leap_seconds_);
        } catch (const TimeTextError& error) {
            throw host::UsageError(fmt::format("obscura time: {}", error.what()));
        }
        if (scale)
            print_one(*scale);
        else if (json_)
            fmt::print("{}\n", all_json().dump(2));
        else
            print_all();
        return exit_ok;
    }

private:
    static std::vector<std::string> names(const std::vector<std::string_view>& words) {
        return {words.begin(), words.end()};
    }

    [[nodiscard]] std::string text(TimeScale scale, TimeForm form) const {
        return write_time(epoch_, scale, form, leap_seconds_, decimals_);
    }
    /// As text(), or why there is none.
    [[nodiscard]] std::string text_or_reason(TimeScale scale, TimeForm form) const {
        try {
            return text(scale, form);
        } catch (const ConfigError& error) {
            return fmt::format("none: {}", error.what());
        }
    }
    /// As text(), or null.
    [[nodiscard]] Json json_text(TimeScale scale, TimeForm form) const {
        try {
            return text(scale, form);
        } catch (const ConfigError&) {
            return nullptr;
        }
    }

    void print_one(TimeScale scale) const {
        const TimeForm form = form_.empty() ? TimeForm::iso : *enum_named<TimeForm>(form_);
        const std::string one = text(scale, form);
        if (json_)
            fmt::print("{}\n", Json{{"scale", name_of(scale)}, {"time", one}}.dump(2));
        else
            fmt::print("{}\n", one);
    }

    [[nodiscard]] bool expired() const { return is_past_expiry(epoch_, leap_seconds_); }
    [[nodiscard]] std::string expiry() const {
        return leap_seconds_.expires_utc_s ? date_text(*leap_seconds_.expires_utc_s / 86'400) : "";
    }
    [[nodiscard]] bool has_utc() const { return epoch_.tai_ns >= first_utc_day * ns_per_day + 2 * ns_per_s; }

    void print_all() const {
        for (const auto& [scale, name] : enum_names(TimeScale{}))
            fmt::print("{:<8} {}\n", name, text_or_reason(scale, TimeForm::iso));
        fmt::print("{:<8} {}\n", "", text_or_reason(TimeScale::utc, TimeForm::day_of_year));
        for (const TimeScale scale : {TimeScale::utc, TimeScale::tdb})
            for (const TimeForm form : {TimeForm::jd, TimeForm::mjd})
                fmt::print("{:<8} {}\n", "", text_or_reason(scale, form));
        fmt::print("{:<8} {} (s of TDB since J2000, SPICE)\n", "",
                   text_or_reason(TimeScale::tdb, TimeForm::count));
        fmt::print("{:<8} {} (s of TAI since 1970)\n", "", text_or_reason(TimeScale::tai, TimeForm::count));
        fmt::print("{:<8} {}\n", "", text_or_reason(TimeScale::gps, TimeForm::count));
        if (!has_utc()) return;
        fmt::print("{:<8} {} s, leap seconds of {}{}\n", "TAI-UTC", tai_minus_utc(epoch_, leap_seconds_),
                   leap_seconds_.source,
                   !leap_seconds_.expires_utc_s ? ", which states no expiry"
                   : expired()
                       ? fmt::format(", which expired on {}: later leap seconds are unknown", expiry())
                       : fmt::format(", valid to {}", expiry()));
    }

    [[nodiscard]] Json all_json() const {
        Json out;
        for (const auto& [scale, name] : enum_names(TimeScale{})) {
            std::string key(name);
            std::transform(key.begin(), key.end(), key.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
            out[key] = Json{{"iso", json_text(scale, TimeForm::iso)},
                            {"day_of_year", json_text(scale, TimeForm::day_of_year)},
                            {"jd", json_text(scale, TimeForm::jd)},
                            {"mjd", json_text(scale, TimeForm::mjd)}};
        }
        out["et"] = json_text(TimeScale::tdb, TimeForm::count);
        out["ptp"] = json_text(TimeScale::tai, TimeForm::count);
        out["gps_week"] = json_text(TimeScale::gps, TimeForm::count);
        out["tai_ns"] = epoch_.tai_ns;
        out["tai_minus_utc_s"] = has_utc() ? Json(std::stod(tai_minus_utc(epoch_, leap_seconds_))) : Json();
        out["leap_seconds"] = Json{{"source", leap_seconds_.source},
                                   {"expires", leap_seconds_.expires_utc_s ? Json(expiry()) : Json()},
                                   {"expired", expired()}};
        return out;
    }

    std::string text_ = "now", scale_, form_, leap_second_file_;
    std::int32_t decimals_ = 9;
    bool json_ = false;
    LeapSeconds leap_seconds_;
    Epoch epoch_;
};

} // namespace

std::unique_ptr<Verb> make_time() {
    return std::make_unique<TimeVerb>();
}

} // namespace obscura::tools
