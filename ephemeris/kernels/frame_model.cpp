// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/frame_model.hpp"

#include "core/error.hpp"
#include "core/units.hpp"
#include "ephemeris/segments/interpolation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::ephemeris {
namespace {

constexpr double day_s = 86400;
constexpr double century_days = 36525;
constexpr double model_j2000_jd = 2451545.0;

/// Rotation from a frame to the one that Euler angles 3-1-3 refer to.
Quat euler_313(double first, double second, double third) {
    return axis_angle({0, 0, 1}, first) * axis_angle({1, 0, 0}, second) * axis_angle({0, 0, 1}, third);
}

/// Orientation of `base` times `to_base`.
Evaluation based(const FrameModel* base, TdbTime time, Quat to_base, Quat& to_icrf) noexcept {
    to_icrf = to_base;
    if (base == nullptr) return Evaluation::ok;
    Quat outer;
    const Evaluation status = base->orientation(time, outer);
    to_icrf = outer * to_base;
    return status;
}

class FixedFrame final : public FrameModel {
public:
    FixedFrame(std::shared_ptr<const FrameModel> base, Quat to_base)
        : base_(std::move(base)), to_base_(to_base) {}
    [[nodiscard]] Evaluation orientation(TdbTime time, Quat& to_icrf) const noexcept override {
        return based(base_.get(), time, to_base_, to_icrf);
    }

private:
    std::shared_ptr<const FrameModel> base_;
    Quat to_base_;
};

class BodyFrame final : public FrameModel {
public:
    BodyFrame(std::vector<BasedPckSegment> segments, std::optional<RotationModel> model,
              std::shared_ptr<const FrameModel> model_base)
        : segments_(std::move(segments)), model_(std::move(model)), model_base_(std::move(model_base)) {}

    [[nodiscard]] Evaluation orientation(TdbTime time, Quat& to_icrf) const noexcept override {
        const double t = time.seconds();
        for (const BasedPckSegment& s : segments_) {
            const Interval covered = s.segment->coverage();
            if (t < covered.begin_s || t > covered.end_s) continue;
            Quat to_base;
            if (!s.segment->orientation(time, to_base)) return Evaluation::damaged;
            return based(s.base.get(), time, to_base, to_icrf);
        }
        if (!model_) return segments_.empty() ? Evaluation::no_data : Evaluation::no_coverage;
        return based(model_base_.get(), time, ephemeris::orientation(*model_, time), to_icrf);
    }

private:
    std::vector<BasedPckSegment> segments_;
    std::optional<RotationModel> model_;
    std::shared_ptr<const FrameModel> model_base_;
};

/// Value of a polynomial.
double polynomial(std::span<const double> c, double x) noexcept {
    double sum = 0;
    for (std::size_t i = c.size(); i-- > 0;)
        sum = sum * x + c[i];
    return sum;
}

std::vector<double> copy(std::span<const double> values) {
    return {values.begin(), values.end()};
}

/// Barycentre whose phase angles a body uses: that of its planet.
int barycenter_of(int id) {
    if (id >= 100 && id <= 999) return id / 100;
    if (id >= 10000 && id <= 99999) return id / 10000;
    return id;
}

} // namespace

std::shared_ptr<const FrameModel> make_fixed_frame(std::shared_ptr<const FrameModel> base, Quat to_base) {
    return std::make_shared<FixedFrame>(std::move(base), to_base);
}

std::shared_ptr<const FrameModel> make_body_frame(std::vector<BasedPckSegment> segments,
                                                  std::optional<RotationModel> model,
                                                  std::shared_ptr<const FrameModel> model_base) {
    return std::make_shared<BodyFrame>(std::move(segments), std::move(model), std::move(model_base));
}

