// SPDX-License-Identifier: Apache-2.0
// Spacecraft clocks (SCLK type 1) and attitudes (CK type 3).
#include "core/error.hpp"
#include "ephemeris/kernels/frame_model.hpp"
#include "ephemeris/kernels/interpolation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace obscura::ephemeris {
namespace {

/// TDB - TT by the formula of SPICE's leap second kernels (DELTET/K, EB, M), s. The clocks of type 1 that
/// refer to TT were correlated with it.
double approximate_tdb_minus_tt(double tdb_s) {
    const double m = 6.239996 + 1.99096871e-7 * tdb_s;
    return 1.657e-3 * std::sin(m + 1.671e-2 * std::sin(m));
}

class CkFrame final : public FrameModel {
public:
    CkFrame(std::vector<BasedCkSegment> segments, SpacecraftClock clock)
        : segments_(std::move(segments)), clock_(std::move(clock)) {}

    [[nodiscard]] Evaluation orientation(TdbTime time, Quat& to_icrf) const noexcept override {
        const double ticks = clock_.ticks(time);
        for (const BasedCkSegment& s : segments_) {
            Quat to_base;
            const Evaluation status = s.segment->orientation(ticks, to_base);
            if (status == Evaluation::no_coverage) continue;
            if (status != Evaluation::ok) return status;
            to_icrf = to_base;
            if (s.base == nullptr) return Evaluation::ok;
            Quat outer;
            const Evaluation outer_status = s.base->orientation(time, outer);
            to_icrf = outer * to_base;
            return outer_status;
        }
        return segments_.empty() ? Evaluation::no_data : Evaluation::no_coverage;
    }

private:
    std::vector<BasedCkSegment> segments_;
    SpacecraftClock clock_;
};

/// Method of a CK type that is not supported (CK Required Reading).
const char* attitude_method(std::int32_t type) {
    switch (type) {
    case 1:
        return "discrete";
    case 2:
        return "constant rates";
    case 4:
        return "Chebyshev";
    case 5:
        return "MEX/Rosetta attitude";
    case 6:
        return "ESOC/DDID piecewise";
    default:
        return "unknown";
    }
}

} // namespace

std::shared_ptr<const FrameModel> make_ck_frame(std::vector<BasedCkSegment> segments, SpacecraftClock clock) {
    return std::make_shared<CkFrame>(std::move(segments), std::move(clock));
}

SpacecraftClock::SpacecraftClock(const KernelPool& pool, int id) {
    const auto name = [&](const char* what) {
        return fmt::format("{}_{}", what, -static_cast<std::int64_t>(id));
    };
    const auto type = pool.integer(name("SCLK_DATA_TYPE"));
    if (!type)
        throw InputError(fmt::format("spacecraft clock {}: no SCLK kernel that has it ({}) is loaded", id,
                                     name("SCLK_DATA_TYPE")));
    const std::string& place = pool.find(name("SCLK_DATA_TYPE"))->place;
    if (*type != 1) throw InputError(fmt::format("{}: clock of type {}, allowed 1", place, *type));
    const int system = pool.integer(name("SCLK01_TIME_SYSTEM")).value_or(1);
    if (system != 1 && system != 2)
        throw InputError(fmt::format("{}: time system {} ({}), allowed 1 (TDB), 2 (TT)", place, system,
                                     name("SCLK01_TIME_SYSTEM")));
    tt_ = system == 2;
    const auto moduli = pool.numbers(name("SCLK01_MODULI"), 1, 10);
    const auto triples = pool.numbers(name("SCLK01_COEFFICIENTS"), 3, 3'000'000);
    if (moduli.empty() || triples.empty())
        throw InputError(fmt::format("{}: {} and {} are needed with it", place, name("SCLK01_MODULI"),
                                     name("SCLK01_COEFFICIENTS")));
    double ticks_per_count = 1;
    for (std::size_t i = 1; i < moduli.size(); ++i)
        ticks_per_count *= moduli[i];
    const std::string& table = pool.find(name("SCLK01_COEFFICIENTS"))->place;
    if (triples.size() % 3 != 0)
        throw InputError(fmt::format("{}: {} values, a multiple of 3 is expected", table, triples.size()));
    for (std::size_t i = 0; i < triples.size(); i += 3) {
        const Correlation c{triples[i], triples[i + 1], triples[i + 2] / ticks_per_count};
        if (!(c.seconds_per_tick > 0) || !std::isfinite(c.seconds_per_tick) ||
            (!correlations_.empty() &&
             (c.ticks <= correlations_.back().ticks || c.parallel_s <= correlations_.back().parallel_s)))
            throw InputError(fmt::format(
                "{}: correlation {}: ticks {}, time {} s, rate {}: times must increase, rates be above 0",
                table, i / 3 + 1, c.ticks, c.parallel_s, triples[i + 2]));
        correlations_.push_back(c);
    }
}

