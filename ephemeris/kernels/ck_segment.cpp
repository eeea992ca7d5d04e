// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/ck_segment.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::ephemeris {

std::shared_ptr<const CkData> make_ck_data(const std::string& place, std::int32_t type, bool rates,
                                           std::span<const double> words) {
    if (type >= 1 && type <= 3) return make_ck_attitudes(place, type, rates, words);
    if (type >= 4 && type <= 6) return make_ck_polynomials(place, type, words);
    throw InputError(fmt::format("{}: CK type {} is not supported, allowed 1 to 6", place, type));
}

CkSegment::CkSegment(const Daf::Array& array)
    : place_(array.place),
      instrument_(array.integers.at(0)),
      base_(array.integers.at(1)),
      begin_(array.doubles.at(0)),
      end_(array.doubles.at(1)),
      data_(make_ck_data(place_, array.integers.at(2), array.integers.at(3) != 0, array.words)) {
    const std::vector<Interval> covered = data_->coverage();
    limit_coverage(place_, begin_, end_, covered.front().begin_s, covered.back().end_s);
}

std::vector<Interval> CkSegment::coverage() const {
    std::vector<Interval> covered;
    for (const Interval& own : data_->coverage()) {
        const Interval interval{std::max(own.begin_s, begin_), std::min(own.end_s, end_)};
        if (interval.begin_s <= interval.end_s) covered.push_back(interval);
    }
    return covered;
}

Evaluation CkSegment::orientation(double ticks, Quat& to_base) const noexcept {
    // A time is known to half a tick.
    if (!(ticks >= begin_ - 0.5 && ticks <= end_ + 0.5)) return Evaluation::no_coverage;
    Quat from_base;
    const Evaluation status = data_->attitude(std::clamp(ticks, begin_, end_), from_base);
    if (status != Evaluation::ok) return status;
    if (!(norm(from_base) > 0) || !std::isfinite(norm(from_base))) return Evaluation::damaged;
    to_base = normalized(conjugate(from_base));
    return Evaluation::ok;
}

} // namespace obscura::ephemeris
