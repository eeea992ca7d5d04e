// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/projection_program.hpp"

#include "models/kinds/projection_starts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace obscura::models {
namespace {

constexpr double not_seen = std::numeric_limits<double>::quiet_NaN();
/// Lanes of one call of a program, whose starts lie on the stack.
constexpr std::size_t block_lanes = Program::max_lanes;

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

std::array<double, 3> unit_or(const std::array<double, 3>& v, const std::array<double, 3>& otherwise) {
    const double length = std::sqrt(dot(v, v));
    if (!(length > 1e-6)) return otherwise;
    return {v[0] / length, v[1] / length, v[2] / length};
}

StartTable sensor_table(const SensorPlane& plane) {
    const double before = -0.5 - plane.margin_px, after = plane.margin_px - 0.5;
    return {{before, before}, {plane.width + after, plane.height + after}};
}

/// Middles of the cells, where a table is least exact: whole packets of them.
std::vector<std::array<double, 2>> middles_of(const StartTable& table) {
    constexpr std::size_t cells = StartTable::side - 1;
    static_assert(cells * cells % Program::lane_step == 0);
    std::vector<std::array<double, 2>> middles;
    for (std::size_t i = 0; i < cells * cells; ++i) {
        const std::size_t index = i / cells * StartTable::side + i % cells;
        const std::array<double, 2> a = table.place(index), b = table.place(index + StartTable::side + 1);
        middles.push_back({(a[0] + b[0]) / 2, (a[1] + b[1]) / 2});
    }
    return middles;
}

} // namespace

ProjectionProgram::ProjectionProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters,
                                     const SensorPlane& plane)
    : model_(std::move(model)), plane_(plane) {
    const bool has_point = model_->function("point") != nullptr;
    const bool has_ray = model_->function("ray") != nullptr;
    if (has_point) point_ = bound(point_graph(*model_, parameters, plane), 3, "point", parameters);
    if (has_ray) rays_ = bound(ray_graph(*model_, parameters, plane), 2, "ray", parameters);
    if (model_->function("transmission") != nullptr)
        transmission_ = bound(transmission_graph(*model_, parameters, plane), 3, "transmission", parameters);
    if (!has_ray) find_directions(parameters);
    if (has_ray) find_points(parameters);
}

BoundProgram ProjectionProgram::bound(const ProjectionGraph& graph, std::int32_t inputs,
                                      std::string_view function, const ModelParameters& parameters) const {
    return bound_program(*model_, model_->function(function)->at, graph.graph, graph.outputs,
                         uniform_values(parameters), inputs, parameters.target);
}

void ProjectionProgram::find_field_of(const StartTable& directions, const std::vector<bool>& seen) {
    blind_ = std::none_of(seen.begin(), seen.end(), [](bool s) { return s; });
    if (blind_) return;
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < seen.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            if (seen[i]) sum[k] += directions.node(i)[k];
    axis_ = unit_or(sum, axis_);
    const std::array<double, 3> helper =
        std::fabs(axis_[0]) < 0.9 ? std::array<double, 3>{1, 0, 0} : std::array<double, 3>{0, 1, 0};
    const double along = dot(helper, axis_);
    right_ = unit_or(
        {helper[0] - along * axis_[0], helper[1] - along * axis_[1], helper[2] - along * axis_[2]}, right_);
    down_ = {axis_[1] * right_[2] - axis_[2] * right_[1], axis_[2] * right_[0] - axis_[0] * right_[2],
             axis_[0] * right_[1] - axis_[1] * right_[0]};
    // The rim of the field lies up to a cell beyond the last node that sees.
    double angle = 0, cell = 0;
    bool all = true;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        all = all && seen[i];
        if (!seen[i]) continue;
        angle = std::max(angle, std::acos(std::clamp(dot(axis_, directions.node(i)), -1.0, 1.0)));
        if (i + 1 < seen.size() && (i + 1) % StartTable::side != 0 && seen[i + 1])
            cell = std::max(
                cell, std::acos(std::clamp(dot(directions.node(i), directions.node(i + 1)), -1.0, 1.0)));
    }
    min_cosine_ = std::cos(std::min(angle + (all ? cell / 8 : cell), std::acos(-1.0)));
}

void ProjectionProgram::find_directions(const ModelParameters& parameters) {
    directions_ = sensor_table(plane_);
    ModelParameters interpreted = parameters;
    interpreted.target = NativeTarget::none;
    const auto inverse = [&](int steps, const ModelParameters& p) {
        return bound(inverse_point_graph(*model_, p, plane_, steps), 5, "point", p);
    };
    const BoundProgram stay = inverse(0, interpreted), step = inverse(1, interpreted);
    const std::vector<bool> seen = fill_directions(directions_, *this, {stay, step});
    find_field_of(directions_, seen);
    std::array<std::vector<double>, 5> inputs;
    for (const std::array<double, 2>& place : middles_of(directions_)) {
        const std::array<double, 3> start = directions_.at(place[0], place[1]);
        for (std::size_t k = 0; k < inputs.size(); ++k)
            inputs[k].push_back(k < 2 ? place[k] : start[k - 2]);
    }
    rays_ = with_least_steps(inverse, inputs, parameters);
}

