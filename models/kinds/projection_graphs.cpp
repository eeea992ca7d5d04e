// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/projection_graphs.hpp"

#include "models/graph/derivative.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace obscura::models {
namespace {

struct PlaneNodes {
    NodeId x, y;
};
struct SpaceNodes {
    NodeId x, y, z;
};

/// Vector arithmetic on nodes.
class NodeMath {
public:
    explicit NodeMath(Graph& graph) : g(graph) {}

    NodeId number(double v) const { return g.constant(v); }
    NodeId add(NodeId a, NodeId b) const { return g.apply(Operation::add, a, b); }
    NodeId sub(NodeId a, NodeId b) const { return g.apply(Operation::subtract, a, b); }
    NodeId mul(NodeId a, NodeId b) const { return g.apply(Operation::multiply, a, b); }
    NodeId div(NodeId a, NodeId b) const { return g.apply(Operation::divide, a, b); }
    NodeId negative(NodeId a) const { return g.apply(Operation::negate, a); }
    NodeId absolute(NodeId a) const { return g.apply(Operation::absolute, a); }
    NodeId root(NodeId a) const { return g.apply(Operation::square_root, a); }
    NodeId less(NodeId a, NodeId b) const { return g.apply(Operation::less, a, b); }
    NodeId both(NodeId a, NodeId b) const { return g.apply(Operation::both, a, b); }
    NodeId chosen(NodeId when, NodeId a, NodeId b) const { return g.apply(Operation::select, when, a, b); }

    NodeId cross(PlaneNodes a, PlaneNodes b) const { return sub(mul(a.x, b.y), mul(a.y, b.x)); }
    NodeId square(PlaneNodes a) const { return add(mul(a.x, a.x), mul(a.y, a.y)); }
    PlaneNodes sub(PlaneNodes a, PlaneNodes b) const { return {sub(a.x, b.x), sub(a.y, b.y)}; }

    NodeId dot(SpaceNodes a, SpaceNodes b) const {
        return add(add(mul(a.x, b.x), mul(a.y, b.y)), mul(a.z, b.z));
    }
    SpaceNodes add(SpaceNodes a, SpaceNodes b) const { return {add(a.x, b.x), add(a.y, b.y), add(a.z, b.z)}; }
    SpaceNodes scaled(SpaceNodes a, NodeId s) const { return {mul(a.x, s), mul(a.y, s), mul(a.z, s)}; }
    SpaceNodes cross(SpaceNodes a, SpaceNodes b) const {
        return {sub(mul(a.y, b.z), mul(a.z, b.y)), sub(mul(a.z, b.x), mul(a.x, b.z)),
                sub(mul(a.x, b.y), mul(a.y, b.x))};
    }
    SpaceNodes unit(SpaceNodes a) const {
        const NodeId length = root(dot(a, a));
        return {div(a.x, length), div(a.y, length), div(a.z, length)};
    }
    /// Two unit vectors at right angles to the unit vector `n`: Duff et al., Building an Orthonormal Basis,
    /// Revisited, JCGT 6 (2017).
    std::pair<SpaceNodes, SpaceNodes> basis(SpaceNodes n) const {
        const NodeId one = number(1);
        const NodeId sign = chosen(less(n.z, number(0)), number(-1), one);
        const NodeId t = div(number(-1), add(sign, n.z));
        const NodeId u = mul(mul(n.x, n.y), t);
        return {{add(one, mul(sign, mul(mul(n.x, n.x), t))), mul(sign, u), negative(mul(sign, n.x))},
                {u, add(sign, mul(mul(n.y, n.y), t)), negative(n.y)}};
    }

    /// Focal plane at an image point.
    PlaneNodes on_plane(const SensorPlane& plane, PlaneNodes pixel) const {
        const auto coordinate = [&](std::size_t k) {
            return add(number(plane.first_m[k]),
                       add(mul(number(plane.column_m[k]), pixel.x), mul(number(plane.row_m[k]), pixel.y)));
        };
        return {coordinate(0), coordinate(1)};
    }
    /// Image point of a point in the focal plane.
    PlaneNodes in_pixels(const SensorPlane& plane, PlaneNodes p) const {
        const double determinant = plane.column_m[0] * plane.row_m[1] - plane.column_m[1] * plane.row_m[0];
        const PlaneNodes from = sub(p, {number(plane.first_m[0]), number(plane.first_m[1])});
        const auto combined = [&](double x, double y) {
            return add(mul(number(x / determinant), from.x), mul(number(y / determinant), from.y));
        };
        return {combined(plane.row_m[1], -plane.row_m[0]), combined(-plane.column_m[1], plane.column_m[0])};
    }

