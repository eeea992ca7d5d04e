// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/shape_program.hpp"

#include "models/graph/derivative.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace obscura::models {
namespace {

constexpr std::string_view outside_name = "outside", height_name = "height", radius_name = "bound_radius",
                           claim_name = "lipschitz";

/// Cells this near to the axis of longitudes, in radii, have slopes of height() that intervals cannot bound.
constexpr double axis_share = 0.02;

double claim_in(const Model& model) {
    for (const Property& property : model.properties())
        if (property.name == claim_name) {
            if (!(property.value > 0))
                refuse(model, property.at, "the property 'lipschitz' is a slope, greater than 0");
            return property.value;
        }
    return 0;
}

} // namespace

ShapeProgram::ShapeProgram(std::shared_ptr<const Model> model, const ShapeParameters& parameters)
    : model_(std::move(model)),
      function_(model_->function(outside_name) != nullptr ? outside_name : height_name),
      claimed_slope_(claim_in(*model_)) {
    const std::vector<double> uniforms = uniform_values(parameters);
    Graph graph;
    NodeId value = 0;
    if (function_ == outside_name) {
        radius_m_ = radius_of_text(parameters);
        value = lowered(*model_, *model_->function(function_), parameters, 3, graph,
                        {vector_value({graph.input(0), graph.input(1), graph.input(2)})})
                    .nodes[0];
    } else {
        value = graph_of_heights(graph, parameters, uniforms);
    }
    // The derivatives are nodes of the same graph: bounds need the value alone.
    const Graph plain = graph;
    std::array<NodeId, 4> outputs{value, 0, 0, 0};
    for (std::int32_t k = 0; k < 3; ++k)
        outputs[static_cast<std::size_t>(k) + 1] =
            derivatives(graph, std::array{value}, {{k, graph.constant(1)}})[0];
    bound_ = bound_program(*model_, place(), graph, outputs, uniforms, 3, parameters.target);
    parameters.target.make([&] { bound_slopes(plain, value, uniforms); });
}

double ShapeProgram::radius_of_text(const ShapeParameters& parameters) const {
    const Function* const f = model_->function(radius_name);
    if (f == nullptr)
        refuse(
            *model_, place(),
            fmt::format("{}() needs a function scalar {}() beside it: the radius of a ball about the origin "
                        "that has the surface, m",
                        function_, radius_name));
    Graph graph;
    const Value radius = lowered(*model_, *f, parameters, 0, graph, {});
    const BoundProgram bound = bound_program(*model_, f->at, graph, std::array{radius.nodes[0]},
                                             uniform_values(parameters), 0, Execution{NativeTarget::none});
    std::array<double, Program::lane_step> lanes{};
    double* const out = lanes.data();
    bound.program->run(bound.uniforms, nullptr, &out, lanes.size());
    constexpr double least = 1e-6, most = 1e12;
    if (!(lanes[0] >= least && lanes[0] <= most))
        refuse(*model_, f->at,
               fmt::format("{}() is {:g} m: allowed {:g} to {:g}", radius_name, lanes[0], least, most));
    return lanes[0];
}

