// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/kernel_frame.hpp"

#include "core/error.hpp"
#include "renderer/scene/central_difference.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::scene {
namespace {

using ephemeris::Evaluation;
using ephemeris::Interval;
using ephemeris::TdbTime;

constexpr int barycentre = 0;
/// Distance from the ends of covered intervals within which nothing is evaluated: rounding of times.
constexpr double edge_s = 1e-6;

/// TDB - TT by its largest term, s (IAU 1976; "The Astronomical Almanac"): its change over a scene is needed,
/// not its value.
double tdb_minus_tt(double tdb_s) noexcept {
    const double m = 6.239996 + 1.99096871e-7 * tdb_s;
    return 1.657e-3 * std::sin(m + 1.671e-2 * std::sin(m));
}

/// Times that are in an interval of both lists, which are sorted.
std::vector<Interval> common(const std::vector<Interval>& a, const std::vector<Interval>& b) {
    std::vector<Interval> both;
    for (const Interval& x : a)
        for (const Interval& y : b) {
            const Interval part{std::max(x.begin_s, y.begin_s), std::min(x.end_s, y.end_s)};
            if (part.begin_s < part.end_s) both.push_back(part);
        }
    return both;
}

/// Scene times at which kernels know a position or an attitude.
class CoveredTimes {
public:
    CoveredTimes() = default;
    explicit CoveredTimes(const std::vector<Interval>& known) {
        for (const Interval& i : known) {
            const double middle_s = i.begin_s + (i.end_s - i.begin_s) / 2;
            covered_.push_back(is_instant(i) ? Interval{middle_s, middle_s}
                                             : Interval{i.begin_s + edge_s, i.end_s - edge_s});
        }
    }

    [[nodiscard]] const std::vector<Interval>& intervals() const { return covered_; }
    /// Whether something is known, but at instants only.
    [[nodiscard]] bool instants_only() const {
        return !covered_.empty() && std::all_of(covered_.begin(), covered_.end(), is_instant);
    }
    /// Covered time that is nearest to `time_s`; of none scene time 0, where something is known.
    [[nodiscard]] double nearest(double time_s) const noexcept {
        const auto after = std::lower_bound(covered_.begin(), covered_.end(), time_s,
                                            [](const Interval& i, double t) { return i.end_s < t; });
        if (after != covered_.end() && after->begin_s <= time_s) return time_s;
        const bool next = after != covered_.end(), last = after != covered_.begin();
        if (!next && !last) return 0;
        if (!next) return (after - 1)->end_s;
        if (!last) return after->begin_s;
        return after->begin_s - time_s < time_s - (after - 1)->end_s ? after->begin_s : (after - 1)->end_s;
    }

private:
    static bool is_instant(const Interval& i) { return !(i.end_s - i.begin_s > 4 * edge_s); }

    std::vector<Interval> covered_;
};

/// A pose that stays.
class Still final : public PosePath {
public:
    explicit Still(const Pose& pose) : pose_(pose) {}
    [[nodiscard]] Pose at(double /*time_s*/) const noexcept override { return pose_; }
    [[nodiscard]] Vec3 velocity_m_s(double /*time_s*/) const noexcept override { return {}; }
    [[nodiscard]] PoseAges ages(double /*time_s*/) const noexcept override { return {}; }
    [[nodiscard]] std::vector<double> times_s() const override { return {}; }

private:
    Pose pose_;
};

class KernelPath final : public PosePath {
public:
    KernelPath(std::shared_ptr<const KernelFrame> scene, int body, const std::string& frame,
               std::shared_ptr<const PosePath> local)
        : scene_(std::move(scene)),
          model_(scene_->kernels().frame(frame)),
          body_(body),
          local_(std::move(local)) {
        first_.position_m = scene_->position(body, 0);
        placed_ = CoveredTimes(scene_->coverage(body));
        std::vector<Interval> oriented;
        for (const Interval& i : scene_->kernels().orientation_coverage(frame))
            oriented.push_back({scene_->scene_s(i.begin_s), scene_->scene_s(i.end_s)});
        oriented_ = CoveredTimes(oriented);
        const double known_s = oriented_.instants_only() ? oriented_.nearest(0) : 0;
        first_.orientation = scene_->kernels().orientation(frame, scene_->tdb(known_s));
    }

