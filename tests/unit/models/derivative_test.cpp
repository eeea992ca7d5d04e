// SPDX-License-Identifier: Apache-2.0
#include "models/graph/derivative.hpp"
#include "models/program/program.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace derivative_test {

using namespace obscura;
using namespace obscura::models;

namespace {

/// Value of a node for three inputs.
double value_at(const Graph& graph, NodeId id, std::array<double, 3> inputs) {
    const Program program(graph, std::span(&id, 1));
    constexpr std::size_t lanes = Program::lane_step;
    std::array<std::array<double, lanes>, 3> rows;
    for (std::size_t k = 0; k < rows.size(); ++k)
        rows[k].fill(inputs[k]);
    const std::array<const double*, 3> in{rows[0].data(), rows[1].data(), rows[2].data()};
    std::array<double, lanes> result{};
    double* out = result.data();
    program.run(program.bind({}), in.data(), &out, lanes);
    return result[3];
}

/// The node that has the rate of `id` when input k grows with speed[k].
NodeId rate_of(Graph& graph, NodeId id, std::array<double, 3> speed) {
    std::map<std::int32_t, NodeId> rates;
    for (std::int32_t k = 0; k < 3; ++k)
        rates[k] = graph.constant(speed[static_cast<std::size_t>(k)]);
    return derivatives(graph, std::span(&id, 1), rates).front();
}

/// Central difference of `id` along `speed`.
double difference_at(const Graph& graph, NodeId id, std::array<double, 3> at, std::array<double, 3> speed) {
    constexpr double h = 1e-6;
    std::array<double, 3> more = at, less = at;
    for (std::size_t k = 0; k < 3; ++k) {
        more[k] += h * speed[k];
        less[k] -= h * speed[k];
    }
    return (value_at(graph, id, more) - value_at(graph, id, less)) / (2 * h);
}

} // namespace

TEST_CASE("derivatives of every operation are those of central differences", "[models]") {
    // Values where every operation has a derivative: roots and logarithms of positive numbers, arc sines
    // below 1, powers of positive numbers.
    constexpr std::array<std::array<double, 3>, 5> places{
        {{0.3, 0.7, 0.2}, {0.81, 0.45, -0.4}, {0.12, 0.93, 1.7}, {0.62, 0.35, -2.2}, {0.07, 0.11, 0.9}}};
    constexpr std::array<std::array<double, 3>, 4> speeds{
        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6, -0.8, 0.3}}};
    for (std::size_t row = 3; row < operation_table.size(); ++row) {
        const auto operation = static_cast<Operation>(row);
        for (const auto& place : places)
            for (const auto& speed : speeds) {
                Graph graph;
                const NodeId x = graph.input(0), y = graph.input(1), z = graph.input(2);
                const int count = operation_table[row].operands;
                // The condition of a selection does not change here.
                const NodeId first = operation == Operation::select ? graph.apply(Operation::less, x, y) : x;
                const NodeId id = graph.apply(operation, first, count > 1 ? y : -1, count > 2 ? z : -1);
                const double expected = difference_at(graph, id, place, speed);
                INFO(operation_table[row].name << " at " << place[0] << ", " << place[1] << ", " << place[2]);
                CHECK(value_at(graph, rate_of(graph, id, speed), place) ==
                      Approx(expected).epsilon(1e-6).margin(1e-8));
            }
    }
}

TEST_CASE("derivatives follow chains, and negative branches", "[models]") {
    for (const double x : {-1.3, -0.2, 0.4, 2.6}) {
        Graph graph;
        const NodeId in = graph.input(0), shift = graph.input(1);
        const NodeId size = graph.apply(Operation::absolute, in);
        const NodeId wave = graph.apply(Operation::sine, graph.apply(Operation::multiply, in, in));
        const NodeId cube = graph.apply(Operation::power, in, graph.constant(3));
        const NodeId sum = graph.apply(Operation::add, graph.apply(Operation::multiply, size, wave), cube);
        const NodeId all =
            graph.apply(Operation::arc_tangent_2, sum, graph.apply(Operation::subtract, shift, in));
        const std::array<double, 3> at{x, -0.7, 0};
        const NodeId rate = rate_of(graph, all, {1, 0.5, 0});
        CHECK(value_at(graph, rate, at) == Approx(difference_at(graph, all, at, {1, 0.5, 0})).epsilon(1e-6));
    }
}

TEST_CASE("a rate of 0 times an infinite derivative is 0", "[models]") {
    Graph graph;
    const NodeId x = graph.input(0);
    const NodeId square = graph.apply(Operation::multiply, x, x);
    for (const NodeId id :
         {graph.apply(Operation::square_root, square),
          graph.apply(Operation::arc_cosine, graph.apply(Operation::subtract, graph.constant(1), square)),
          graph.apply(Operation::arc_tangent_2, square, square)})
        CHECK(value_at(graph, rate_of(graph, id, {1, 0, 0}), {0, 0, 0}) == 0);
}

TEST_CASE("a graph is inserted into another with nodes for its inputs", "[models]") {
    Graph inner;
    const NodeId inner_id =
        inner.apply(Operation::subtract, inner.apply(Operation::exponential, inner.input(0)),
                    inner.apply(Operation::multiply, inner.input(1), inner.constant(3)));
    Graph outer;
    const std::array<NodeId, 2> inputs{outer.apply(Operation::negate, outer.input(2)), outer.constant(0.25)};
    const NodeId id = inserted(outer, inner, std::span(&inner_id, 1), inputs).front();
    CHECK(value_at(outer, id, {5, 6, 0.3}) == Approx(std::exp(-0.3) - 0.75).epsilon(1e-15));
}

} // namespace derivative_test
