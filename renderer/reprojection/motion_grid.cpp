// SPDX-License-Identifier: Apache-2.0
#include "renderer/reprojection/motion_grid.hpp"

#include "renderer/integrators/near_bodies.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace obscura::renderer {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

/// A body is in front of another whose range is larger by this factor.
constexpr float behind = 1.000'1F;

/// Nodes about a node that may belong to a nearer body, in fine steps; further ones for the sky, where the
/// light of the point spread function is all there is.
constexpr std::int32_t edge_reach = 1, sky_reach = 4;
/// For corners of the sky, in cells.
constexpr std::int32_t sky_corner_reach = 2;

/// Largest displacement: further is outside in any case.
constexpr double max_px = 1e5;

/// Displacements that differ by more, from that of the node's own surface: it was hidden.
constexpr float hidden_px = 0.5F;

/// A point is in the line of a push-broom sensor if it is as close to it; so close, nothing is to be sought.
constexpr double in_line_px = 0.01, found_px = 1e-4;
/// Slower images do not say in which line a point that is in another place was.
constexpr double min_px_per_line = 0.1;

std::int32_t multiple_below(std::int32_t v, std::int32_t of) {
    return v - ((v % of) + of) % of;
}

float within(double px) {
    return static_cast<float>(std::clamp(px, -max_px, max_px));
}

float gain_of(double weight_sr, double from_sr) {
    return from_sr > 0 && weight_sr > 0 ? static_cast<float>(weight_sr / from_sr) : 1.0F;
}

/// Image, in an earlier view, of a point of a body, body frame, or of a direction of the sky.
std::optional<ImagePoint> seen(const MotionGrid::View& view, const KeptView& then, std::int32_t body,
                               Vec3 point, double& weight_sr) {
    if (body < 0) return then.project(view.own_lens, then.camera_from_inertial * point, weight_sr);
    const KeptView::Body& b = then.bodies[static_cast<std::size_t>(body)];
    return then.project(view.own_lens, b.to_camera(point - b.camera_m), weight_sr);
}

} // namespace

MotionGrid::Memory::Memory(std::size_t width, std::size_t rows, std::size_t grids) {
    // A window that begins within a cell covers one more.
    const std::size_t nodes = (width / fine_px + 10) * (rows / fine_px + 13 * grids);
    const std::size_t cell_rows = rows / cell_px + 3 * grids + 1;
    body_.resize(nodes);
    range_.resize(nodes);
    own_.resize(nodes);
    joined_.resize(nodes);
    done_.resize(cell_rows);
    hits_.resize(cell_rows);
    largest_.resize(cell_rows);
}

bool MotionGrid::place(const KeptWindow& window, Memory& memory) {
    area_ = window.area;
    lines_ = window.line_y.has_value();
    first_x_ = multiple_below(area_.x, cell_px);
    first_y_ = multiple_below(area_.y, cell_px);
    cells_ = (area_.x + area_.width - first_x_ + cell_px - 1) / cell_px;
    cell_rows_ = (area_.y + area_.height - first_y_ + cell_px - 1) / cell_px;
    columns_ = cells_ * fine_cells + 1;
    rows_ = (cell_rows_ + 1) * fine_cells;
    const std::size_t nodes = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    const std::size_t cell_rows = static_cast<std::size_t>(cell_rows_) + 1;
    if (nodes > memory.body_.size() - memory.nodes_taken_ ||
        cell_rows > memory.done_.size() - memory.cell_rows_taken_)
        return false;
    const auto take = [](auto& from, std::size_t taken, std::size_t count) {
        return std::span(from).subspan(taken, count);
    };
    body_ = take(memory.body_, memory.nodes_taken_, nodes);
    range_ = take(memory.range_, memory.nodes_taken_, nodes);
    own_ = take(memory.own_, memory.nodes_taken_, nodes);
    joined_ = take(memory.joined_, memory.nodes_taken_, nodes);
    done_ = take(memory.done_, memory.cell_rows_taken_, cell_rows);
    hits_ = take(memory.hits_, memory.cell_rows_taken_, cell_rows);
    largest_ = take(memory.largest_, memory.cell_rows_taken_, cell_rows);
    memory.nodes_taken_ += nodes;
    memory.cell_rows_taken_ += cell_rows;
    restart();
    return true;
}

void MotionGrid::restart() {
    std::fill(done_.begin(), done_.end(), Step::none);
    std::fill(hits_.begin(), hits_.end(), std::uint8_t{0});
    std::fill(largest_.begin(), largest_.end(), -1.0F);
}