    Graph& g;
};

/// A function of the model as a graph of its own, with the rates of its result: inputs are the components of
/// its argument, then their rates; outputs are the components of the result, then their rates.
ProjectionGraph with_rates(const Model& model, std::string_view name, const ModelParameters& parameters,
                           const SensorPlane& plane) {
    ProjectionGraph made;
    Graph& g = made.graph;
    const Function& function = *model.function(name);
    const int count = components(function.arguments[0].type);
    Value argument{function.arguments[0].type, {}};
    argument.nodes.fill(-1);
    for (int k = 0; k < count; ++k)
        argument.nodes[static_cast<std::size_t>(k)] = g.input(k);
    Surroundings surroundings;
    surroundings.constants = {{"focal_length", scalar_value(g.constant(plane.focal_length_m))}};
    // Directions are of unit length.
    if (count == 3) surroundings.is_unit = [argument](const Value& v) { return v == argument; };
    const Value result = lowered(model, function, parameters, 2 * count, g, {argument}, surroundings);
    std::map<std::int32_t, NodeId> rates;
    for (int k = 0; k < count; ++k)
        rates[k] = g.input(count + k);
    made.outputs.assign(result.nodes.begin(), result.nodes.begin() + components(result.type));
    const std::vector<NodeId> more = derivatives(g, made.outputs, rates);
    made.outputs.insert(made.outputs.end(), more.begin(), more.end());
    return made;
}

/// point() at a direction, and its rates along two directions.
struct PointNodes {
    PlaneNodes point, along_a, along_b;
};
PointNodes point_nodes(Graph& graph, const ProjectionGraph& function, SpaceNodes d, SpaceNodes a,
                       SpaceNodes b) {
    const auto insert = [&](SpaceNodes rate) {
        return inserted(graph, function.graph, function.outputs,
                        std::array<NodeId, 6>{d.x, d.y, d.z, rate.x, rate.y, rate.z});
    };
    const std::vector<NodeId> first = insert(a), second = insert(b);
    return {{first[0], first[1]}, {first[2], first[3]}, {second[2], second[3]}};
}

/// ray() at a point of the focal plane, and its rates from a pixel to the next ones.
struct RayNodes {
    SpaceNodes ray, column, row;
    NodeId determinant;
};
RayNodes ray_nodes(Graph& graph, const ProjectionGraph& function, const SensorPlane& plane,
                   PlaneNodes pixel) {
    const NodeMath m(graph);
    const PlaneNodes p = m.on_plane(plane, pixel);
    const auto insert = [&](const std::array<double, 2>& rate) {
        return inserted(graph, function.graph, function.outputs,
                        std::array<NodeId, 4>{p.x, p.y, m.number(rate[0]), m.number(rate[1])});
    };
    const std::vector<NodeId> a = insert(plane.column_m), b = insert(plane.row_m);
    RayNodes nodes{{a[0], a[1], a[2]}, {a[3], a[4], a[5]}, {b[3], b[4], b[5]}, -1};
    nodes.determinant = m.dot(nodes.ray, m.cross(nodes.column, nodes.row));
    return nodes;
}

SpaceNodes direction_inputs(Graph& g, std::int32_t first) {
    return {g.input(first), g.input(first + 1), g.input(first + 2)};
}

} // namespace

double SensorPlane::pixel_m2() const {
    return std::fabs(column_m[0] * row_m[1] - column_m[1] * row_m[0]);
}

double SensorPlane::rounding_px() const {
    return 4 * std::numeric_limits<double>::epsilon() * focal_length_m / std::sqrt(pixel_m2());
}

ProjectionGraph point_graph(const Model& model, const ModelParameters& parameters, const SensorPlane& plane) {
    const ProjectionGraph function = with_rates(model, "point", parameters, plane);
    ProjectionGraph made;
    const NodeMath m(made.graph);
    const SpaceNodes d = m.unit(direction_inputs(made.graph, 0));
    const NodeId zero = m.number(0);
    const std::vector<NodeId> p = inserted(made.graph, function.graph, std::span(function.outputs).first(2),
                                           std::array<NodeId, 6>{d.x, d.y, d.z, zero, zero, zero});
    const PlaneNodes pixel = m.in_pixels(plane, {p[0], p[1]});
    made.outputs = {pixel.x, pixel.y};
    return made;
}

