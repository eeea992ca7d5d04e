// SPDX-License-Identifier: Apache-2.0
#include "core/philox.hpp"
#include "models/graph/derivative.hpp"
#include "models/graph/slope_bounds.hpp"
#include "models/kinds/model_parameters.hpp"
#include "models/program/program.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace slope_bounds_test {

using namespace obscura;
using namespace obscura::models;

namespace {

/// Expressions of p, whose slopes and bends are as said over all of the boxes below.
struct Formula {
    const char* text;
    bool bends_up = false, bends_down = false;
};
const std::vector<Formula> formulas{
    {"length(p) - 2"},
    {"length(vec2(length(p.xy) - 2, p.z)) - 0.5"},
    {"p.x * p.y * p.z - p.x / (3 + p.y) + (p | p)"},
    {"exp(0.3 * p.x) - log(4 + p.y) + sin(3 * p.z) * cos(2 * p.x) + tan(0.3 * p.y)"},
    {"pow(p.x, 3) + pow(abs(p.y) + 1, 1.5) + pow(p.z, 4)", true},
    {"pow(5 + p.x, 0.2 * p.y)"},
    {"atan2(p.y, 3 + p.x) + asin(0.3 * p.z) - acos(0.2 * p.x) + atan(p.y)"},
    {"max(length(p) - 2, p.x)", true},
    {"min(length(p) - 2, p.x)", false, true},
    {"-max(abs(p.x) - 1, abs(p.y) - 1)", false, true},
    {"clamp(p.x, -1, 1) * 2 + mix(p.y, p.z, 0.3)", true, true},
    {"(length(p - vec3(1, 0, 0)) + length(p + vec3(1, 0, 0)) - sqrt(p.x * p.x + 0.1)) / 2"},
    {"1 / (10 + p.x + p.y) - 2 / (p.z - 9)"},
};

double random_number(std::uint32_t i, std::uint32_t k) {
    return uniform_double(philox4x32({i, k, 0, 0}, philox_key(11))[0]);
}

} // namespace

TEST_CASE("bounds of value, slope and bend hold everywhere in a box") {
    for (const Formula& formula : formulas) {
        const auto model = Model::parse(
            "f.shp", std::string("scalar bound_radius() { return 3; }\nscalar outside(vec3 p) { return ") +
                         formula.text + "; }");
        const ModelParameters parameters = default_parameters(*model);
        Graph graph;
        const NodeId value = lowered(*model, *model->function("outside"), parameters, 3, graph,
                                     {vector_value({graph.input(0), graph.input(1), graph.input(2)})})
                                 .nodes[0];
        SlopeBounder bounder(graph, value, {});
        Graph more = graph;
        std::vector<NodeId> outputs{value};
        for (std::int32_t k = 0; k < 3; ++k)
            outputs.push_back(derivatives(more, std::array{value}, {{k, more.constant(1)}})[0]);
        for (const auto& [i, k] : std::vector<std::pair<std::size_t, std::int32_t>>{
                 {1, 0}, {2, 1}, {3, 2}, {1, 1}, {1, 2}, {2, 2}})
            outputs.push_back(derivatives(more, std::array{outputs[i]}, {{k, more.constant(1)}})[0]);
        const Program program(more, outputs);
        const Uniforms uniforms = program.bind({});
        bool up = false, down = false;
        for (std::uint32_t b = 0; b < 500; ++b) {
            std::array<Interval, 3> box;
            const double width = std::pow(10, -3 * random_number(b, 0));
            for (std::uint32_t k = 0; k < 3; ++k) {
                box[k].lo = -2.5 + 4 * random_number(b, k + 1);
                box[k].hi = box[k].lo + width * random_number(b, k + 4);
            }
            const SlopeBounds bounds = bounder.over(box);
            up |= bounds.bends_up;
            down |= bounds.bends_down;
            constexpr std::size_t points = 64;
            std::array<std::array<double, points>, 3> at{};
            std::array<std::array<double, points>, 10> rows{};
            std::array<double*, 10> out{};
            for (std::size_t i = 0; i < out.size(); ++i)
                out[i] = rows[i].data();
            for (std::uint32_t i = 0; i < points; ++i)
                for (std::uint32_t k = 0; k < 3; ++k)
                    at[k][i] = box[k].lo + (box[k].hi - box[k].lo) * random_number(1000 + b * 64 + i, k);
            const std::array<const double*, 3> in{at[0].data(), at[1].data(), at[2].data()};
            program.run(uniforms, in.data(), out.data(), points);
            int wrong = 0;
            for (std::size_t i = 0; i < points; ++i) {
                wrong += bounds.value.has(rows[0][i]) ? 0 : 1;
                for (std::size_t k = 0; k < 3; ++k)
                    wrong += bounds.gradient[k].has(rows[1 + k][i]) ? 0 : 1;
                for (std::size_t k = 0; k < 6; ++k) {
                    const double slack = 1e-9 * (1 + std::abs(rows[4 + k][i]));
                    wrong += bounds.second[k].lo - slack <= rows[4 + k][i] &&
                                     rows[4 + k][i] <= bounds.second[k].hi + slack
                                 ? 0
                                 : 1;
                }
            }
            INFO(formula.text);
            REQUIRE(wrong == 0);
        }
        INFO(formula.text);
        CHECK(up == formula.bends_up);
        CHECK(down == formula.bends_down);
    }
}

TEST_CASE("the slope of a length is bounded at its origin") {
    const auto model = Model::parse(
        "f.shp", "scalar bound_radius() { return 3; }\nscalar outside(vec3 p) { return length(p) - 2; }");
    Graph graph;
    const NodeId value = lowered(*model, *model->function("outside"), default_parameters(*model), 3, graph,
                                 {vector_value({graph.input(0), graph.input(1), graph.input(2)})})
                             .nodes[0];
    const SlopeBounds bounds = SlopeBounder(graph, value, {}).over({Interval{-1, 1}, {-1, 1}, {-1, 1}});
    CHECK(bounds.max_slope() < 1.7321);
    CHECK_FALSE(std::isfinite(bounds.max_bend()));
}

TEST_CASE("intervals of operations have all results, also at their limits") {
    const auto has_all = [](Operation op, Interval a, Interval b) {
        const Interval found = interval_of(op, a, b, {});
        for (int i = 0; i <= 20; ++i)
            for (int k = 0; k <= 20; ++k) {
                const double x = a.lo + (a.hi - a.lo) * i / 20, y = b.lo + (b.hi - b.lo) * k / 20;
                const double value = result_of(op, x, y, 0);
                if (!std::isnan(value) && !found.has(value)) return false;
            }
        return true;
    };
    using O = Operation;
    for (const O op :
         {O::add,        O::subtract,    O::multiply,      O::divide, O::minimum,       O::maximum,
          O::power,      O::remainder,   O::arc_tangent_2, O::less,   O::less_or_equal, O::equal,
          O::both,       O::either,      O::negate,        O::invert, O::absolute,      O::square_root,
          O::round_down, O::exponential, O::logarithm,     O::sine,   O::cosine,        O::tangent,
          O::arc_sine,   O::arc_cosine,  O::arc_tangent})
        for (std::uint32_t i = 0; i < 300; ++i) {
            const auto any = [&](std::uint32_t k) {
                const double from = std::floor(9 * random_number(i, k) - 4);
                return Interval{from, from + std::floor(5 * random_number(i, k + 1)) / 2};
            };
            INFO(row_of(op).name << " " << i);
            CHECK(has_all(op, any(0), any(2)));
        }
}

} // namespace slope_bounds_test