BoundProgram
ProjectionProgram::with_least_steps(const std::function<BoundProgram(int, const ModelParameters&)>& inverse,
                                    const std::array<std::vector<double>, 5>& inputs,
                                    const ModelParameters& parameters) {
    ModelParameters interpreted = parameters;
    interpreted.target = NativeTarget::none;
    const std::size_t lanes = inputs[0].size();
    std::array<const double*, 5> in{};
    for (std::size_t k = 0; k < inputs.size(); ++k)
        in[k] = inputs[k].data();
    std::array<std::vector<double>, 5> rows;
    for (std::vector<double>& row : rows)
        row.resize(lanes);
    // The last output is the squared distance.
    const auto squares_after = [&](int steps) {
        const BoundProgram bound = inverse(steps, interpreted);
        std::array<double*, 5> out{};
        for (std::size_t k = 0; k < rows.size(); ++k)
            out[k] = rows[k].data();
        bound.program->run(bound.uniforms, in.data(), out.data(), lanes);
        return rows[bound.program->outputs() - 1];
    };
    const double tolerance = plane_.tolerance_px() * plane_.tolerance_px();
    // Far below the tolerance: elsewhere in a cell the distance may be some times that in its middle.
    const double wanted_px = 1e-11 + plane_.rounding_px();
    const std::vector<double> last = squares_after(max_newton_steps);
    for (steps_ = 2; steps_ < max_newton_steps; ++steps_) {
        const std::vector<double> now = squares_after(steps_);
        bool enough = true;
        for (std::size_t i = 0; i < lanes; ++i)
            enough = enough && (!(last[i] < tolerance) || now[i] < wanted_px * wanted_px);
        if (enough) break;
    }
    return inverse(steps_, parameters);
}

void ProjectionProgram::find_points(const ModelParameters& parameters) {
    StartTable directions = sensor_table(plane_);
    constexpr std::size_t nodes = StartTable::side * StartTable::side;
    constexpr std::size_t lanes = (nodes + Program::lane_step - 1) / Program::lane_step * Program::lane_step;
    std::array<std::vector<double>, 6> rows;
    for (std::vector<double>& row : rows)
        row.assign(lanes, 0);
    for (std::size_t i = 0; i < nodes; ++i)
        for (std::size_t k = 0; k < 2; ++k)
            rows[k][i] = directions.place(i)[k];
    rays(rows[0].data(), rows[1].data(), {rows[2].data(), rows[3].data(), rows[4].data()}, rows[5].data(),
         lanes);
    std::vector<bool> seen;
    for (std::size_t i = 0; i < nodes; ++i) {
        directions.node(i) = {rows[2][i], rows[3][i], rows[4][i]};
        seen.push_back(rows[5][i] != 0);
    }
    find_field_of(directions, seen);
    if (model_->function("point") != nullptr || blind_) {
        directions_ = {};
        return;
    }
    std::array<double, 2> least{1e9, 1e9}, most{-1e9, -1e9};
    std::vector<std::array<double, 2>> charted(nodes);
    for (std::size_t i = 0; i < nodes; ++i) {
        if (!seen[i]) continue;
        const std::array<double, 3>& d = directions.node(i);
        charted[i] = chart(d[0], d[1], d[2]);
        for (std::size_t k = 0; k < 2; ++k) {
            least[k] = std::min(least[k], charted[i][k]);
            most[k] = std::max(most[k], charted[i][k]);
        }
    }
    for (std::size_t k = 0; k < 2; ++k)
        most[k] = std::max(most[k], least[k] + 1e-12);
    points_ = StartTable(least, most);
    for (std::size_t node = 0; node < nodes; ++node) {
        const auto [u, v] = points_.place(node);
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < nodes; ++i) {
            const double x = charted[i][0] - u, y = charted[i][1] - v;
            if (seen[i] && x * x + y * y < nearest) {
                nearest = x * x + y * y;
                points_.node(node) = {directions.place(i)[0], directions.place(i)[1], 0};
            }
        }
    }
    // Directions of the middles of the cells of the sensor.
    const std::vector<std::array<double, 2>> middles = middles_of(directions);
    for (std::size_t i = 0; i < middles.size(); ++i)
        for (std::size_t k = 0; k < 2; ++k)
            rows[k][i] = middles[i][k];
    rays(rows[0].data(), rows[1].data(), {rows[2].data(), rows[3].data(), rows[4].data()}, rows[5].data(),
         middles.size());
    std::array<std::vector<double>, 5> inputs;
    for (std::size_t i = 0; i < middles.size(); ++i) {
        const auto [u, v] = chart(rows[2][i], rows[3][i], rows[4][i]);
        const std::array<double, 3> start = points_.at(u, v);
        for (std::size_t k = 0; k < inputs.size(); ++k)
            inputs[k].push_back(k < 3 ? rows[2 + k][i] : start[k - 3]);
    }
    const auto inverse = [&](int steps, const ModelParameters& p) {
        return bound(inverse_ray_graph(*model_, p, plane_, steps), 5, "ray", p);
    };
    point_ = with_least_steps(inverse, inputs, parameters);
}