double SpacecraftClock::ticks(TdbTime time) const noexcept {
    const double offset = tt_ ? approximate_tdb_minus_tt(time.seconds()) : 0;
    const double parallel = time.seconds() - offset;
    const auto after = std::upper_bound(correlations_.begin(), correlations_.end(), parallel,
                                        [](double t, const Correlation& c) { return t < c.parallel_s; });
    if (after == correlations_.begin()) return std::numeric_limits<double>::quiet_NaN();
    const Correlation& c = *(after - 1);
    return c.ticks + (since(time, c.parallel_s) - offset) / c.seconds_per_tick;
}

double SpacecraftClock::tdb_s(double ticks) const noexcept {
    auto after = std::upper_bound(correlations_.begin(), correlations_.end(), ticks,
                                  [](double t, const Correlation& c) { return t < c.ticks; });
    if (after == correlations_.begin()) ++after;
    const Correlation& c = *(after - 1);
    const double parallel = c.parallel_s + (ticks - c.ticks) * c.seconds_per_tick;
    return tt_ ? parallel + approximate_tdb_minus_tt(parallel) : parallel;
}

CkSegment::CkSegment(const Daf::Array& array)
    : place_(array.place),
      instrument_(array.integers.at(0)),
      base_(array.integers.at(1)),
      begin_(array.doubles.at(0)),
      end_(array.doubles.at(1)) {
    const std::int32_t type = array.integers.at(2);
    if (type != 3)
        throw InputError(fmt::format("{}: CK type {} ({}) is not supported, allowed 3", place_, type,
                                     attitude_method(type)));
    const std::span<const double> words = array.words;
    if (words.size() < 2) throw InputError(fmt::format("{}: {} values", place_, words.size()));
    // Quaternions, with rates if the flag is set; times and directory; starts of intervals and directory;
    // counts.
    sample_words_ = array.integers.at(3) == 0 ? 4 : 7;
    const std::size_t count = count_in(place_, words.back(), words.size(), "attitudes");
    const std::size_t intervals = count_in(place_, words[words.size() - 2], count, "intervals");
    const std::size_t times_at = count * sample_words_;
    const std::size_t starts_at = times_at + count + directory_size(count);
    if (starts_at + intervals + directory_size(intervals) + 2 != words.size())
        throw InputError(fmt::format("{}: {} attitudes in {} intervals do not fit into {} values", place_,
                                     count, intervals, words.size()));
    samples_ = words.first(times_at);
    times_ = words.subspan(times_at, count);
    starts_ = words.subspan(starts_at, intervals);
    require_increasing(place_, times_, true, "time");
    require_increasing(place_, starts_, true, "interval");
    if (starts_.front() > times_.front())
        throw InputError(fmt::format("{}: the first interval starts after the first attitude", place_));
    for (std::size_t i = 0; i < count; ++i) {
        const double size = norm(sample(i));
        if (!(std::abs(size - 1) < 1e-3))
            throw InputError(fmt::format("{}: quaternion {} of {} has length {}, 1 is expected", place_,
                                         i + 1, count, size));
    }
    limit_coverage(place_, begin_, end_, times_.front(), times_.back());
}

Quat CkSegment::sample(std::size_t index) const noexcept {
    const double* const q = samples_.data() + index * sample_words_;
    // The file's quaternion takes vectors of the base frame to the instrument's.
    return conjugate({q[0], q[1], q[2], q[3]});
}

std::vector<Interval> CkSegment::coverage() const {
    std::vector<Interval> covered;
    for (std::size_t i = 0; i < starts_.size(); ++i) {
        const auto next = i + 1 < starts_.size()
                              ? std::lower_bound(times_.begin(), times_.end(), starts_[i + 1])
                              : times_.end();
        const double last = next == times_.begin() ? starts_[i] : *(next - 1);
        const Interval interval{std::max(starts_[i], begin_), std::min(last, end_)};
        if (interval.begin_s <= interval.end_s) covered.push_back(interval);
    }
    return covered;
}

Evaluation CkSegment::orientation(double ticks, Quat& to_base) const noexcept {
    if (!(ticks >= begin_ && ticks <= end_)) return Evaluation::no_coverage;
    const auto after = std::upper_bound(times_.begin(), times_.end(), ticks);
    if (after == times_.begin()) return Evaluation::no_coverage;
    const auto index = static_cast<std::size_t>(after - times_.begin()) - 1;
    if (times_[index] == ticks) {
        to_base = normalized(sample(index));
        return Evaluation::ok;
    }
    if (after == times_.end()) return Evaluation::no_coverage;
    // A start of an interval after `ticks` and no later than the next attitude: a gap.
    const auto start = std::upper_bound(starts_.begin(), starts_.end(), ticks);
    if (start != starts_.end() && *start <= *after) return Evaluation::no_coverage;
    const double share = (ticks - times_[index]) / (*after - times_[index]);
    to_base = slerp(normalized(sample(index)), normalized(sample(index + 1)), share);
    return Evaluation::ok;
}

} // namespace obscura::ephemeris
