// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/spk_segment.hpp"

#include "core/error.hpp"
#include "ephemeris/kernels/interpolation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

namespace obscura::ephemeris {
namespace {

constexpr double m_per_km = 1000;
constexpr std::size_t state_words = 6;

/// Method of an SPK type that is not supported (SPK Required Reading).
const char* method_of(std::int32_t type) {
    switch (type) {
    case 5:
        return "two-body";
    case 8:
        return "Lagrange, equal steps";
    case 10:
        return "two-line elements";
    case 12:
        return "Hermite, equal steps";
    case 14:
        return "Chebyshev, unequal steps";
    case 15:
        return "precessing conic";
    case 17:
        return "equinoctial elements";
    case 18:
        return "ESOC/DDID Hermite or Lagrange";
    case 19:
        return "ESOC/DDID piecewise";
    case 20:
        return "Chebyshev, velocity only";
    default:
        return "unknown";
    }
}

} // namespace

SpkSegment::SpkSegment(const Daf::Array& array)
    : place_(array.place),
      words_(array.words),
      target_(array.integers.at(0)),
      center_(array.integers.at(1)),
      frame_(array.integers.at(2)),
      type_(array.integers.at(3)),
      begin_s_(array.doubles.at(0)),
      end_s_(array.doubles.at(1)) {
    if (target_ == center_) throw InputError(fmt::format("{}: body {} relative to itself", place_, target_));
    switch (type_) {
    case 1:
    case 21:
        read_differences();
        break;
    case 2:
    case 3:
        read_chebyshev();
        break;
    case 9:
    case 13:
        read_samples();
        break;
    default:
        throw InputError(fmt::format("{}: SPK type {} ({}) is not supported, allowed 1, 2, 3, 9, 13, 21",
                                     place_, type_, method_of(type_)));
    }
}

void SpkSegment::read_chebyshev() {
    records_ = chebyshev_records(place_, words_, type_ == 2 ? 3 : 6);
    limit_coverage(place_, begin_s_, end_s_, records_.first_s,
                   records_.first_s + records_.interval_s * static_cast<double>(records_.count));
}

void SpkSegment::read_differences() {
    // At the end: type 1 the number of records; type 21 the orders of a difference line before it.
    const std::size_t tail = type_ == 1 ? 1 : 2;
    if (words_.size() <= tail) throw InputError(fmt::format("{}: {} values", place_, words_.size()));
    const std::size_t count = count_in(place_, words_.back(), words_.size(), "records");
    differences_ = type_ == 1 ? 15
                              : count_in(place_, words_[words_.size() - 2], max_differences,
                                         "orders of a difference line");
    record_words_ = 4 * differences_ + 11;
    // Both types have a directory of every hundredth time, also where the last time is one.
    if (count * (record_words_ + 1) + count / 100 + tail != words_.size())
        throw InputError(fmt::format("{}: {} difference lines of {} values do not fit into {} values", place_,
                                     count, record_words_, words_.size()));
    times_ = words_.subspan(count * record_words_, count);
    require_increasing(place_, times_, true, "time");
    limit_coverage(place_, begin_s_, end_s_, -std::numeric_limits<double>::infinity(), times_.back());
}

void SpkSegment::read_samples() {
    if (words_.size() < 2) throw InputError(fmt::format("{}: {} values", place_, words_.size()));
    const std::size_t count = count_in(place_, words_.back(), words_.size(), "states");
    // Type 9 has the degree of the polynomial, type 13 the number of states less one: the same here.
    window_ = count_in(place_, words_[words_.size() - 2], max_samples - 1, "as degree of interpolation") + 1;
    if (count * (state_words + 1) + directory_size(count) + 2 != words_.size())
        throw InputError(
            fmt::format("{}: {} states do not fit into {} values", place_, count, words_.size()));
    window_ = std::min(window_, count);
    times_ = words_.subspan(count * state_words, count);
    require_increasing(place_, times_, true, "time");
    limit_coverage(place_, begin_s_, end_s_, times_.front(), times_.back());
}

bool SpkSegment::evaluate(TdbTime time, State& state) const noexcept {
    State km;
    const bool good = type_ == 2 || type_ == 3    ? chebyshev_state(time, km)
                      : type_ == 1 || type_ == 21 ? difference_state(time, km)
                                                  : sampled_state(time, km);
    state = {km.position_m * m_per_km, km.velocity_m_s * m_per_km};
    return good && is_finite(state.position_m) && is_finite(state.velocity_m_s);
}

bool SpkSegment::chebyshev_state(TdbTime time, State& km) const noexcept {
    double x = 0;
    const std::span<const double> record = records_.at(time, x);
    if (record.empty()) return false;
    const std::size_t components = type_ == 2 ? 3 : 6;
    const std::size_t n = (record.size() - 2) / components;
    std::array<ValueAndRate, 6> series;
    for (std::size_t i = 0; i < components; ++i)
        series[i] = chebyshev(record.subspan(2 + i * n, n), x);
    km.position_m = {series[0].value, series[1].value, series[2].value};
    km.velocity_m_s = type_ == 2 ? Vec3{series[0].rate, series[1].rate, series[2].rate} / record[1]
                                 : Vec3{series[3].value, series[4].value, series[5].value};
    return true;
}

bool SpkSegment::difference_state(TdbTime time, State& km) const noexcept {
    // A record holds up to its time, from that of the one before it.
    const auto after = std::lower_bound(times_.begin(), times_.end(), time.seconds());
    const auto index = std::min(static_cast<std::size_t>(after - times_.begin()), times_.size() - 1);
    ValueAndRate axes[3];
    if (!difference_line(words_.subspan(index * record_words_, record_words_), differences_, time, axes))
        return false;
    km.position_m = {axes[0].value, axes[1].value, axes[2].value};
    km.velocity_m_s = {axes[0].rate, axes[1].rate, axes[2].rate};
    return true;
}

bool SpkSegment::sampled_state(TdbTime time, State& km) const noexcept {
    // Odd windows are centred on the nearest sample, even ones on the interval.
    const double t = time.seconds();
    const auto after =
        static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), t) - times_.begin());
    const std::size_t low = after == 0 ? 0 : after - 1;
    std::size_t middle = low;
    if (window_ % 2 == 1 && after < times_.size() && times_[after] - t < t - times_[low]) middle = after;
    const std::size_t before = (window_ - 1) / 2;
    const std::size_t first = std::min(middle < before ? 0 : middle - before, times_.size() - window_);

    std::array<double, max_samples> x, values, rates;
    for (std::size_t i = 0; i < window_; ++i)
        x[i] = -since(time, times_[first + i]);
    const std::span<const double> nodes = std::span(x).first(window_);
    const auto sample = [&](std::size_t component, std::array<double, max_samples>& out) {
        for (std::size_t i = 0; i < window_; ++i)
            out[i] = words_[(first + i) * state_words + component];
        return std::span<const double>(out).first(window_);
    };
    std::array<double, 3> position{}, velocity{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto p = sample(axis, values);
        const auto v = sample(axis + 3, rates);
        if (type_ == 9) {
            position[axis] = lagrange(nodes, p).value;
            velocity[axis] = lagrange(nodes, v).value;
        } else {
            const ValueAndRate both = hermite(nodes, p, v);
            position[axis] = both.value;
            velocity[axis] = both.rate;
        }
    }
    km.position_m = {position[0], position[1], position[2]};
    km.velocity_m_s = {velocity[0], velocity[1], velocity[2]};
    return true;
}

} // namespace obscura::ephemeris