MotionGrid::Motion MotionGrid::motion_of(const View& view, std::int32_t body, Vec3 direction, double t_m,
                                         double weight_sr, double x, double y) {
    Vec3 point = view.row.inertial_from_camera * direction;
    if (body >= 0) {
        const BodyState& b = view.row.bodies[static_cast<std::size_t>(body)];
        point = b.camera_m + (b.from_camera * (t_m * direction) + t_m * b.beta);
    }
    if (view.from.window().line_y) return line_motion_of(view, body, point, weight_sr, x, y);
    double weight = 0;
    double source_x = x;
    double source_y = y;
    // Where rows have different times, that of the source follows from where it is.
    for (int step = 0; step < 2; ++step) {
        const KeptImage::Between then = view.from.views_about(source_y);
        const std::optional<ImagePoint> first = seen(view, *then.first, body, point, weight);
        if (!first) return {0, 0, 0, max_px};
        source_x = first->x;
        source_y = first->y;
        if (then.first == then.second) break;
        const std::optional<ImagePoint> second = seen(view, *then.second, body, point, weight);
        if (!second) return {0, 0, 0, max_px};
        source_x += then.share * (second->x - first->x);
        source_y += then.share * (second->y - first->y);
    }
    return {within(source_x - x), within(source_y - y), gain_of(weight_sr, weight),
            within(std::hypot(source_x - x, source_y - y))};
}

MotionGrid::Motion MotionGrid::line_motion_of(const View& view, std::int32_t body, Vec3 point,
                                              double weight_sr, double x, double y) {
    constexpr Motion unknown{0, 0, 0, infinity};
    const double line_y = *view.from.window().line_y;
    double weight = 0;
    struct Seen {
        double x, y, y_per_line;
    };
    const auto seen_in = [&](double line) -> std::optional<Seen> {
        const KeptImage::Between then = view.from.views_about(line);
        const std::optional<ImagePoint> first = seen(view, *then.first, body, point, weight);
        const std::optional<ImagePoint> second = seen(view, *then.second, body, point, weight);
        if (!first || !second) return std::nullopt;
        const double down = second->y - first->y;
        return Seen{first->x + then.share * (second->x - first->x), first->y + then.share * down,
                    down / view.from.view_step()};
    };
    const std::optional<Seen> here = seen_in(y);
    double line = view.from.line_at(view.mid, y);
    std::optional<Seen> there = seen_in(line);
    // By the same poses it was in that line. Others moved it along or across.
    for (int step = 0; step < 2 && there; ++step) {
        if (std::abs(there->y - line_y) < found_px || std::abs(there->y_per_line) < min_px_per_line) break;
        line += (line_y - there->y) / there->y_per_line;
        there = seen_in(line);
    }
    if (!here || !there || !(std::abs(there->y - line_y) <= in_line_px)) return unknown;
    return {within(there->x - x), within(line - y), gain_of(weight_sr, weight),
            within(std::hypot(here->x - x, here->y - line_y))};
}

void MotionGrid::trace(std::span<const std::int32_t> columns, std::int32_t row, const View& view) {
    const double y = first_y_ + row * fine_px;
    const double sensor_y = view.from.window().line_y.value_or(first_y_ + row * fine_px);
    for (std::size_t first = 0; first < columns.size(); first += packet_size) {
        const auto some = static_cast<int>(std::min<std::size_t>(packet_size, columns.size() - first));
        Doubles px;
        Doubles py;
        Lanes active;
        for (int i = 0; i < packet_size; ++i) {
            px[i] = first_x_ + columns[first + static_cast<std::size_t>(std::min(i, some - 1))] * fine_px;
            py[i] = sensor_y;
        }
        Vec3s direction;
        Doubles weight;
        view.lens.rays(px, py, direction, weight);
        for (int i = 0; i < packet_size; ++i)
            active.on[i] = i < some && weight[i] > 0 ? -1 : 0;
        view.candidates.clear();
        Lanes near;
        for (std::size_t b = 0; b < view.row.bodies.size(); ++b)
            if (const BodyState& body = view.row.bodies[b];
                !body.targeted && near_axis(direction, body.direction, body.reach_chord2, near))
                view.candidates.push_back(static_cast<std::int32_t>(b));
        HitPacket hits;
        hits.clear();
        if (!view.candidates.empty()) view.tracer.intersect(direction, active, view.candidates, hits);
        for (int i = 0; i < some; ++i) {
            const std::size_t node = at(columns[first + static_cast<std::size_t>(i)], row);
            const bool hit = hits.body[i] >= 0;
            body_[node] = hit ? hits.body[i] : sky;
            range_[node] = hit ? static_cast<float>(hits.t[i]) : infinity;
            own_[node] = motion_of(view, body_[node], direction.lane(i), hits.t[i], weight[i], px[i], y);
        }
    }
}

