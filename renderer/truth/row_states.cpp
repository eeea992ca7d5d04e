// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/row_states.hpp"

#include "renderer/world/exposure.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <type_traits>

namespace obscura::renderer {
namespace {

/// More instants than these move no centroid by 1e-4 px: the first two moments of the exposure are exact with
/// any number.
constexpr std::uint32_t max_truth_instants = 16;

} // namespace

RowStates::RowStates(const TruthScene& scene, std::span<const FrameWindow> windows,
                     std::span<const RowTime> rows, std::span<const RowTime> row_times, bool push_broom,
                     std::span<const PixelTimes> pixel_times, std::span<std::byte> workspace)
    : scene_(scene),
      memory_(workspace.data(), workspace.size()),
      windows_(windows),
      rows_(rows),
      row_times_(row_times),
      push_broom_(push_broom),
      pixel_times_(pixel_times),
      body_changes_(&memory_),
      first_state_(&memory_),
      states_(&memory_) {
    find_changes();
    if (scene.max_instants > 1 && !rows.empty()) {
        double motion = 0;
        for (const RowTime& row : {rows.front(), rows[rows.size() / 2], rows.back()})
            motion = std::max(motion, motion_px(scene.scene, scene.bodies, scene.lens, scene.reach_px, row));
        rendered_instants_ = Exposure::of(rows.front(), motion, scene.max_instants).instants;
    }
    instants_ = std::min(rendered_instants_, max_truth_instants);
    std::size_t states = 0;
    first_state_.reserve(rows.size());
    for (std::size_t row = 0; row < rows.size(); ++row) {
        if (row > 0 && rows[row] != rows[row - 1]) states += instants_;
        first_state_.push_back(states);
    }
    states_.resize(states + instants_);
}

void RowStates::find_changes() {
    if (scene_.poses == nullptr) return;
    const GroundTruth& then = *scene_.poses;
    const Pose camera = camera_pose(scene_.scene, scene_.bodies, scene_.poses_s);
    bool moved = camera != then.camera;
    const auto change = [&moved](const Pose& from, const Pose& to) {
        moved |= from != to;
        return Change{to.orientation * conjugate(from.orientation), to.position_m - from.position_m};
    };
    camera_change_ = change(camera, then.camera);
    body_changes_.resize(scene_.bodies.size());
    for (std::size_t b = 0; b < std::min<std::size_t>(then.body_count, scene_.scene.bodies.size()); ++b)
        body_changes_[b] =
            change(seen_pose(scene_.scene, scene_.bodies, b, camera.position_m, scene_.poses_s),
                   then.bodies[b].pose);
    if (!moved) body_changes_.clear();
}

const TruthState& RowStates::at(std::int32_t row, std::uint32_t instant) {
    const auto r = static_cast<std::size_t>(row);
    const TruthState*& state = states_[first_state_[r] + instant];
    if (state == nullptr) state = &state_at(Exposure{rows_[r], instants_}.time_s(instant));
    return *state;
}

TruthState& RowStates::new_state() {
    // The memory is released without destructors.
    static_assert(std::is_trivially_destructible_v<TruthState> &&
                  std::is_trivially_destructible_v<ApparentBody>);
    TruthState& s = *std::pmr::polymorphic_allocator<>(&memory_).new_object<TruthState>();
    const std::size_t count = scene_.bodies.size();
    s.bodies = std::span(std::pmr::polymorphic_allocator<ApparentBody>(&memory_).allocate(count), count);
    return s;
}

void RowStates::set_state(TruthState& s, double time_s) const {
    s.time_s = time_s;
    const bool changed = !body_changes_.empty();
    s.camera = camera_pose(scene_.scene, scene_.bodies, s.time_s);
    if (changed) s.camera = camera_change_.of(s.camera);
    s.camera_from_inertial = transposed(to_matrix(s.camera.orientation));
    s.beta = camera_beta(scene_.scene, scene_.bodies, s.time_s);
    s.sun_m = scene_.scene.sun.position_at(time_s);
    for (std::size_t b = 0; b < s.bodies.size(); ++b) {
        ApparentBody body = apparent_body(scene_.scene, scene_.bodies, b, s.camera.position_m, s.time_s);
        if (changed) {
            body.pose = body_changes_[b].of(body.pose);
            body.range_m = length(body.pose.position_m - s.camera.position_m);
        }
        std::construct_at(&s.bodies[b], body);
    }
}

const TruthState& RowStates::state_at(double time_s) {
    TruthState& s = new_state();
    set_state(s, time_s);
    return s;
}

bool RowStates::on_window(std::size_t window, ImagePoint at) const {
    const Region& r = windows_[window].sensor;
    const std::int32_t height = push_broom_ ? 1 : r.height;
    return at.x >= r.x - 0.5 && at.x < r.x + r.width - 0.5 && at.y >= r.y - 0.5 && at.y < r.y + height - 0.5;
}

const TruthState& RowStates::middle_of(std::size_t window) {
    const FrameWindow& w = windows_[window];
    return at(w.image_y + w.sensor.height / 2, instants_ / 2);
}

std::optional<ImagePoint> RowStates::project(const TruthState& state, Vec3 direction,
                                             ImagePoint& shift) const {
    const Vec3 seen =
        length_squared(state.beta) > 0 ? aberrate(normalized(direction), state.beta) : direction;
    std::optional<ImagePoint> at = scene_.lens.project(seen);
    if (!at || scene_.psf == nullptr) return at;
    shift = scene_.psf->centroid(*at, band_weights_);
    return ImagePoint{at->x + shift.x, at->y + shift.y};
}

double RowStates::transmission(const TruthState& state, Vec3 direction) const {
    return length_squared(state.beta) > 0 ? MovingLens(scene_.lens, state.beta).transmission(direction)
                                          : scene_.lens.transmission(direction);
}

std::optional<RowStates::Crossing> RowStates::cross(std::size_t window, std::uint32_t instant,
                                                    Direction direction) {
    const FrameWindow& w = windows_[window];
    const std::int32_t first = w.image_y, last = w.image_y + w.sensor.height - 1;
    if (last < first) return std::nullopt;
    struct Step {
        ImagePoint at, shift;
        double miss = 0; ///< rows from the row to the image at its time
    };
    const auto look = [&](std::int32_t row) -> std::optional<Step> {
        const TruthState& state = this->at(row, instant);
        Step step;
        const std::optional<ImagePoint> at = project(state, direction(state), step.shift);
        if (!at) return std::nullopt;
        step.at = *at;
        step.miss = at->y - sensor_row(window, row);
        return step;
    };
    // Find neighbouring rows between which, or nearest to which, it lands: Newton, from the middle.
    std::int32_t row = first + (last - first) / 2;
    std::optional<Step> here, next;
    double slope = 0; // of the miss, per row
    constexpr int max_steps = 24;
    for (int step = 0; step < max_steps; ++step) {
        if (row == last && last > first) --row;
        here = look(row);
        if (!here) return std::nullopt;
        next = here;
        const std::size_t same = first_state_[static_cast<std::size_t>(row)];
        if (last > first && (push_broom_ || first_state_[static_cast<std::size_t>(row) + 1] != same)) {
            next = look(row + 1);
            if (!next) return std::nullopt;
            slope = next->miss - here->miss;
        } else {
            slope = push_broom_ ? 0 : -1;
        }
        if (slope == 0) return std::nullopt;
        const double wanted = row - here->miss / slope;
        const double limited = std::clamp(std::floor(wanted), static_cast<double>(first),
                                          static_cast<double>(last > first ? last - 1 : last));
        const auto to = static_cast<std::int32_t>(limited);
        if (to == row) break;
        // Where neighbours alternate, either is near enough.
        if (step + 1 < max_steps) row = to;
    }
    Crossing out;
    const double part = -here->miss / slope;
    out.row = row;
    out.between = part;
    const bool moves = next->at.y != here->at.y || next->at.x != here->at.x;
    const double x = here->at.x + (moves ? part * (next->at.x - here->at.x) : 0);
    out.at = {x - w.sensor.x, row + part};
    out.shift = here->shift;
    out.state = &this->at(row, instant);
    const RowTime& time = row_times_[static_cast<std::size_t>(row)];
    out.seconds = to_seconds(time.exposure_ns()) / std::abs(slope);
    out.inside = out.at.y >= first - 0.5 && out.at.y < last + 0.5 && out.at.x >= -0.5 &&
                 out.at.x < w.sensor.width - 0.5;
    return out;
}

RowTime RowStates::pixel_time(std::size_t window, ImagePoint at) const {
    const Region& r = windows_[window].sensor;
    // The four pixels around it, or the nearest ones of the window: beyond that the time goes on as within.
    const auto first = [](double v, std::int32_t from, std::int32_t count) {
        return static_cast<std::int32_t>(std::clamp(std::floor(v), static_cast<double>(from),
                                                    static_cast<double>(from + std::max(count - 2, 0))));
    };
    const std::int32_t x = first(at.x, r.x, r.width), y = first(at.y, r.y, r.height);
    const double right = std::clamp(at.x - x, -1.0, 2.0), down = std::clamp(at.y - y, -1.0, 2.0);
    std::array<std::array<RowTime, 2>, 2> pixels{};
    for (std::int32_t k = 0; k < 2; ++k)
        pixel_times_[window].fill(y + k, x, pixels[static_cast<std::size_t>(k)]);
    const auto between = [&](Time RowTime::*edge) {
        const Time origin = pixels[0][0].*edge;
        const auto later = [&](std::size_t k, std::size_t i) {
            return static_cast<double>(pixels[k][i].*edge - origin);
        };
        const double upper = right * later(0, 1);
        const double lower = later(1, 0) + right * (later(1, 1) - later(1, 0));
        return origin + std::llround(upper + down * (lower - upper));
    };
    return {between(&RowTime::reset), between(&RowTime::read)};
}

std::optional<RowStates::Crossing> RowStates::cross_pixels(std::size_t window, std::uint32_t instant,
                                                           Direction direction) {
    const FrameWindow& w = windows_[window];
    if (w.sensor.height < 1) return std::nullopt;
    if (tried_ == nullptr) tried_ = &new_state();
    struct Step {
        double time_s, late_s; ///< an instant, and the instant of the pixel there, after it
        ImagePoint at, shift;
        RowTime exposure;
    };
    const auto look = [&](double time_s) -> std::optional<Step> {
        set_state(*tried_, time_s);
        Step step{time_s, 0, {}, {}, {}};
        const auto at = project(*tried_, direction(*tried_), step.shift);
        if (!at) return std::nullopt;
        step.at = *at;
        step.exposure = pixel_time(window, *at);
        step.late_s = Exposure{step.exposure, instants_}.time_s(instant) - time_s;
        return step;
    };
    // Secant from the middle row.
    const auto middle = static_cast<std::size_t>(w.image_y + w.sensor.height / 2);
    std::optional<Step> before = look(Exposure{rows_[middle], instants_}.time_s(instant));
    if (!before) return std::nullopt;
    std::optional<Step> here = look(before->time_s + before->late_s);
    double slope = -1;
    constexpr int max_steps = 24;
    constexpr double close_s = 2e-9;
    for (int step = 0; here && step < max_steps && std::abs(here->late_s) > close_s; ++step) {
        if (here->time_s != before->time_s)
            slope = (here->late_s - before->late_s) / (here->time_s - before->time_s);
        if (slope == 0) return std::nullopt;
        before = here;
        here = look(here->time_s - here->late_s / slope);
    }
    if (!here) return std::nullopt;
    if (here->time_s != before->time_s)
        slope = (here->late_s - before->late_s) / (here->time_s - before->time_s);
    Crossing out;
    out.at = {here->at.x - w.sensor.x, here->at.y - w.sensor.y + w.image_y};
    out.shift = here->shift;
    const double last = w.image_y + w.sensor.height - 1;
    out.row = static_cast<std::int32_t>(std::clamp(std::floor(out.at.y), 0.0 + w.image_y, last));
    out.between = out.at.y - out.row;
    out.seconds = to_seconds(here->exposure.exposure_ns()) / std::max(std::abs(slope), 1e-12);
    out.inside = on_window(window, here->at) && std::abs(here->late_s) <= 1e-6;
    out.state = &state_at(here->time_s);
    return out;
}

std::optional<Landing> RowStates::land(std::size_t window, Direction direction, Seen seen) {
    const auto one_by_one = [&](std::span<const TruthState* const> states, std::span<const Vec3> towards,
                                std::span<bool> answers) {
        for (std::size_t i = 0; i < states.size(); ++i)
            answers[i] = seen(*states[i], towards[i]);
    };
    return land_together(window, direction, one_by_one);
}

std::optional<Landing> RowStates::land_together(std::size_t window, Direction direction, AllSeen seen) {
    struct Sum {
        ImagePoint at, shift;
        double weight = 0, row = 0;
        void add(const Crossing& c) {
            at.x += c.seconds * c.at.x, at.y += c.seconds * c.at.y;
            shift.x += c.seconds * c.shift.x, shift.y += c.seconds * c.shift.y;
            row += c.seconds * (c.row + c.between);
            weight += c.seconds;
        }
    };
    const auto weighted = [](Crossing c) {
        c.seconds = std::max(c.seconds, 1e-12); // an exposure of 0 has a centroid too
        return c;
    };
    Sum any, inside, visible;
    Landing out;
    std::optional<Crossing> begin, end;
    // Instants at which it lands in the window.
    std::array<Crossing, max_truth_instants> crossings;
    std::array<const TruthState*, max_truth_instants> at_states{};
    std::array<Vec3, max_truth_instants> towards;
    std::array<bool, max_truth_instants> answers{};
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < instants_; ++i) {
        const std::optional<Crossing> c =
            pixel_times_.empty() ? cross(window, i, direction) : cross_pixels(window, i, direction);
        if (!c) continue;
        if (!begin) begin = c;
        end = c;
        any.add(weighted(*c));
        const TruthState& state = *c->state;
        if (out.state == nullptr || i == instants_ / 2) out.state = &state;
        if (!c->inside) continue;
        inside.add(weighted(*c));
        out.inside += 1.0 / instants_;
        crossings[count] = *c;
        at_states[count] = &state;
        towards[count] = direction(state);
        ++count;
    }
    seen(std::span<const TruthState* const>(at_states).first(count),
         std::span<const Vec3>(towards).first(count), std::span(answers).first(count));
    for (std::size_t i = 0; i < count; ++i) {
        if (!answers[i]) continue;
        visible.add(weighted(crossings[i]));
        out.seen += 1.0 / instants_;
        out.seconds += crossings[i].seconds * transmission(*at_states[i], towards[i]) / instants_;
    }
    if (any.weight == 0) return std::nullopt;
    const Sum& sum = visible.weight > 0 ? visible : inside.weight > 0 ? inside : any;
    out.at = {sum.at.x / sum.weight, sum.at.y / sum.weight};
    out.psf_shift = {sum.shift.x / sum.weight, sum.shift.y / sum.weight};
    out.row_position = sum.row / sum.weight;
    if (instants_ > 1) {
        const double whole = instants_ / (instants_ - 1.0);
        out.streak = {(end->at.x - begin->at.x) * whole, (end->at.y - begin->at.y) * whole};
    }
    const FrameWindow& w = windows_[window];
    if (!pixel_times_.empty()) {
        const RowTime time = pixel_time(window, {out.at.x + w.sensor.x, out.at.y - w.image_y + w.sensor.y});
        const auto row = static_cast<std::size_t>(w.image_y);
        const std::int64_t to_clock_ns = row_times_[row].reset - rows_[row].reset;
        out.row = {time.reset + to_clock_ns, time.read + to_clock_ns};
        return out;
    }
    // The time of the row, linear between rows.
    const double last = w.image_y + w.sensor.height - 1;
    const double position = std::clamp(out.row_position, static_cast<double>(w.image_y), last);
    const auto row =
        static_cast<std::size_t>(std::min(std::floor(position), std::max(last - 1.0, 0.0 + w.image_y)));
    const RowTime& a = row_times_[row];
    const RowTime& b = row_times_[std::min(row + 1, row_times_.size() - 1)];
    const double part = w.sensor.height > 1 ? position - static_cast<double>(row) : 0;
    const auto between = [&](Time from, Time to) {
        return from + std::llround(part * static_cast<double>(to - from));
    };
    out.row = {between(a.reset, b.reset), between(a.read, b.read)};
    return out;
}

} // namespace obscura::renderer
