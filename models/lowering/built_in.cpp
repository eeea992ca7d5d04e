// SPDX-License-Identifier: Apache-2.0
#include "models/lowering/lowering.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>
#include <utility>

namespace obscura::models {
namespace {

constexpr std::array<std::pair<std::string_view, double>, 14> constants{
    {{"M_PI", std::numbers::pi},
     {"M_PI_2", std::numbers::pi / 2},
     {"M_PI_4", std::numbers::pi / 4},
     {"M_1_PI", std::numbers::inv_pi},
     {"M_2_PI", 2 * std::numbers::inv_pi},
     {"M_2_SQRTPI", 2 * std::numbers::inv_sqrtpi},
     {"M_SQRT2", std::numbers::sqrt2},
     {"M_SQRT1_2", std::numbers::sqrt2 / 2},
     {"M_E", std::numbers::e},
     {"M_LN2", std::numbers::ln2},
     {"M_LN10", std::numbers::ln10},
     {"M_LOG2E", std::numbers::log2e},
     {"M_LOG10E", std::numbers::log10e},
     {"M_NAN", std::numeric_limits<double>::quiet_NaN()}}};

/// Functions of each component by itself. Operation::constant: made of several operations.
struct ComponentFunction {
    std::string_view name;
    std::size_t arguments;
    Operation operation;
};
constexpr auto composed = Operation::constant;
constexpr std::array<ComponentFunction, 25> component_functions{{
    {"abs", 1, Operation::absolute},
    {"sqrt", 1, Operation::square_root},
    {"floor", 1, Operation::round_down},
    {"ceil", 1, composed},
    {"exp", 1, Operation::exponential},
    {"log", 1, Operation::logarithm},
    {"log2", 1, composed},
    {"sin", 1, Operation::sine},
    {"cos", 1, Operation::cosine},
    {"tan", 1, Operation::tangent},
    {"asin", 1, Operation::arc_sine},
    {"acos", 1, Operation::arc_cosine},
    {"atan", 1, Operation::arc_tangent},
    {"sign", 1, composed},
    {"min", 2, Operation::minimum},
    {"max", 2, Operation::maximum},
    {"pow", 2, Operation::power},
    {"fmod", 2, Operation::remainder},
    {"atan2", 2, Operation::arc_tangent_2},
    {"step", 2, composed},
    {"clamp", 3, composed},
    {"mix", 3, composed},
    {"smoothstep", 3, composed},
    {"exp2", 1, composed},
    {"log10", 1, composed},
}};
constexpr std::array<std::string_view, 7> vector_functions{"normalize", "length",  "dot",  "cross",
                                                           "reflect",   "refract", "isnan"};

const ComponentFunction* component_function_named(std::string_view name) {
    const auto at = std::find_if(component_functions.begin(), component_functions.end(),
                                 [&](const ComponentFunction& f) { return f.name == name; });
    return at == component_functions.end() ? nullptr : &*at;
}

} // namespace

const std::vector<std::string_view>& built_in_names() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> all(vector_functions.begin(), vector_functions.end());
        for (const ComponentFunction& f : component_functions)
            all.push_back(f.name);
        return all;
    }();
    return names;
}

std::optional<double> built_in_constant(std::string_view name) {
    for (const auto& [known, value] : constants)
        if (known == name) return value;
    return {};
}

const std::vector<std::string_view>& built_in_constant_names() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> all;
        for (const auto& [name, value] : constants)
            all.push_back(name);
        return all;
    }();
    return names;
}

NodeId Lowering::dot(const Value& a, const Value& b) {
    if (surroundings_.dot)
        if (const auto known = surroundings_.dot(a, b)) return *known;
    NodeId sum = apply(Operation::multiply, a.nodes[0], b.nodes[0]);
    for (int k = 1; k < components(a.type); ++k) {
        const auto i = static_cast<std::size_t>(k);
        sum = apply(Operation::add, sum, apply(Operation::multiply, a.nodes[i], b.nodes[i]));
    }
    return sum;
}

