// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/segments/segment_data.hpp"

#include "core/error.hpp"
#include "ephemeris/segments/interpolation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::ephemeris {

std::span<const double> ChebyshevRecords::at(TdbTime time, double& x) const noexcept {
    const double position = since(time, first_s) / interval_s;
    const double last = static_cast<double>(count - 1);
    const auto index = static_cast<std::size_t>(std::clamp(std::floor(position), 0.0, last));
    const auto record = words.subspan(index * record_words, record_words);
    // Middle and radius of the record.
    x = since(time, record[0]) / record[1];
    if (!(record[1] > 0) || !(std::abs(x) < 1.1)) return {};
    return record;
}

ChebyshevRecords chebyshev_records(const std::string& place, std::span<const double> words,
                                   std::size_t components) {
    if (words.size() < 4)
        throw InputError(fmt::format("{}: {} values, at least 4 are needed", place, words.size()));
    const std::span<const double> tail = words.last(4);
    ChebyshevRecords r{.words = words, .first_s = tail[0], .interval_s = tail[1]};
    if (!std::isfinite(r.first_s) || !(r.interval_s > 0) || !std::isfinite(r.interval_s))
        throw InputError(
            fmt::format("{}: records start at {} s and last {} s", place, r.first_s, r.interval_s));
    r.record_words = count_in(place, tail[2], words.size(), "values of a record");
    r.count = count_in(place, tail[3], words.size(), "records");
    if (r.record_words < 2 + components || (r.record_words - 2) % components != 0)
        throw InputError(fmt::format("{}: records of {} values, allowed 2 and a multiple of {}", place,
                                     r.record_words, components));
    if (r.count * r.record_words + 4 != words.size())
        throw InputError(fmt::format("{}: {} records of {} values and 4, but {} values", place, r.count,
                                     r.record_words, words.size()));
    return r;
}

std::size_t count_in(const std::string& place, double value, std::size_t most, const char* what) {
    if (!(value >= 1 && value <= static_cast<double>(most)) || value != std::floor(value))
        throw InputError(fmt::format("{}: {} {}, allowed 1 to {}", place, value, what, most));
    return static_cast<std::size_t>(value);
}

void require_increasing(const std::string& place, std::span<const double> times, bool strictly,
                        const char* what) {
    for (std::size_t i = 0; i < times.size(); ++i)
        if (!std::isfinite(times[i]) ||
            (i > 0 && (times[i] < times[i - 1] || (strictly && times[i] == times[i - 1]))))
            throw InputError(fmt::format("{}: {} {} of {} is {:.17g}, not after the one before it", place,
                                         what, i + 1, times.size(), times[i]));
}

void limit_coverage(const std::string& place, double& begin_s, double& end_s, double data_begin_s,
                    double data_end_s) {
    if (!std::isfinite(begin_s) || !std::isfinite(end_s) || begin_s > end_s)
        throw InputError(fmt::format("{}: covers {} to {} s", place, begin_s, end_s));
    begin_s = std::max(begin_s, data_begin_s);
    end_s = std::min(end_s, data_end_s);
    if (begin_s > end_s)
        throw InputError(
            fmt::format("{}: the data, {} to {} s, are outside the interval that the segment covers", place,
                        data_begin_s, data_end_s));
}

} // namespace obscura::ephemeris