NodeId ShapeProgram::graph_of_heights(Graph& graph, const ShapeParameters& parameters,
                                      std::span<const double> uniforms) {
    const Function& f = *model_->function(height_name);
    const auto number = [&](double x) { return graph.constant(x); };
    const auto apply = [&](Operation op, NodeId a, NodeId b = -1) { return graph.apply(op, a, b); };
    // Heights over all longitudes and latitudes.
    Graph flat;
    const std::vector<Value> angles{scalar_value(flat.input(0)), scalar_value(flat.input(1))};
    const NodeId alone = lowered(*model_, f, parameters, 2, flat, angles).nodes[0];
    constexpr double pi = std::numbers::pi;
    SlopeBounder bounder(flat, alone, uniforms);
    constexpr int parts = 64; // a tighter bound than that over all at once
    Interval heights{};
    for (int i = 0; i < parts; ++i)
        for (int k = 0; k < parts; ++k) {
            const Interval h =
                bounder
                    .over({Interval{pi * (2.0 * i / parts - 1), pi * (2.0 * (i + 1) / parts - 1)},
                           Interval{pi * (k / double{parts} - 0.5), pi * ((k + 1) / double{parts} - 0.5)},
                           Interval{}})
                    .value;
            heights = i == 0 && k == 0 ? h : hull(heights, h);
        }
    const Vec3 r = parameters.radii_m;
    const double least = std::min({r.x, r.y, r.z}), most = std::max({r.x, r.y, r.z});
    if (!(least > 0)) refuse(*model_, f.at, "height() needs the ellipsoid that it counts from: radii_m");
    if (!heights.is_finite() || heights.magnitude() > 1e12) refuse(*model_, f.at, "height() has no bound");
    core_m_ = least + heights.lo;
    if (!(core_m_ > 0))
        refuse(*model_, f.at,
               fmt::format("height() is as low as {:.6g} m: allowed are heights above {:.6g} m, minus the "
                           "least of radii_m",
                           heights.lo, -least));
    radius_m_ = model_->function(radius_name) != nullptr ? radius_of_text(parameters)
                                                         : (most + heights.hi) * (1 + 1e-9);
    axis_m_ = axis_share * radius_m_;
    const NodeId x = graph.input(0), y = graph.input(1), z = graph.input(2);
    const auto squared = [&](NodeId a) { return apply(Operation::multiply, a, a); };
    const auto root = [&](NodeId a) { return apply(Operation::square_root, a); };
    const auto sum = [&](NodeId a, NodeId b) { return apply(Operation::add, a, b); };
    const NodeId across = root(sum(squared(x), squared(y)));
    const NodeId longitude = apply(Operation::arc_tangent_2, y, x);
    const NodeId latitude = apply(Operation::arc_tangent_2, z, across);
    const NodeId distance = root(sum(sum(squared(x), squared(y)), squared(z)));
    NodeId ellipsoid = number(r.x);
    if (!(r.x == r.y && r.y == r.z)) {
        const auto scaled = [&](NodeId a, double radius) {
            return squared(apply(Operation::multiply, a, number(1 / radius)));
        };
        const NodeId scale = root(sum(sum(scaled(x, r.x), scaled(y, r.y)), scaled(z, r.z)));
        ellipsoid = apply(Operation::divide, distance, scale);
    }
    const NodeId height =
        lowered(*model_, f, parameters, 3, graph, {scalar_value(longitude), scalar_value(latitude)}).nodes[0];
    return apply(Operation::subtract, apply(Operation::subtract, distance, ellipsoid), height);
}

void ShapeProgram::measure_slopes(const std::array<Interval, 3>& box, SlopeBounds& bounds) const {
    constexpr std::size_t points = Program::max_lanes;
    constexpr std::size_t across = 5; // and 3 more points that are of no use
    std::array<std::array<double, points>, 3> place{};
    std::array<std::array<double, points>, 4> rows{};
    for (std::size_t i = 0; i < points; ++i) {
        const std::array<std::size_t, 3> at{i % across, i / across % across,
                                            std::min(i / across / across, across - 1)};
        for (std::size_t k = 0; k < 3; ++k)
            place[k][i] = box[k].lo + (box[k].hi - box[k].lo) * static_cast<double>(at[k]) / (across - 1);
    }
    run({place[0].data(), place[1].data(), place[2].data()},
        {rows[0].data(), rows[1].data(), rows[2].data(), rows[3].data()}, points);
    double most = 0;
    for (std::size_t i = 0; i < points; ++i) {
        const double slope = std::hypot(rows[1][i], rows[2][i], rows[3][i]);
        if (std::isfinite(slope)) most = std::max(most, slope);
    }
    bounds.gradient.fill({-2 * most, 2 * most});
    bounds.bends_up = bounds.bends_down = true;
}

void ShapeProgram::bound_slopes(const Graph& graph, NodeId value, std::span<const double> uniforms) {
    if (claimed_slope_ > 0) {
        ShapeCell everywhere;
        everywhere.max_slope = claimed_slope_;
        everywhere.gradient.fill({-claimed_slope_, claimed_slope_});
        everywhere.bends_up = everywhere.bends_down = true;
        cells_ = std::make_unique<ShapeCells>(everywhere);
        return;
    }
    SlopeBounder bounder(graph, value, uniforms);
    const auto bound_over = [&](const std::array<Interval, 3>& box, Vec3 middle) {
        SlopeBounds bounds = bounder.over(box);
        if (core_m_ > 0) {
            const double far = std::sqrt(square(box[0]).hi + square(box[1]).hi + square(box[2]).hi);
            if (far < core_m_) bounds.value = {-radius_m_, -std::numeric_limits<double>::min()};
        }
        const double edge = box[0].hi - box[0].lo;
        const bool on_axis = std::hypot(middle.x, middle.y) < axis_m_ + edge;
        if (on_axis && !std::isfinite(bounds.max_slope()) && edge < axis_m_) measure_slopes(box, bounds);
        return bounds;
    };
    cells_ = std::make_unique<ShapeCells>(radius_m_, bound_over);
    if (cells_->is_unbounded()) {
        const Vec3 p = cells_->unbounded_at();
        refuse(
            *model_, place(),
            fmt::format("the slope of {}() has no bound near ({:.6g}, {:.6g}, {:.6g}) m, where the surface "
                        "may be: guard a divisor or a root that is 0 there",
                        function_, p.x, p.y, p.z));
    }
}

} // namespace obscura::models
