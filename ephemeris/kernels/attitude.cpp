// SPDX-License-Identifier: Apache-2.0
// Spacecraft clocks (SCLK type 1) and the frames of CK kernels.
#include "core/error.hpp"
#include "ephemeris/kernels/ck_segment.hpp"
#include "ephemeris/kernels/frame_model.hpp"
#include "ephemeris/segments/interpolation.hpp"

#include <fmt/format.h>

#include <algorithm>
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
            if (s.segment == nullptr) {
                if (ticks >= s.unusable_ticks.begin_s && ticks <= s.unusable_ticks.end_s)
                    return Evaluation::unusable;
                continue;
            }
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

} // namespace obscura::ephemeris
