// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/reprojection_pass.hpp"

#include "renderer/passes/row_set_up.hpp"
#include "renderer/passes/row_tracer.hpp"
#include "renderer/reprojection/resample.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Sets Scratch::variance of a row that was taken from an earlier frame: bounds of what resampling, the light
/// of another time, hidden places and, of repeated rows, motion make wrong; without the error of the earlier
/// frame itself.
void bound_variance(const BuiltScene& built, const KeptImage& image, std::int32_t y, QualityLevel level,
                    std::size_t channels, const RowState& now, Scratch& s) {
    // Share of the second difference that is lost along an axis, mean over the places between pixels
    // (measured by reprojection_test.cpp).
    constexpr double resampled = 0.06;
    // Brightness over the cosine of incidence at which its change by the angle is typical.
    constexpr double slope = 2;
    const KeptView::Change change = image.views_about(y).first->change_to(now, *built.lens, built.field_rad);
    const bool moved = level == QualityLevel::reprojected;
    const auto width = static_cast<std::ptrdiff_t>(s.variance.size());
    const auto light = [&](std::ptrdiff_t x) {
        double sum = 0;
        for (std::size_t c = 0; c < channels; ++c)
            sum += s.light[c * s.variance.size() +
                           static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(x, 0, width - 1))];
        return sum / static_cast<double>(channels);
    };
    double before = light(0);
    double here = before;
    for (std::ptrdiff_t x = 0; x < width; ++x) {
        const double next = light(x + 1);
        double error = slope * change.sun_rad * here;
        if (moved)
            error = std::hypot(error, std::sqrt(2.0) * resampled * (before - 2 * here + next));
        else
            error +=
                std::min(here, change.motion_px * std::max(std::abs(next - here), std::abs(here - before)));
        const auto pixel = static_cast<std::size_t>(x);
        if (moved && s.motion_of_row.filled[s.motion_of_row.first + pixel] != 0) error = here;
        s.variance[pixel] = here > 0 ? std::max(error * error, least_variance) : 0;
        before = here;
        here = next;
    }
}

} // namespace

bool fill_motion(const RowScheduler& workers, const PassRequest& request, const std::atomic<bool>* cancel,
                 const RowBlock& rows) {
    const auto asks = [&](std::int32_t r) { return request.level_of(r) == QualityLevel::reprojected; };
    std::int32_t first = 0;
    while (first < request.rows && !asks(first))
        ++first;
    if (first == request.rows) return true;
    std::int32_t last = request.rows - 1;
    while (!asks(last))
        --last;
    return fill_motion(workers, request, first, last, cancel, rows);
}

bool fill_motion(const RowScheduler& workers, const PassRequest& request, std::int32_t first,
                 std::int32_t last, const std::atomic<bool>* cancel, const RowBlock& rows) {
    const BuiltScene& built = workers.built();
    KeptLight& from = *request.from_light;
    const KeptImage& image = request.from_window().image;
    MotionGrid& motion = request.from_window().motion;
    const std::int32_t top = request.kept_y(0);
    const bool whole = !request.frame_times.empty();
    const std::span<const RowTime> times = whole ? request.frame_times : request.row_times;
    const std::int32_t times_y = !whole ? top : request.line ? 0 : request.frame_y;
    const auto middle_of = [&](std::int32_t y) {
        const auto end = static_cast<std::int32_t>(times.size()) - 1;
        const std::int32_t at = std::clamp(y - times_y, 0, end);
        const Time mid = times[static_cast<std::size_t>(at)].mid();
        // Lines follow each other at their rate, beyond the last one, too.
        const std::int64_t beyond = request.line && end > 0 ? y - times_y - at : 0;
        return mid + beyond * (times.back().mid() - times.front().mid()) / std::max(end, 1);
    };
    const auto trace = [&](std::int32_t y, Scratch& s, const auto& use) {
        const Time mid = middle_of(y);
        begin_rows(built, rows.request, Exposure{RowTime{mid, mid}, 1}, s, s.middle);
        const RowState& row = s.middle.rows[0];
        set_lens(built, row.beta, s);
        with_tracer(built, row, s, [&](Tracer& tracer) {
            use(MotionGrid::View{*s.lens, *built.lens, row, mid, tracer, s.candidates, image});
        });
    };
    // Each step on the rows about those of the step after it.
    const std::int32_t begin = motion.cell_row_of(top + first);
    const std::int32_t end = motion.cell_row_of(top + last) + 1;
    const auto step = [&](MotionGrid::Step which, std::int32_t margin, const auto& fill) {
        from.motion_jobs.clear();
        for (std::int32_t r = std::max(0, begin - margin); r <= std::min(motion.cell_rows(), end + margin);
             ++r)
            if (motion.done(r) < which) from.motion_jobs.push_back(r);
        return workers.for_rows(RenderPart::grid, static_cast<std::int32_t>(from.motion_jobs.size()),
                                request.of, cancel, [&](std::int32_t job, Scratch& s) {
                                    const std::int32_t r = from.motion_jobs[static_cast<std::size_t>(job)];
                                    fill(r, s);
                                    motion.done(r) = which;
                                });
    };
    return step(MotionGrid::Step::corners, 3,
                [&](std::int32_t r, Scratch& s) {
                    trace(motion.y_of(r), s, [&](const MotionGrid::View& v) { motion.trace_corners(r, v); });
                }) &&
           step(MotionGrid::Step::inner, 1,
                [&](std::int32_t r, Scratch& s) {
                    for (std::int32_t fine = 0; fine < MotionGrid::fine_cells; ++fine)
                        if (motion.has_inner(r, fine))
                            trace(motion.y_of(r, fine), s,
                                  [&](const MotionGrid::View& v) { motion.trace_inner(r, fine, v); });
                }) &&
           step(MotionGrid::Step::joined, 0, [&](std::int32_t r, Scratch&) { motion.join(r); });
}