void MotionGrid::trace_corners(std::int32_t r, const View& view) {
    const std::int32_t row = r * fine_cells;
    std::fill_n(body_.begin() + static_cast<std::ptrdiff_t>(at(0, row)),
                static_cast<std::ptrdiff_t>(columns_) * fine_cells, not_traced);
    std::array<std::int32_t, packet_size> columns{};
    std::uint8_t any = 0;
    for (std::int32_t cell = 0; cell <= cells_; cell += packet_size) {
        const std::int32_t some = std::min(packet_size, cells_ + 1 - cell);
        for (std::int32_t i = 0; i < some; ++i)
            columns[static_cast<std::size_t>(i)] = (cell + i) * fine_cells;
        trace(std::span(columns).first(static_cast<std::size_t>(some)), row, view);
        for (std::int32_t i = 0; i < some; ++i)
            any = any != 0 || body_[at((cell + i) * fine_cells, row)] >= 0 ? 1 : 0;
    }
    hits_[static_cast<std::size_t>(r)] = any;
}

bool MotionGrid::mixed(std::int32_t cell, std::int32_t cell_row) const {
    if (cell_row < 0 || cell_row >= cell_rows_) return false;
    const std::int32_t column = cell * fine_cells;
    const std::int32_t row = cell_row * fine_cells;
    const std::int32_t body = body_[at(column, row)];
    return body != body_[at(column + fine_cells, row)] || body != body_[at(column, row + fine_cells)] ||
           body != body_[at(column + fine_cells, row + fine_cells)];
}

bool MotionGrid::has_inner(std::int32_t r, std::int32_t fine_row) const {
    for (std::int32_t cell = 0; cell < cells_; ++cell)
        if (mixed(cell, r) || (fine_row == 0 && mixed(cell, r - 1))) return true;
    return false;
}

void MotionGrid::trace_inner(std::int32_t r, std::int32_t fine_row, const View& view) {
    const std::int32_t row = r * fine_cells + fine_row;
    std::array<std::int32_t, packet_size> columns{};
    std::size_t count = 0;
    const auto flush = [&] {
        trace(std::span(columns).first(count), row, view);
        count = 0;
    };
    for (std::int32_t cell = 0; cell < cells_; ++cell) {
        if (!mixed(cell, r) && !(fine_row == 0 && mixed(cell, r - 1))) continue;
        for (std::int32_t k = 0; k <= fine_cells; ++k) {
            const std::int32_t column = cell * fine_cells + k;
            const bool listed = count > 0 && columns[count - 1] == column;
            if (listed || body_[at(column, row)] != not_traced) continue;
            columns[count++] = column;
            if (count == columns.size()) flush();
        }
    }
    if (count > 0) flush();
}

void MotionGrid::join_node(std::int32_t column, std::int32_t row) {
    const std::size_t node = at(column, row);
    const std::int32_t body = body_[node];
    Target& target = joined_[node];
    target = {own_[node], 0, static_cast<std::uint8_t>(body >= 0 ? 1 : 0)};
    std::int32_t nearest = std::numeric_limits<std::int32_t>::max();
    std::int32_t nearer = not_traced;
    const auto look = [&](std::int32_t reach, std::int32_t step) {
        for (std::int32_t j = -reach; j <= reach; ++j)
            for (std::int32_t i = -reach; i <= reach; ++i) {
                const std::int32_t x = column + i * step;
                const std::int32_t y = row + j * step;
                if (x < 0 || x >= columns_ || y < 0 || y > cell_rows_ * fine_cells) continue;
                const std::size_t other = at(x, y);
                if (body_[other] < 0 || body_[other] == body || !(range_[other] * behind < range_[node]))
                    continue;
                if (i * i + j * j >= nearest) continue;
                nearest = i * i + j * j;
                nearer = body_[other];
                target.motion = own_[other];
                target.of_body = 1;
            }
        return nearest != std::numeric_limits<std::int32_t>::max();
    };
    if (look(body == sky ? sky_reach : edge_reach, 1)) {
        // It was hidden if the nearer body was there, which is now as far from there as that has moved.
        const float dx = own_[node].dx - target.motion.dx;
        const float dy = own_[node].dy - target.motion.dy;
        if (body != sky && std::hypot(dx, dy) > hidden_px) {
            const auto x = column + static_cast<std::int32_t>(std::lround(dx / fine_px));
            const auto y = row + static_cast<std::int32_t>(std::lround(dy / fine_px));
            const bool inside = x >= 0 && x < columns_ && y >= std::max(0, row - fine_cells) &&
                                y <= std::min(cell_rows_ * fine_cells, row + fine_cells);
            if (inside && body_[at(x, y)] == nearer) target.filled = 1;
        }
    } else if (body == sky && column % fine_cells == 0 && row % fine_cells == 0) {
        look(sky_corner_reach, fine_cells);
    }
    if (!(target.motion.gain > 0)) target.filled = 1;
}