ProjectionGraph inverse_point_graph(const Model& model, const ModelParameters& parameters,
                                    const SensorPlane& plane, int steps) {
    const ProjectionGraph function = with_rates(model, "point", parameters, plane);
    ProjectionGraph made;
    Graph& g = made.graph;
    const NodeMath m(g);
    const PlaneNodes wanted = m.on_plane(plane, {g.input(0), g.input(1)});
    SpaceNodes d = m.unit(direction_inputs(g, 2));
    for (int step = 0;; ++step) {
        const auto [a, b] = m.basis(d);
        const PointNodes at = point_nodes(g, function, d, a, b);
        const PlaneNodes error = m.sub(wanted, at.point);
        const NodeId determinant = m.cross(at.along_a, at.along_b);
        if (step == steps) {
            const NodeId squared = m.div(m.square(error), m.number(plane.pixel_m2()));
            const double tolerance = plane.tolerance_px();
            const NodeId solid_angle = m.div(m.number(plane.pixel_m2()), determinant);
            const NodeId seen =
                m.both(m.less(squared, m.number(tolerance * tolerance)),
                       m.less(m.absolute(solid_angle), m.number(std::numeric_limits<double>::infinity())));
            made.outputs = {d.x, d.y, d.z, m.chosen(seen, solid_angle, m.number(0)), squared};
            return made;
        }
        const NodeId by_a = m.div(m.cross(error, at.along_b), determinant);
        const NodeId by_b = m.div(m.cross(at.along_a, error), determinant);
        d = m.unit(m.add(d, m.add(m.scaled(a, by_a), m.scaled(b, by_b))));
    }
}

ProjectionGraph ray_graph(const Model& model, const ModelParameters& parameters, const SensorPlane& plane) {
    const ProjectionGraph function = with_rates(model, "ray", parameters, plane);
    ProjectionGraph made;
    Graph& g = made.graph;
    const NodeMath m(g);
    const RayNodes at = ray_nodes(g, function, plane, {g.input(0), g.input(1)});
    const NodeId length = m.root(m.dot(at.ray, at.ray));
    // The triple product over the cube of the length: vectors of any length.
    const NodeId solid_angle = m.div(m.div(m.div(at.determinant, length), length), length);
    const NodeId finite = m.less(m.absolute(solid_angle), m.number(std::numeric_limits<double>::infinity()));
    made.outputs = {m.div(at.ray.x, length), m.div(at.ray.y, length), m.div(at.ray.z, length),
                    m.chosen(finite, solid_angle, m.number(0))};
    return made;
}

ProjectionGraph inverse_ray_graph(const Model& model, const ModelParameters& parameters,
                                  const SensorPlane& plane, int steps) {
    const ProjectionGraph function = with_rates(model, "ray", parameters, plane);
    ProjectionGraph made;
    Graph& g = made.graph;
    const NodeMath m(g);
    const SpaceNodes wanted = m.unit(direction_inputs(g, 0));
    PlaneNodes pixel{g.input(3), g.input(4)};
    for (int step = 0;; ++step) {
        // ray + column x + row y is `wanted` times some number: Cramer's rule.
        const RayNodes at = ray_nodes(g, function, plane, pixel);
        const PlaneNodes by{m.div(m.dot(wanted, m.cross(at.row, at.ray)), at.determinant),
                            m.div(m.dot(wanted, m.cross(at.ray, at.column)), at.determinant)};
        // `by` is for a `wanted` as long as the ray along itself.
        const NodeId along = m.div(m.dot(wanted, m.cross(at.column, at.row)), at.determinant);
        const PlaneNodes correction{m.div(by.x, along), m.div(by.y, along)};
        if (step == steps) {
            const NodeId squared = m.square(correction);
            const double tolerance = plane.tolerance_px();
            const NodeId found = m.both(m.less(squared, m.number(tolerance * tolerance)),
                                        m.less(m.number(0), m.dot(wanted, at.ray)));
            const NodeId none = m.number(std::numeric_limits<double>::quiet_NaN());
            made.outputs = {m.chosen(found, pixel.x, none), m.chosen(found, pixel.y, none), squared};
            return made;
        }
        pixel = {m.add(pixel.x, correction.x), m.add(pixel.y, correction.y)};
    }
}

ProjectionGraph transmission_graph(const Model& model, const ModelParameters& parameters,
                                   const SensorPlane& plane) {
    const ProjectionGraph function = with_rates(model, "transmission", parameters, plane);
    ProjectionGraph made;
    const NodeMath m(made.graph);
    const SpaceNodes d = m.unit(direction_inputs(made.graph, 0));
    const NodeId zero = m.number(0);
    made.outputs = inserted(made.graph, function.graph, std::span(function.outputs).first(1),
                            std::array<NodeId, 6>{d.x, d.y, d.z, zero, zero, zero});
    return made;
}

} // namespace obscura::models