    [[nodiscard]] Pose at(double time_s) const noexcept override {
        Pose pose;
        known_position(time_s, pose.position_m);
        known_orientation(time_s, pose.orientation);
        const Pose local = local_->at(time_s);
        return {to_parent(pose, local.position_m), normalized(pose.orientation * local.orientation)};
    }
    [[nodiscard]] Vec3 velocity_m_s(double time_s) const noexcept override {
        ephemeris::State state;
        if (placed_.nearest(time_s) != time_s || scene_->state(body_, time_s, state) != Evaluation::ok)
            state.velocity_m_s = {};
        const Vec3 local_m = local_->at(time_s).position_m;
        Vec3 velocity = state.velocity_m_s + rotate(orientation(time_s), local_->velocity_m_s(time_s));
        if (length_squared(local_m) > 0)
            velocity = velocity + differenced_velocity_m_s(
                                      [&](double t) { return rotate(orientation(t), local_m); }, time_s);
        return velocity;
    }
    [[nodiscard]] PoseAges ages(double time_s) const noexcept override {
        const PoseAges local = local_->ages(time_s);
        Pose unused;
        return {std::max(std::abs(time_s - known_position(time_s, unused.position_m)), local.position_s),
                std::max(std::abs(time_s - known_orientation(time_s, unused.orientation)), local.attitude_s)};
    }
    [[nodiscard]] std::vector<double> times_s() const override {
        std::vector<double> times = local_->times_s();
        if (!times.empty()) return times;
        for (const CoveredTimes* const covered : {&placed_, &oriented_})
            for (const Interval& i : covered->intervals())
                for (const double t : {i.begin_s, i.end_s})
                    if (std::isfinite(t)) times.push_back(t);
        std::sort(times.begin(), times.end());
        times.erase(std::unique(times.begin(), times.end()), times.end());
        return times;
    }
    [[nodiscard]] std::vector<double> attitude_instants_s() const override {
        if (!oriented_.instants_only()) return local_->attitude_instants_s();
        std::vector<double> times;
        for (const Interval& i : oriented_.intervals())
            times.push_back(i.begin_s);
        return times;
    }

private:
    /// The covered time nearest to `time_s`; where the kernels hold values that are no poses, the last one
    /// before it that `knows` finds one at, by doubled steps back in time; none within reach: 0.
    template<typename Knows>
    static double last_known(const CoveredTimes& covered, double time_s, const Knows& knows) noexcept {
        constexpr double first_step_s = 1e-3;
        constexpr int steps = 40; // longer than any kernel
        const double nearest_s = covered.nearest(time_s);
        if (knows(nearest_s)) return nearest_s;
        double step_s = first_step_s;
        for (int i = 0; i < steps; ++i, step_s *= 2)
            if (const double at_s = covered.nearest(nearest_s - step_s); knows(at_s)) return at_s;
        return 0;
    }
    double known_position(double time_s, Vec3& position_m) const noexcept {
        position_m = first_.position_m;
        return last_known(placed_, time_s,
                          [&](double t) { return scene_->position(body_, t, position_m) == Evaluation::ok; });
    }
    double known_orientation(double time_s, Quat& q) const noexcept {
        q = first_.orientation;
        return last_known(oriented_, time_s, [&](double t) {
            Quat found;
            if (model_->orientation(scene_->tdb(t), found) != Evaluation::ok) return false;
            q = found;
            return true;
        });
    }
    [[nodiscard]] Quat orientation(double time_s) const noexcept {
        Quat q;
        known_orientation(time_s, q);
        return q;
    }