Value Lowering::scaled(const Value& v, NodeId factor) {
    Value value = v;
    for (int k = 0; k < components(v.type); ++k) {
        const auto i = static_cast<std::size_t>(k);
        value.nodes[i] = apply(Operation::multiply, v.nodes[i], factor);
    }
    return value;
}

Value Lowering::normalised(const Value& v) {
    if (v.type < Type::vec2 || v.type > Type::vec4) return v;
    if (surroundings_.is_unit && surroundings_.is_unit(v)) return v;
    const NodeId length = apply(Operation::square_root, dot(v, v));
    const NodeId zero = graph_.constant(0);
    const NodeId is_zero = apply(Operation::equal, length, zero);
    Value value = v;
    for (int k = 0; k < components(v.type); ++k) {
        const auto i = static_cast<std::size_t>(k);
        value.nodes[i] =
            apply(Operation::select, is_zero, zero, apply(Operation::divide, v.nodes[i], length));
    }
    return value;
}

NodeId Lowering::component_function(std::string_view name, const std::array<NodeId, 3>& a) {
    const ComponentFunction& f = *component_function_named(name);
    if (f.operation != composed) return apply(f.operation, a[0], f.arguments > 1 ? a[1] : -1);
    const NodeId zero = graph_.constant(0), one = graph_.constant(1);
    if (name == "ceil")
        return apply(Operation::negate, apply(Operation::round_down, apply(Operation::negate, a[0])));
    if (name == "log2")
        return apply(Operation::multiply, apply(Operation::logarithm, a[0]),
                     graph_.constant(std::numbers::log2e));
    if (name == "log10")
        return apply(Operation::multiply, apply(Operation::logarithm, a[0]),
                     graph_.constant(std::numbers::log10e));
    if (name == "exp2")
        return apply(Operation::exponential,
                     apply(Operation::multiply, a[0], graph_.constant(std::numbers::ln2)));
    if (name == "sign")
        return apply(Operation::subtract,
                     apply(Operation::select, apply(Operation::less, zero, a[0]), one, zero),
                     apply(Operation::select, apply(Operation::less, a[0], zero), one, zero));
    if (name == "step") // step(edge, x)
        return apply(Operation::select, apply(Operation::less, a[1], a[0]), zero, one);
    if (name == "clamp") return apply(Operation::minimum, apply(Operation::maximum, a[0], a[1]), a[2]);
    if (name == "mix") // mix(a, b, t)
        return apply(Operation::add, a[0],
                     apply(Operation::multiply, apply(Operation::subtract, a[1], a[0]), a[2]));
    // smoothstep(from, to, x)
    const NodeId share = apply(Operation::divide, apply(Operation::subtract, a[2], a[0]),
                               apply(Operation::subtract, a[1], a[0]));
    const NodeId t = apply(Operation::minimum, apply(Operation::maximum, share, zero), one);
    const NodeId rise =
        apply(Operation::subtract, graph_.constant(3), apply(Operation::multiply, graph_.constant(2), t));
    return apply(Operation::multiply, apply(Operation::multiply, t, t), rise);
}

Value Lowering::by_component(const Expression& e, const std::vector<Value>& arguments) {
    Type type = Type::scalar;
    for (const Value& a : arguments) {
        if (a.type == Type::boolean || a.type == Type::texture)
            fail(e.at, fmt::format("{}() takes numbers and vectors, not {}", e.text, name_of(a.type)));
        if (a.type == Type::scalar) continue;
        if (type != Type::scalar && type != a.type)
            fail(e.at, fmt::format("{}() of {} and {}: vectors of one size are needed", e.text, name_of(type),
                                   name_of(a.type)));
        type = a.type;
    }
    Value value{type, {}};
    value.nodes.fill(-1);
    for (int k = 0; k < components(type); ++k) {
        const auto i = static_cast<std::size_t>(k);
        std::array<NodeId, 3> nodes{-1, -1, -1};
        for (std::size_t n = 0; n < arguments.size(); ++n)
            nodes[n] = arguments[n].nodes[arguments[n].type == Type::scalar ? 0 : i];
        value.nodes[i] = component_function(e.text, nodes);
    }
    return value;
}