void take_earlier(const BuiltScene& built, const PassRequest& request, std::int32_t y, QualityLevel level,
                  std::size_t channels, const RowState& now, Scratch& s) {
    s.add_sampled(0, request.window.width, request.window.width);
    const KeptLight::Window& from = request.from_window();
    const KeptImage& image = from.image;
    const Region& area = image.area();
    const auto width = static_cast<std::size_t>(area.width);
    const std::int32_t row = std::clamp(y - area.y, 0, area.height - 1);
    if (level == QualityLevel::repeated) {
        for (std::size_t c = 0; c < channels; ++c)
            std::copy_n(image.plane(c) + static_cast<std::size_t>(row) * width, width,
                        s.light.begin() + static_cast<std::ptrdiff_t>(c * width));
    } else {
        MotionGrid::Row& motion = s.motion_of_row;
        from.motion.take(y, image.lit(), motion);
        s.filled += static_cast<std::uint64_t>(motion.filled_count);
        for (std::size_t cell = 0; cell < motion.dark.size(); ++cell) {
            if (motion.dark[cell] != 0) continue;
            const std::size_t begin = std::max(cell * MotionGrid::cell_px, motion.first);
            const std::size_t end = std::min((cell + 1) * MotionGrid::cell_px, motion.first + width);
            const auto part = [&](const std::vector<float>& v) {
                return std::span(v).subspan(begin, end - begin);
            };
            const std::size_t x = begin - motion.first;
            for (std::size_t c = 0; c < channels; ++c)
                resample_row({image.plane(c), area.width, area.height}, static_cast<std::int32_t>(x), row,
                             part(motion.dx), part(motion.dy), part(motion.gain),
                             s.light.data() + c * width + x);
        }
    }
    if (!request.samples.empty()) {
        const std::size_t at = static_cast<std::size_t>(s.row) * width;
        constexpr float share = 1.0F / (MotionGrid::cell_px * MotionGrid::cell_px);
        for (std::size_t x = 0; x < width; ++x)
            if (has_light(s.light, x, width)) request.samples[at + x] = share;
    }
    if (!request.variance.empty()) bound_variance(built, image, y, level, channels, now, s);
}

void keep_light(const BuiltScene& built, const PassRequest& request, std::int32_t y, const Exposure& when,
                Scratch& s) {
    KeptImage& image = request.keep_window().image;
    image.keep_row(y, s.light);
    // Makes room for the rows that are made of it, on each thread once.
    s.motion_of_row.resize(static_cast<std::size_t>(request.window.width));
    if (s.middle.rows.empty()) begin_row(built, to_seconds(when.row.mid().ns), s, s.middle, 0, 1);
    if (!image.wants_view(y)) return;
    const Time mid = when.row.mid();
    image.set_view(y, mid,
                   when.instants == 1 ? s.whole.rows[0]
                                      : begin_row(built, to_seconds(mid.ns), s, s.middle, 0, 1));
}

} // namespace obscura::renderer