std::optional<RotationModel> rotation_model(const KernelPool& pool, int id) {
    const auto name = [](int body, const char* what) { return fmt::format("BODY{}_{}", body, what); };
    constexpr std::size_t max_terms = 3, max_phases = 1000;
    RotationModel model;
    model.pole_ra = copy(pool.numbers(name(id, "POLE_RA"), 1, max_terms));
    if (model.pole_ra.empty()) return std::nullopt;
    model.pole_dec = copy(pool.numbers(name(id, "POLE_DEC"), 1, max_terms));
    model.prime_meridian = copy(pool.numbers(name(id, "PM"), 1, max_terms));
    const std::string& place = pool.find(name(id, "POLE_RA"))->place;
    if (model.pole_dec.empty() || model.prime_meridian.empty())
        throw InputError(
            fmt::format("{}: {} and {} are needed with it", place, name(id, "POLE_DEC"), name(id, "PM")));
    model.periodic_ra = copy(pool.numbers(name(id, "NUT_PREC_RA"), 1, max_phases));
    model.periodic_dec = copy(pool.numbers(name(id, "NUT_PREC_DEC"), 1, max_phases));
    model.periodic_meridian = copy(pool.numbers(name(id, "NUT_PREC_PM"), 1, max_phases));
    const int barycenter = barycenter_of(id);
    model.phases = copy(pool.numbers(name(barycenter, "NUT_PREC_ANGLES"), 1, 10 * max_phases));
    const int degree = pool.integer(name(barycenter, "MAX_PHASE_DEGREE")).value_or(1);
    if (degree < 1 || degree > 5)
        throw InputError(fmt::format("{}: degree {}, allowed 1 to 5",
                                     pool.find(name(barycenter, "MAX_PHASE_DEGREE"))->place, degree));
    model.phase_terms = static_cast<std::size_t>(degree) + 1;
    const std::size_t amplitudes =
        std::max({model.periodic_ra.size(), model.periodic_dec.size(), model.periodic_meridian.size()});
    if (amplitudes * model.phase_terms > model.phases.size())
        throw InputError(fmt::format("{}: {} periodic terms of body {} need {} phase angles ({})", place,
                                     amplitudes, id, amplitudes, name(barycenter, "NUT_PREC_ANGLES")));
    if (const auto jd = pool.number(name(id, "CONSTANTS_JED_EPOCH")))
        model.epoch_s = (*jd - model_j2000_jd) * day_s;
    return model;
}

Quat orientation(const RotationModel& model, TdbTime time) noexcept {
    const double days = (time.whole_s - model.epoch_s) / day_s + time.part_s / day_s;
    const double centuries = days / century_days;
    double ra = polynomial(model.pole_ra, centuries);
    double dec = polynomial(model.pole_dec, centuries);
    double meridian = polynomial(model.prime_meridian, days);
    const auto phase = [&](std::size_t i) {
        return polynomial(std::span(model.phases).subspan(i * model.phase_terms, model.phase_terms),
                          centuries) *
               degree;
    };
    for (std::size_t i = 0; i < model.periodic_ra.size(); ++i)
        ra += model.periodic_ra[i] * std::sin(phase(i));
    for (std::size_t i = 0; i < model.periodic_dec.size(); ++i)
        dec += model.periodic_dec[i] * std::cos(phase(i));
    for (std::size_t i = 0; i < model.periodic_meridian.size(); ++i)
        meridian += model.periodic_meridian[i] * std::sin(phase(i));
    return euler_313((90 + ra) * degree, (90 - dec) * degree, std::fmod(meridian, 360.0) * degree);
}

PckSegment::PckSegment(const Daf::Array& array)
    : place_(array.place),
      class_(array.integers.at(0)),
      base_(array.integers.at(1)),
      begin_s_(array.doubles.at(0)),
      end_s_(array.doubles.at(1)) {
    if (array.integers.at(2) != 2)
        throw InputError(
            fmt::format("{}: PCK type {} is not supported, allowed 2", place_, array.integers.at(2)));
    records_ = chebyshev_records(place_, array.words, 3);
    limit_coverage(place_, begin_s_, end_s_, records_.first_s,
                   records_.first_s + records_.interval_s * static_cast<double>(records_.count));
}

bool PckSegment::orientation(TdbTime time, Quat& to_base) const noexcept {
    double x = 0;
    const std::span<const double> record = records_.at(time, x);
    if (record.empty()) return false;
    const std::size_t n = (record.size() - 2) / 3;
    const auto angle = [&](std::size_t i) { return chebyshev(record.subspan(2 + i * n, n), x).value; };
    to_base = euler_313(angle(0), angle(1), angle(2));
    return std::isfinite(norm(to_base));
}

} // namespace obscura::ephemeris
