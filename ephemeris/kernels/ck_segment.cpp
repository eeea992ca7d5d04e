// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/ck_segment.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::ephemeris {
namespace {

/// A time is known to half a tick.
constexpr double resolution = 0.5;

/// Covered tick that is nearest to `ticks`; NaN: there is none.
double covered_tick(std::span<const Interval> covered, double ticks) noexcept {
    const auto after = std::lower_bound(covered.begin(), covered.end(), ticks,
                                        [](const Interval& i, double t) { return i.end_s < t; });
    double nearest = std::numeric_limits<double>::quiet_NaN();
    if (after != covered.end()) nearest = std::max(after->begin_s, ticks);
    if (after != covered.begin())
        if (const double end = (after - 1)->end_s; !(nearest - ticks <= ticks - end)) nearest = end;
    return nearest;
}

} // namespace

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
    const std::vector<Interval> known = data_->coverage();
    limit_coverage(place_, begin_, end_, known.front().begin_s, known.back().end_s);
    for (const Interval& own : known) {
        const Interval interval{std::max(own.begin_s, begin_), std::min(own.end_s, end_)};
        if (interval.begin_s <= interval.end_s) covered_.push_back(interval);
    }
}

Evaluation CkSegment::orientation(double ticks, Quat& to_base) const noexcept {
    if (!(ticks >= begin_ - resolution && ticks <= end_ + resolution)) return Evaluation::no_coverage;
    Quat from_base;
    Evaluation status = data_->attitude(std::clamp(ticks, begin_, end_), from_base);
    if (status == Evaluation::no_coverage)
        if (const double beside = covered_tick(covered_, ticks); std::abs(beside - ticks) <= resolution)
            status = data_->attitude(beside, from_base);
    if (status != Evaluation::ok) return status;
    if (!(norm(from_base) > 0) || !std::isfinite(norm(from_base))) return Evaluation::damaged;
    to_base = normalized(conjugate(from_base));
    return Evaluation::ok;
}

} // namespace obscura::ephemeris