void MotionGrid::join(std::int32_t r) {
    bool bodies = false;
    for (std::int32_t k = std::max(0, r - sky_corner_reach); k <= std::min(cell_rows_, r + sky_corner_reach);
         ++k)
        bodies = bodies || hits_[static_cast<std::size_t>(k)] != 0;
    for (std::int32_t row = r * fine_cells; row < (r + 1) * fine_cells; ++row)
        for (std::int32_t column = 0; column < columns_; ++column) {
            const std::size_t node = at(column, row);
            if (body_[node] == not_traced) continue;
            if (bodies)
                join_node(column, row);
            else
                joined_[node] = {own_[node], 0, 0};
        }
}

float MotionGrid::largest_px(std::int32_t y) {
    const std::int32_t r = cell_row_of(y);
    float& largest = largest_[static_cast<std::size_t>(r)];
    if (largest < 0) {
        largest = 0;
        for (std::size_t node = at(0, r * fine_cells); node < at(0, (r + 1) * fine_cells + 1); ++node)
            if (body_[node] != not_traced && joined_[node].of_body != 0)
                largest = std::max(largest, joined_[node].motion.px);
    }
    return lines_ && beyond_lines(y) ? infinity : largest;
}

/// Whether a body that line `y` sees was in a line before or after those of the earlier frame.
bool MotionGrid::beyond_lines(std::int32_t y) const {
    const std::int32_t r = cell_row_of(y);
    const float share = static_cast<float>(y - y_of(r)) / cell_px;
    constexpr float least = 0.01F;
    for (std::int32_t column = 0; column < columns_; column += fine_cells) {
        const Target& above = joined_[at(column, r * fine_cells)];
        const Target& below = joined_[at(column, (r + 1) * fine_cells)];
        if (above.of_body == 0 && below.of_body == 0) continue;
        const float line =
            static_cast<float>(y - area_.y) + above.motion.dy + share * (below.motion.dy - above.motion.dy);
        if (line < -least || line > static_cast<float>(area_.height - 1) + least) return true;
    }
    return false;
}

/// Nodes of a row of pixels: interpolated between two rows of nodes.
struct MotionGrid::Line {
    const Target* above;
    const Target* below;
    float share;

    [[nodiscard]] Motion at(std::size_t column) const {
        const Motion& a = above[column].motion;
        const Motion& b = below[column].motion;
        return {a.dx + share * (b.dx - a.dx), a.dy + share * (b.dy - a.dy),
                a.gain + share * (b.gain - a.gain)};
    }
    [[nodiscard]] bool filled(std::size_t column) const {
        return above[column].filled != 0 || below[column].filled != 0;
    }
    /// Motion of `step` pixels from `pixel` on, between two nodes.
    template<std::int32_t step>
    void interpolate(std::size_t pixel, Row& row) const;
    /// Bounds of the motion of a cell, by its nodes: those inside of it, too, or its corners.
    struct Bounds {
        Motion least, most;
    };
    [[nodiscard]] Bounds bounds(std::int32_t cell, bool inner_nodes) const;
};

template<std::int32_t step>
void MotionGrid::Line::interpolate(std::size_t pixel, Row& row) const {
    const std::size_t column = pixel / fine_px;
    const std::size_t next = column + step / fine_px;
    const Motion a = at(column);
    const Motion b = at(next);
    float* const dx = &row.dx[pixel];
    float* const dy = &row.dy[pixel];
    float* const gain = &row.gain[pixel];
    for (std::int32_t i = 0; i < step; ++i) {
        const float fraction = static_cast<float>(i) / static_cast<float>(step);
        dx[i] = a.dx + fraction * (b.dx - a.dx);
        dy[i] = a.dy + fraction * (b.dy - a.dy);
        gain[i] = a.gain + fraction * (b.gain - a.gain);
    }
    if (filled(column) || filled(next)) std::fill_n(&row.filled[pixel], step, std::uint8_t{1});
}

