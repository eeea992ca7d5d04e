// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/projection_starts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace obscura::models {
namespace {

using Direction = std::array<double, 3>;
using ImagePlace = std::array<double, 2>;

constexpr std::size_t side = StartTable::side;
constexpr int max_iterations = 40;

std::size_t padded(std::size_t count) {
    return (count + Program::lane_step - 1) / Program::lane_step * Program::lane_step;
}

Direction unit(const Direction& d) {
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    return {d[0] / length, d[1] / length, d[2] / length};
}

/// Directions after Newton's steps of a program, the squared distances of their points, px^2, and the solid
/// angles of pixels there; 0: they do not see the point, or have no derivative.
struct Stepped {
    std::vector<Direction> direction;
    std::vector<double> squared, solid_angle;
};
Stepped stepped(const BoundProgram& bound, const std::vector<ImagePlace>& points,
                const std::vector<Direction>& from) {
    const std::size_t lanes = padded(points.size());
    std::array<std::vector<double>, 5> in, out;
    std::array<const double*, 5> inputs{};
    std::array<double*, 5> outputs{};
    for (std::size_t k = 0; k < in.size(); ++k) {
        in[k].assign(lanes, k == 4 ? 1 : 0);
        out[k].resize(lanes);
        for (std::size_t i = 0; i < points.size(); ++i)
            in[k][i] = k < 2 ? points[i][k] : from[i][k - 2];
        inputs[k] = in[k].data();
        outputs[k] = out[k].data();
    }
    bound.program->run(bound.uniforms, inputs.data(), outputs.data(), lanes);
    Stepped result;
    for (std::size_t i = 0; i < points.size(); ++i) {
        result.direction.push_back({out[0][i], out[1][i], out[2][i]});
        result.squared.push_back(out[4][i]);
        result.solid_angle.push_back(out[3][i]);
    }
    return result;
}

/// Newton's method with steps that are halved until the distance falls.
std::vector<bool> solve(const StepPrograms& programs, double tolerance_px,
                        const std::vector<ImagePlace>& points, std::vector<Direction>& directions) {
    const double enough = tolerance_px * tolerance_px;
    std::vector<double> squared = stepped(programs.stay, points, directions).squared;
    for (int i = 0; i < max_iterations; ++i) {
        std::vector<std::size_t> open;
        std::vector<ImagePlace> wanted;
        std::vector<Direction> from;
        for (std::size_t k = 0; k < points.size(); ++k)
            if (std::isfinite(squared[k]) && !(squared[k] < enough)) {
                open.push_back(k);
                wanted.push_back(points[k]);
                from.push_back(directions[k]);
            }
        if (open.empty()) break;
        Stepped next = stepped(programs.step, wanted, from);
        const std::vector<Direction> full = next.direction;
        for (double part = 0.5;; part /= 2) {
            bool again = false;
            for (std::size_t k = 0; k < open.size(); ++k) {
                const std::size_t index = open[k];
                if (next.squared[k] < squared[index]) continue;
                again = true;
                Direction d{};
                for (std::size_t c = 0; c < 3; ++c)
                    d[c] = from[k][c] + part * (full[k][c] - from[k][c]);
                next.direction[k] = unit(d);
            }
            if (!again || part < 1e-3) break;
            next.squared = stepped(programs.stay, wanted, next.direction).squared;
        }
        for (std::size_t k = 0; k < open.size(); ++k) {
            if (!(next.squared[k] < squared[open[k]])) {
                squared[open[k]] = std::numeric_limits<double>::infinity(); // no step helps
                continue;
            }
            directions[open[k]] = next.direction[k];
            squared[open[k]] = next.squared[k];
        }
    }
    std::vector<bool> found;
    for (const double solid_angle : stepped(programs.stay, points, directions).solid_angle)
        found.push_back(solid_angle != 0);
    return found;
}

/// Directions in rings about the boresight and the direction behind, closer and closer: those of narrow
/// fields, too.
std::vector<Direction> sampled_directions() {
    constexpr int rings = 66, per_ring = 16;
    std::vector<Direction> directions{{0, 0, 1}};
    for (int ring = 0; ring < rings; ++ring)
        for (const double sign : {1.0, -1.0})
            for (int k = 0; k < per_ring; ++k) {
                const double angle = 0.5 * std::numbers::pi * std::exp2(-ring / 3.0);
                const double azimuth = 2 * std::numbers::pi * (k + 0.5 * (ring % 2)) / per_ring;
                directions.push_back({std::sin(angle) * std::cos(azimuth),
                                      std::sin(angle) * std::sin(azimuth), sign * std::cos(angle)});
            }
    return directions;
}

std::vector<ImagePlace> image_places(const ProjectionProgram& projection,
                                     const std::vector<Direction>& directions) {
    const std::size_t lanes = padded(directions.size());
    std::array<std::vector<double>, 5> rows;
    for (std::vector<double>& row : rows)
        row.assign(lanes, 1);
    for (std::size_t i = 0; i < directions.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            rows[k][i] = directions[i][k];
    projection.project_any({rows[0].data(), rows[1].data(), rows[2].data()}, rows[3].data(), rows[4].data(),
                           lanes);
    std::vector<ImagePlace> places;
    for (std::size_t i = 0; i < directions.size(); ++i)
        places.push_back({rows[3][i], rows[4][i]});
    return places;
}

/// Calls f with each of the up to eight neighbours of a node.
template<typename F>
void for_neighbours(std::size_t index, F f) {
    const auto column = static_cast<int>(index % side), row = static_cast<int>(index / side);
    for (int y = row - 1; y <= row + 1; ++y)
        for (int x = column - 1; x <= column + 1; ++x)
            if ((x != column || y != row) && x >= 0 && y >= 0 && x < static_cast<int>(side) &&
                y < static_cast<int>(side))
                f(static_cast<std::size_t>(y) * side + static_cast<std::size_t>(x));
}

/// Finds a first node; gives its index, or the number of nodes.
std::size_t find_first(StartTable& table, const ProjectionProgram& projection, const StepPrograms& programs) {
    const SensorPlane& plane = projection.plane();
    const std::vector<Direction> directions = sampled_directions();
    const std::vector<ImagePlace> places = image_places(projection, directions);
    struct Candidate {
        double outside, angle; ///< distance to the sensor, px
        std::size_t index;
    };
    std::vector<Candidate> candidates;
    for (std::size_t i = 0; i < directions.size(); ++i) {
        const auto [x, y] = places[i];
        if (!std::isfinite(x) || !std::isfinite(y)) continue;
        const double beside = std::max({-0.5 - x, x - plane.width + 0.5, 0.0});
        const double above = std::max({-0.5 - y, y - plane.height + 0.5, 0.0});
        candidates.push_back({std::hypot(beside, above), std::acos(directions[i][2]), i});
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return a.outside != b.outside ? a.outside < b.outside
                                      : (a.angle != b.angle ? a.angle < b.angle : a.index < b.index);
    });
    std::vector<int> tried(side * side, 0);
    const std::array<double, 2> first = table.place(0), second = table.place(side + 1);
    for (const Candidate& candidate : candidates) {
        std::array<std::size_t, 2> node{};
        for (std::size_t k = 0; k < 2; ++k) {
            const double steps = (places[candidate.index][k] - first[k]) / (second[k] - first[k]);
            node[k] = static_cast<std::size_t>(std::clamp(std::round(steps), 1.0, side - 2.0));
        }
        const std::size_t index = node[1] * side + node[0];
        // Where the function has no derivative, all that is near fails.
        if (++tried[index] > 2) continue;
        std::vector<Direction> d{directions[candidate.index]};
        if (solve(programs, plane.tolerance_px(), {table.place(index)}, d)[0]) {
            table.node(index) = d[0];
            return index;
        }
    }
    return side * side;
}

} // namespace

