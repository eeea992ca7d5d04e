// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/scan_pass.hpp"

#include "renderer/integrators/aovs.hpp"
#include "renderer/passes/row_set_up.hpp"
#include "renderer/world/exposure.hpp"

#include <algorithm>

namespace obscura::renderer {

std::optional<RowTime> common_time(const BuiltScene& built, std::span<const RowTime> pixels) {
    RowTime first = pixels[0], last = pixels[0];
    for (const RowTime& t : pixels) {
        if (t.exposure_ns() != first.exposure_ns()) return std::nullopt;
        if (t.reset < first.reset) first = t;
        if (t.reset > last.reset) last = t;
    }
    if (first == last) return first;
    if (motion_px(built.scene, built.bodies, *built.lens, built.splatter.reach_px(),
                  {first.mid(), last.mid()}) > max_part_motion_px)
        return std::nullopt;
    const Time reset = midpoint(first.reset, last.reset);
    return RowTime{reset, reset + first.exposure_ns()};
}

void fill_spans(const PassRequest& request, RowBlock& rows) {
    rows.spans.clear();
    for (std::int32_t r = 0; r < request.rows; ++r)
        rows.spans.push_back(request.pixel_times.span_of(request.sensor_y(r)));
}

RenderedRow render_scanned_row(const BuiltScene& built, const PassRequest& request, const RowBlock& rows,
                               std::int32_t r, std::span<float> irradiance, Scratch& s) {
    const auto width = static_cast<std::size_t>(request.window.width);
    const std::int32_t y = request.sensor_y(r);
    if (rows.wings) {
        s.wing_light.assign(width * built.channels(), 0);
        rows.wings->add(static_cast<std::size_t>(r), s.wing_light, s.wing_row);
    }
    RenderedRow whole;
    for_parts(built, request.pixel_times, request.window.x, request.window.width, y,
              [&](std::int32_t first, std::int32_t end, const RowTime& time) {
                  const auto at = static_cast<std::size_t>(first - request.window.x);
                  const auto columns = static_cast<std::size_t>(end - first);
                  PassRequest part = request;
                  part.pixel_times = {};
                  part.window.x = first;
                  part.window.width = end - first;
                  part.first_row = request.first_row + r;
                  part.rows = part.plane_rows = 1;
                  part.row_times = {&time, 1};
                  part.part = {r, static_cast<std::int32_t>(at), request.window.width};
                  const auto of_row = [&](std::span<float> plane) {
                      return plane.empty() ? plane
                                           : plane.subspan(static_cast<std::size_t>(r) * width + at, columns);
                  };
                  part.samples = of_row(request.samples);
                  part.variance = of_row(request.variance);
                  s.scanned.resize(built.scene.bands.size() * columns);
                  const RenderedRow how = render_row(built, part, rows, 0, s.scanned, s);
                  for (std::size_t b = 0; b < built.scene.bands.size(); ++b)
                      std::copy_n(s.scanned.data() + b * columns, columns,
                                  irradiance.data() +
                                      (b * static_cast<std::size_t>(request.rows_of_plane()) +
                                       static_cast<std::size_t>(r)) *
                                          width +
                                      at);
                  whole.instants = std::max(whole.instants, how.instants);
              });
    return whole;
}

void trace_scanned_aovs(const BuiltScene& built, const RenderRequest& request, std::int32_t r,
                        std::span<float> aovs, Scratch& s) {
    const std::size_t plane =
        static_cast<std::size_t>(request.rows) * static_cast<std::size_t>(request.window.width);
    const std::int32_t y = request.window.y + request.first_row + r;
    for_parts(built, request.pixel_times, request.window.x, request.window.width, y,
              [&](std::int32_t first, std::int32_t end, const RowTime& time) {
                  const RowState& row = begin_row(built, to_seconds(time.mid().ns), s);
                  trace_aovs(*s.lens, row, first, y, end - first, built.pixel_width_rad(), s.candidates,
                             aovs.data() +
                                 static_cast<std::size_t>(r) *
                                     static_cast<std::size_t>(request.window.width) +
                                 static_cast<std::size_t>(first - request.window.x),
                             plane);
              });
}

} // namespace obscura::renderer