MotionGrid::Line::Bounds MotionGrid::Line::bounds(std::int32_t cell, bool inner_nodes) const {
    const auto first = static_cast<std::size_t>(cell) * static_cast<std::size_t>(fine_cells);
    Motion least = at(first);
    Motion most = least;
    for (std::size_t k = 1; k <= fine_cells; ++k) {
        if (!inner_nodes && k < fine_cells) continue;
        const Motion m = at(first + k);
        least = {std::min(least.dx, m.dx), std::min(least.dy, m.dy)};
        most = {std::max(most.dx, m.dx), std::max(most.dy, m.dy)};
    }
    return {least, most};
}

void MotionGrid::Row::resize(std::size_t width) {
    const std::size_t cells = width / cell_px + 2;
    for (std::vector<float>* v : {&dx, &dy, &gain})
        v->resize(cells * cell_px);
    filled.resize(cells * cell_px);
    dark.resize(cells);
}

void MotionGrid::take(std::int32_t y, std::span<const LitColumns> lit, Row& row) const {
    row.resize(static_cast<std::size_t>(area_.width));
    row.filled.assign(row.dx.size(), 0);
    row.dark.assign(static_cast<std::size_t>(cells_), 0);
    row.first = static_cast<std::size_t>(area_.x - first_x_);
    row.filled_count = 0;
    const std::int32_t r = cell_row_of(y);
    const std::int32_t down = y - y_of(r);
    const std::int32_t fine = down / fine_px;
    const auto line = [&](std::int32_t first, std::int32_t step, std::int32_t px) {
        return Line{joined_.data() + at(0, first), joined_.data() + at(0, first + step),
                    static_cast<float>(px) / static_cast<float>(step * fine_px)};
    };
    const Line corners = line(r * fine_cells, fine_cells, down);
    const Line inner = line(r * fine_cells + fine, 1, down - fine * fine_px);
    const auto right = static_cast<float>(area_.width - 1);
    const auto top = static_cast<float>(area_.y - y);
    const float bottom = top + static_cast<float>(area_.height - 1);
    for (std::int32_t cell = 0; cell < cells_; ++cell) {
        const auto pixel = static_cast<std::size_t>(cell * cell_px);
        const bool inner_nodes = mixed(cell, r);
        // Where the pixels of the cell were, at most.
        const Line& from = inner_nodes ? inner : corners;
        const auto [least, most] = from.bounds(cell, inner_nodes);
        const float begin_x = static_cast<float>(pixel) - static_cast<float>(row.first) + least.dx;
        const float end_x = static_cast<float>(pixel) - static_cast<float>(row.first) + cell_px + most.dx;
        const auto whole = [&](float v, std::int32_t limit) {
            return static_cast<std::int32_t>(std::clamp(v, 0.0F, static_cast<float>(limit)));
        };
        bool dark = true;
        for (std::int32_t k = whole(least.dy - top - resample_reach, area_.height - 1);
             k <= whole(most.dy - top + resample_reach, area_.height - 1); ++k) {
            const LitColumns& columns = lit[static_cast<std::size_t>(k)];
            dark = dark && (columns.first > whole(end_x + resample_reach, area_.width - 1) ||
                            columns.end <= whole(begin_x - resample_reach, area_.width - 1));
        }
        if (dark) {
            row.dark[static_cast<std::size_t>(cell)] = 1;
            continue;
        }
        if (!inner_nodes)
            corners.interpolate<cell_px>(pixel, row);
        else
            for (std::size_t k = 0; k < cell_px; k += fine_px)
                inner.interpolate<fine_px>(pixel + k, row);
        const bool outside = begin_x < 0 || end_x > right || least.dy < top || most.dy > bottom;
        for (std::size_t p = std::max(pixel, row.first); p < pixel + cell_px; ++p) {
            const auto x = static_cast<float>(p - row.first);
            if (x > right) break;
            const float sx = x + row.dx[p];
            if (outside &&
                (sx < -0.5F || sx > right + 0.5F || row.dy[p] < top - 0.5F || row.dy[p] > bottom + 0.5F))
                row.filled[p] = 1;
            row.filled_count += row.filled[p];
        }
    }
}

} // namespace obscura::renderer