    std::shared_ptr<const KernelFrame> scene_;
    std::shared_ptr<const ephemeris::FrameModel> model_;
    int body_;
    std::shared_ptr<const PosePath> local_;
    Pose first_;            ///< at scene time 0; the attitude at the nearest instant, if it has instants only
    CoveredTimes placed_;   ///< where the position is known
    CoveredTimes oriented_; ///< where the attitude is known
};

/// Hermite's cubics between states half a day apart; beyond them another path.
class SlowPath final : public PosePath {
public:
    SlowPath(const KernelFrame& scene, int body, std::shared_ptr<const PosePath> other)
        : other_(std::move(other)) {
        for (int i = -steps; i <= steps; ++i)
            if (scene.state(body, i * step_s, states_.emplace_back()) != Evaluation::ok) {
                states_.clear();
                return;
            }
    }
    [[nodiscard]] Pose at(double time_s) const noexcept override {
        const double place = time_s / step_s + steps;
        if (states_.empty() || !(place >= 0 && place < 2 * steps)) return other_->at(time_s);
        const auto i = static_cast<std::size_t>(place);
        const double s = place - static_cast<double>(i);
        const ephemeris::State &a = states_[i], &b = states_[i + 1];
        const Vec3 rise = b.position_m - a.position_m;
        const Vec3 slope_a = a.velocity_m_s * step_s, slope_b = b.velocity_m_s * step_s;
        return {a.position_m + s * (slope_a + s * (3 * rise - 2 * slope_a - slope_b +
                                                   s * (slope_a + slope_b - 2 * rise))),
                {}};
    }
    [[nodiscard]] Vec3 velocity_m_s(double time_s) const noexcept override {
        const double place = time_s / step_s + steps;
        if (states_.empty() || !(place >= 0 && place < 2 * steps)) return other_->velocity_m_s(time_s);
        // Linear between the states: the Sun's acceleration hardly changes in half a day.
        const auto i = static_cast<std::size_t>(place);
        const double s = place - static_cast<double>(i);
        return states_[i].velocity_m_s * (1 - s) + states_[i + 1].velocity_m_s * s;
    }
    [[nodiscard]] PoseAges ages(double time_s) const noexcept override { return other_->ages(time_s); }
    [[nodiscard]] std::vector<double> times_s() const override { return other_->times_s(); }

private:
    static constexpr int steps = 20;
    static constexpr double step_s = 43200;
    std::shared_ptr<const PosePath> other_;
    std::vector<ephemeris::State> states_; ///< from 20 steps before scene time 0; empty: not covered
};

} // namespace

KernelFrame::KernelFrame(ephemeris::Ephemeris kernels, ephemeris::Epoch epoch, int centre)
    : kernels_(std::move(kernels)),
      epoch_(to_tdb(epoch)),
      centre_(centre),
      origin_m_(kernels_.state(centre, barycentre, epoch_).position_m) {}

TdbTime KernelFrame::tdb(double scene_s) const noexcept {
    const double start = epoch_.seconds();
    return epoch_ + (scene_s + (tdb_minus_tt(start + scene_s) - tdb_minus_tt(start)));
}

double KernelFrame::scene_s(double tdb_s) const noexcept {
    if (!std::isfinite(tdb_s)) return tdb_s;
    const double start = epoch_.seconds();
    return (tdb_s - epoch_.whole_s) - epoch_.part_s - (tdb_minus_tt(tdb_s) - tdb_minus_tt(start));
}

Evaluation KernelFrame::position(int body, double scene_s, Vec3& position_m) const noexcept {
    ephemeris::State of_body;
    const Evaluation status = state(body, scene_s, of_body);
    if (status == Evaluation::ok) position_m = of_body.position_m;
    return status;
}

Evaluation KernelFrame::state(int body, double scene_s, ephemeris::State& state) const noexcept {
    // By the centre: the first difference is small near it, the second within the scene's time.
    const TdbTime time = tdb(scene_s);
    ephemeris::State centre, relative;
    if (const Evaluation status = kernels_.state(centre_, barycentre, time, centre); status != Evaluation::ok)
        return status;
    const Evaluation status = kernels_.state(body, centre_, time, relative);
    state.position_m = relative.position_m + (centre.position_m - origin_m_);
    state.velocity_m_s = relative.velocity_m_s + centre.velocity_m_s;
    return status;
}

Vec3 KernelFrame::position(int body, double scene_s) const {
    Vec3 position_m;
    const Evaluation status = position(body, scene_s, position_m);
    if (status != Evaluation::ok) throw InputError(kernels_.reason(body, barycentre, tdb(scene_s), status));
    return position_m;
}

std::vector<Interval> KernelFrame::coverage(int body) const {
    std::vector<Interval> covered =
        common(kernels_.coverage(body, centre_), kernels_.coverage(centre_, barycentre));
    for (Interval& i : covered)
        i = {scene_s(i.begin_s), scene_s(i.end_s)};
    return covered;
}

std::shared_ptr<const PosePath> slow_kernel_path(std::shared_ptr<const KernelFrame> scene, int body) {
    return std::make_shared<SlowPath>(*scene, body, kernel_path(scene, body, "J2000", Pose{}));
}

std::shared_ptr<const PosePath> kernel_path(std::shared_ptr<const KernelFrame> scene, int body,
                                            const std::string& frame, const Pose& local) {
    return kernel_path(std::move(scene), body, frame, std::make_shared<Still>(local));
}

std::shared_ptr<const PosePath> kernel_path(std::shared_ptr<const KernelFrame> scene, int body,
                                            const std::string& frame, std::shared_ptr<const PosePath> local) {
    return std::make_shared<KernelPath>(std::move(scene), body, frame, std::move(local));
}

} // namespace obscura::scene