std::optional<Value> Lowering::vector_function(const Expression& e, const std::vector<Value>& arguments) {
    const auto expect = [&](std::size_t count) {
        if (arguments.size() != count)
            fail(e.at, fmt::format("{}() has {} argument{}, here are {}", e.text, count,
                                   count == 1 ? "" : "s", arguments.size()));
    };
    const auto expect_vectors = [&](std::size_t count) {
        for (std::size_t i = 0; i < count; ++i)
            if (arguments[i].type != arguments[0].type || arguments[i].type < Type::vec2 ||
                arguments[i].type > Type::vec4)
                fail(e.at, fmt::format("{}() takes vectors{}, not {}", e.text,
                                       count > 1 ? " of one size" : "", name_of(arguments[i].type)));
    };
    if (e.text == "normalize") return expect(1), expect_vectors(1), normalised(arguments[0]);
    if (e.text == "length") {
        expect(1), expect_vectors(1);
        return Value{Type::scalar, {apply(Operation::square_root, dot(arguments[0], arguments[0]))}};
    }
    if (e.text == "dot") {
        expect(2), expect_vectors(2);
        return Value{Type::scalar, {dot(arguments[0], arguments[1])}};
    }
    if (e.text == "isnan") {
        expect(1);
        if (arguments[0].type != Type::scalar) fail(e.at, "isnan() takes a scalar");
        const NodeId n = arguments[0].nodes[0];
        return Value{Type::boolean, {apply(Operation::invert, apply(Operation::equal, n, n))}};
    }
    if (e.text == "cross") {
        expect(2), expect_vectors(2);
        if (arguments[0].type != Type::vec3) fail(e.at, "cross() takes vec3");
        const auto& a = arguments[0].nodes;
        const auto& b = arguments[1].nodes;
        const auto minor = [&](std::size_t i, std::size_t k) {
            return apply(Operation::subtract, apply(Operation::multiply, a[i], b[k]),
                         apply(Operation::multiply, a[k], b[i]));
        };
        return Value{Type::vec3, {minor(1, 2), minor(2, 0), minor(0, 1)}};
    }
    if (e.text == "reflect") { // i - 2 (n|i) n
        expect(2), expect_vectors(2);
        const NodeId twice = apply(Operation::multiply, graph_.constant(2), dot(arguments[1], arguments[0]));
        return arithmetic(Operation::subtract, arguments[0], scaled(arguments[1], twice), e.at, e.text);
    }
    if (e.text == "refract") { // refract(i, n, eta), zero for total reflection
        expect(3), expect_vectors(2);
        if (arguments[2].type != Type::scalar) fail(e.at, "refract(i, n, eta): eta is a scalar");
        const NodeId one = graph_.constant(1), zero = graph_.constant(0), eta = arguments[2].nodes[0];
        const NodeId d = dot(arguments[1], arguments[0]);
        const NodeId k = apply(Operation::subtract, one,
                               apply(Operation::multiply, apply(Operation::multiply, eta, eta),
                                     apply(Operation::subtract, one, apply(Operation::multiply, d, d))));
        const NodeId root = apply(Operation::square_root, apply(Operation::maximum, k, zero));
        const NodeId along = apply(Operation::add, apply(Operation::multiply, eta, d), root);
        Value v = arithmetic(Operation::subtract, scaled(arguments[0], eta), scaled(arguments[1], along),
                             e.at, e.text);
        const NodeId none = apply(Operation::less, k, zero);
        for (int i = 0; i < components(v.type); ++i) {
            NodeId& n = v.nodes[static_cast<std::size_t>(i)];
            n = apply(Operation::select, none, zero, n);
        }
        return v;
    }
    return {};
}

std::optional<Value> Lowering::built_in(const Expression& e, const std::vector<Value>& arguments) {
    if (auto value = vector_function(e, arguments)) return value;
    const ComponentFunction* const f = component_function_named(e.text);
    if (f == nullptr) return {};
    if (arguments.size() != f->arguments)
        fail(e.at, fmt::format("{}() has {} argument{}, here are {}", f->name, f->arguments,
                               f->arguments == 1 ? "" : "s", arguments.size()));
    return by_component(e, arguments);
}

} // namespace obscura::models
