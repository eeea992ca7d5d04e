// SPDX-License-Identifier: Apache-2.0
// SPK types 2, 3, 14 and 20: Chebyshev series.
#include "core/error.hpp"
#include "ephemeris/segments/generic_segment.hpp"
#include "ephemeris/segments/interpolation.hpp"
#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/segments/spk_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::ephemeris {
namespace {

constexpr double day_of_series_s = 86400, series_j2000_jd = 2451545.0;

/// Series of position (3 components) or of position and velocity (6) at `x` of a record whose radius is
/// `radius_s`.
StateKm series_state(std::span<const double> coefficients, std::size_t components, double x,
                     double radius_s) noexcept {
    const std::size_t n = coefficients.size() / components;
    std::array<ValueAndRate, 6> series;
    for (std::size_t i = 0; i < components; ++i)
        series[i] = chebyshev(coefficients.subspan(i * n, n), x);
    return {{series[0].value, series[1].value, series[2].value},
            components == 3 ? Vec3{series[0].rate, series[1].rate, series[2].rate} / radius_s
                            : Vec3{series[3].value, series[4].value, series[5].value}};
}

/// Types 2 and 3: records of equal length.
class EqualRecords final : public SpkData {
public:
    EqualRecords(const std::string& place, std::span<const double> words, std::size_t components)
        : records_(chebyshev_records(place, words, components)), components_(components) {}

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        double x = 0;
        const std::span<const double> record = records_.at(time, x);
        if (record.empty()) return false;
        state = series_state(record.subspan(2), components_, x, record[1]);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override {
        return {records_.first_s,
                records_.first_s + records_.interval_s * static_cast<double>(records_.count)};
    }

private:
    ChebyshevRecords records_;
    std::size_t components_;
};

/// Type 14: records of any length.
class UnequalRecords final : public SpkData {
public:
    UnequalRecords(const std::string& place, std::span<const double> words) : segment_(place, words) {
        for (std::size_t i = 0; i < segment_.size(); ++i) {
            const std::span<const double> packet = segment_.packet(i);
            if (packet.size() < 8 || (packet.size() - 2) % 6 != 0)
                throw InputError(fmt::format("{}: packet {} of {} values, allowed 2 and a multiple of 6",
                                             place, i + 1, packet.size()));
            if (!(packet[1] > 0) || !std::isfinite(packet[0]) || !std::isfinite(packet[1]))
                throw InputError(
                    fmt::format("{}: packet {}: middle {}, radius {}", place, i + 1, packet[0], packet[1]));
        }
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        const std::span<const double> starts = segment_.references();
        const auto after = std::upper_bound(starts.begin(), starts.end(), time.seconds());
        const std::span<const double> packet = segment_.packet(
            after == starts.begin() ? 0 : static_cast<std::size_t>(after - starts.begin()) - 1);
        const double x = since(time, packet[0]) / packet[1];
        if (!(std::abs(x) < 1.1)) return false;
        state = series_state(packet.subspan(2), 6, x, packet[1]);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override {
        const std::span<const double> last = segment_.packet(segment_.size() - 1);
        return {segment_.references().front(), last[0] + last[1]};
    }

private:
    GenericSegment segment_;
};

/// Type 20: series of velocity, and the position in the middle of each record.
class VelocityRecords final : public SpkData {
public:
    VelocityRecords(const std::string& place, std::span<const double> words) : words_(words) {
        // At the end: units of distance, km, and time, s; start as Julian date and fraction; days of a
        // record; its values; records.
        constexpr std::size_t tail_words = 7;
        if (words.size() <= tail_words)
            throw InputError(
                fmt::format("{}: {} values, more than {} are needed", place, words.size(), tail_words));
        const std::span<const double> tail = words.last(tail_words);
        for (const double value : tail)
            if (!std::isfinite(value)) throw InputError(fmt::format("{}: {} at its end", place, value));
        distance_km_ = tail[0];
        speed_km_s_ = tail[0] / tail[1];
        first_day_ = tail[2] - series_j2000_jd;
        first_fraction_ = tail[3];
        days_ = tail[4];
        if (!(tail[0] > 0 && tail[1] > 0 && days_ > 0))
            throw InputError(fmt::format("{}: units of {} km and {} s, records of {} days: allowed above 0",
                                         place, tail[0], tail[1], days_));
        record_words_ = count_in(place, tail[5], words.size(), "values of a record");
        count_ = count_in(place, tail[6], words.size(), "records");
        if (record_words_ % 3 != 0 || record_words_ < 6 || record_words_ / 3 > max_integrated)
            throw InputError(fmt::format("{}: records of {} values, allowed multiples of 3 from 6 to {}",
                                         place, record_words_, 3 * max_integrated));
        if (count_ * record_words_ + tail_words != words.size())
            throw InputError(fmt::format("{}: {} records of {} values and {}, but {} values", place, count_,
                                         record_words_, tail_words, words.size()));
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        const double last = static_cast<double>(count_ - 1);
        const double position = since(time, reach().begin_s) / (days_ * day_of_series_s);
        const double index = std::clamp(std::floor(position), 0.0, last);
        const double radius_s = days_ * day_of_series_s / 2;
        const double start_s =
            (first_day_ + index * days_) * day_of_series_s + first_fraction_ * day_of_series_s;
        const double x = since(time, start_s + radius_s) / radius_s;
        if (!(std::abs(x) < 1.1)) return false;
        const auto record = words_.subspan(static_cast<std::size_t>(index) * record_words_, record_words_);
        const std::size_t n = record_words_ / 3 - 1;
        std::array<double, 3> place{}, speed{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto series = record.subspan(axis * (n + 1), n);
            speed[axis] = chebyshev(series, x).value * speed_km_s_;
            place[axis] = record[axis * (n + 1) + n] * distance_km_ +
                          chebyshev_integral(series, x) * speed_km_s_ * radius_s;
        }
        state = {{place[0], place[1], place[2]}, {speed[0], speed[1], speed[2]}};
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override {
        const double begin = first_day_ * day_of_series_s + first_fraction_ * day_of_series_s;
        return {begin, begin + days_ * day_of_series_s * static_cast<double>(count_)};
    }

private:
    std::span<const double> words_;
    double distance_km_ = 1, speed_km_s_ = 1, first_day_ = 0, first_fraction_ = 0, days_ = 1;
    std::size_t record_words_ = 0, count_ = 0;
};

} // namespace

std::shared_ptr<const SpkData> make_spk_series(const std::string& place, std::int32_t type,
                                               std::span<const double> words) {
    switch (type) {
    case 2:
        return std::make_shared<EqualRecords>(place, words, 3);
    case 3:
        return std::make_shared<EqualRecords>(place, words, 6);
    case 14:
        return std::make_shared<UnequalRecords>(place, words);
    default:
        return std::make_shared<VelocityRecords>(place, words);
    }
}

} // namespace obscura::ephemeris