void spread(StartTable& table, std::vector<bool> known) {
    if (std::none_of(known.begin(), known.end(), [](bool k) { return k; })) return;
    for (bool changed = true; changed;) {
        changed = false;
        std::vector<bool> next = known;
        for (std::size_t i = 0; i < known.size(); ++i) {
            if (known[i]) continue;
            std::array<double, 3> sum{};
            int count = 0;
            for_neighbours(i, [&](std::size_t neighbour) {
                if (!known[neighbour]) return;
                ++count;
                for (std::size_t k = 0; k < 3; ++k)
                    sum[k] += table.node(neighbour)[k];
            });
            if (count == 0) continue;
            for (std::size_t k = 0; k < 3; ++k)
                table.node(i)[k] = sum[k] / count;
            next[i] = true;
            changed = true;
        }
        known = std::move(next);
    }
}

std::vector<bool> fill_directions(StartTable& table, const ProjectionProgram& projection,
                                  const StepPrograms& programs) {
    std::vector<bool> found(side * side, false);
    const std::size_t first = find_first(table, projection, programs);
    if (first == found.size()) return found;
    found[first] = true;
    std::vector<std::size_t> front{first};
    while (!front.empty()) {
        // Each node beside the front, from each of its neighbours there, until one leads to it.
        std::vector<std::size_t> nodes;
        std::vector<ImagePlace> points;
        std::vector<Direction> directions;
        for (const std::size_t from : front)
            for_neighbours(from, [&](std::size_t index) {
                if (found[index]) return;
                nodes.push_back(index);
                points.push_back(table.place(index));
                directions.push_back(table.node(from));
            });
        const std::vector<bool> solved =
            solve(programs, projection.plane().tolerance_px(), points, directions);
        front.clear();
        for (std::size_t i = 0; i < nodes.size(); ++i)
            if (solved[i] && !found[nodes[i]]) {
                found[nodes[i]] = true;
                table.node(nodes[i]) = directions[i];
                front.push_back(nodes[i]);
            }
    }
    spread(table, found);
    return found;
}

} // namespace obscura::models