std::array<double, 2> ProjectionProgram::chart(double x, double y, double z) const noexcept {
    const double length = std::sqrt(x * x + y * y + z * z);
    const double along = (axis_[0] * x + axis_[1] * y + axis_[2] * z) / length;
    const double scale = std::sqrt(2 / std::max(1 + along, 1e-12)) / length;
    return {scale * (right_[0] * x + right_[1] * y + right_[2] * z),
            scale * (down_[0] * x + down_[1] * y + down_[2] * z)};
}

void ProjectionProgram::rays(const double* x, const double* y, const std::array<double*, 3>& direction,
                             double* solid_angle_sr, std::size_t lanes) const noexcept {
    for (std::size_t first = 0; first < lanes; first += block_lanes) {
        const std::size_t count = std::min(block_lanes, lanes - first);
        std::array<double*, 5> outputs{direction[0] + first, direction[1] + first, direction[2] + first,
                                       solid_angle_sr + first, nullptr};
        if (directions_.empty()) {
            const std::array<const double*, 2> inputs{x + first, y + first};
            rays_.program->run(rays_.uniforms, inputs.data(), outputs.data(), count);
            for (std::size_t i = first; i < first + count; ++i)
                if (!(solid_angle_sr[i] != 0)) nearest_to_axis(direction, i);
            continue;
        }
        std::array<std::array<double, block_lanes>, 4> rows;
        for (std::size_t i = 0; i < count; ++i) {
            const std::array<double, 3> start = directions_.at(x[first + i], y[first + i]);
            for (std::size_t k = 0; k < 3; ++k)
                rows[k][i] = start[k];
        }
        const std::array<const double*, 5> inputs{x + first, y + first, rows[0].data(), rows[1].data(),
                                                  rows[2].data()};
        outputs[4] = rows[3].data();
        rays_.program->run(rays_.uniforms, inputs.data(), outputs.data(), count);
        for (std::size_t i = 0; i < count; ++i)
            if (solid_angle_sr[first + i] == 0) {
                const std::array<double, 3> near = unit_or({rows[0][i], rows[1][i], rows[2][i]}, axis_);
                for (std::size_t k = 0; k < 3; ++k)
                    direction[k][first + i] = near[k];
            }
    }
}

void ProjectionProgram::nearest_to_axis(const std::array<double*, 3>& direction,
                                        std::size_t lane) const noexcept {
    const std::array<double, 3> d{direction[0][lane], direction[1][lane], direction[2][lane]};
    const bool known = std::isfinite(d[0]) && std::isfinite(d[1]) && std::isfinite(d[2]);
    const std::array<double, 3> near = known ? unit_or(d, axis_) : axis_;
    for (std::size_t k = 0; k < 3; ++k)
        direction[k][lane] = near[k];
}

void ProjectionProgram::project_any(const DirectionRows& d, double* x, double* y,
                                    std::size_t lanes) const noexcept {
    for (std::size_t first = 0; first < lanes; first += block_lanes) {
        const std::size_t count = std::min(block_lanes, lanes - first);
        std::array<std::array<double, block_lanes>, 3> rows;
        std::array<const double*, 5> inputs{d.x + first, d.y + first, d.z + first, nullptr, nullptr};
        const std::array<double*, 3> outputs{x + first, y + first, rows[2].data()};
        if (!points_.empty()) {
            for (std::size_t i = 0; i < count; ++i) {
                const auto [u, v] = chart(d.x[first + i], d.y[first + i], d.z[first + i]);
                const std::array<double, 3> start = points_.at(u, v);
                rows[0][i] = start[0];
                rows[1][i] = start[1];
            }
            inputs[3] = rows[0].data();
            inputs[4] = rows[1].data();
        }
        if (point_.program == nullptr) {
            std::fill_n(x + first, count, not_seen);
            std::fill_n(y + first, count, not_seen);
            continue;
        }
        point_.program->run(point_.uniforms, inputs.data(), outputs.data(), count);
    }
}

void ProjectionProgram::project(const DirectionRows& d, double* x, double* y,
                                std::size_t lanes) const noexcept {
    project_any(d, x, y, lanes);
    for (std::size_t i = 0; i < lanes; ++i) {
        const double length = std::sqrt(d.x[i] * d.x[i] + d.y[i] * d.y[i] + d.z[i] * d.z[i]);
        const double along = axis_[0] * d.x[i] + axis_[1] * d.y[i] + axis_[2] * d.z[i];
        const bool inside = along >= min_cosine_ * length && std::isfinite(x[i]) && std::isfinite(y[i]);
        x[i] = inside ? x[i] : not_seen;
        y[i] = inside ? y[i] : not_seen;
    }
}

void ProjectionProgram::transmission(const DirectionRows& d, double* fraction,
                                     std::size_t lanes) const noexcept {
    if (!has_transmission()) {
        std::fill_n(fraction, lanes, 1.0);
        return;
    }
    const std::array<const double*, 3> inputs{d.x, d.y, d.z};
    transmission_.program->run(transmission_.uniforms, inputs.data(), &fraction, lanes);
}

} // namespace obscura::models
