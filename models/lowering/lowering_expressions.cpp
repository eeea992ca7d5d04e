// SPDX-License-Identifier: Apache-2.0
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "models/lowering/lowering.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace obscura::models {
namespace {

std::string counted(std::size_t count, std::string_view what) {
    return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

} // namespace

Value Lowering::converted(const Value& v, Type type, Place at, std::string_view what) {
    if (v.type == type) return v;
    if (v.type == Type::scalar && components(type) > 1) {
        Value value{type, {}};
        value.nodes.fill(-1);
        std::fill_n(value.nodes.begin(), components(type), v.nodes[0]);
        return value;
    }
    if (v.type == Type::boolean && type == Type::scalar)
        fail(at, fmt::format("a condition is no number: write condition ? 1 : 0 for '{}'", what));
    fail(at, fmt::format("'{}' is {}, this is {}", what, name_of(type), name_of(v.type)));
}

NodeId Lowering::condition(const Expression& e, Flow& flow) {
    const Value v = expression(e, flow);
    if (v.type == Type::boolean) return v.nodes[0];
    if (v.type == Type::scalar)
        return apply(Operation::invert, apply(Operation::equal, v.nodes[0], graph_.constant(0)));
    fail(e.at, fmt::format("a condition is missing, this is {}", name_of(v.type)));
}

Value Lowering::expression(const Expression& e, Flow& flow) {
    visit(e.at);
    switch (e.kind) {
    case Expression::Kind::number:
        return {Type::scalar, {graph_.constant(e.value)}};
    case Expression::Kind::name:
        return name(e, flow);
    case Expression::Kind::member:
        return member(e, flow);
    case Expression::Kind::unary:
        return unary(e, flow);
    case Expression::Kind::binary:
        return binary(e, flow);
    case Expression::Kind::conditional:
        return conditional(e, flow);
    case Expression::Kind::call:
        return call_expression(e, flow);
    }
    throw Unusable{};
}

Value Lowering::name(const Expression& e, Flow& flow) {
    if (const Variable* v = find(flow, e.text)) {
        if (v->state == Variable::State::unusable) throw Unusable{};
        if (v->state == Variable::State::unassigned) fail(e.at, fmt::format("'{}' has no value yet", e.text));
        if (v->state == Variable::State::partly_assigned)
            fail(e.at, fmt::format("'{}' may have no value here: assign it in both branches", e.text));
        return v->value;
    }
    for (const NamedValue& n : names_)
        if (n.name == e.text) return n.value;
    if (const auto value = built_in_constant(e.text)) return {Type::scalar, {graph_.constant(*value)}};
    std::vector<std::string_view> known = built_in_constant_names();
    for (const Variable& v : flow.variables)
        known.push_back(v.name);
    for (const NamedValue& n : names_)
        known.push_back(n.name);
    fail(e.at, fmt::format("'{}' is not declared{}", printable(e.text), nearest(e.text, known)));
}

Value Lowering::member(const Expression& e, Flow& flow) {
    const Value v = expression(*e.operands[0], flow);
    const int count = components(v.type);
    if (v.type < Type::vec2 || v.type > Type::vec4)
        fail(e.at, fmt::format("{} has no components", name_of(v.type)));
    if (e.text.size() > 4)
        fail(e.at, fmt::format("'.{}': allowed are up to 4 of x, y, z, w", printable(e.text)));
    Value value{vector_of(static_cast<int>(e.text.size())), {}};
    value.nodes.fill(-1);
    for (std::size_t k = 0; k < e.text.size(); ++k) {
        const std::size_t component = std::string_view("xyzw").find(e.text[k]);
        if (component >= static_cast<std::size_t>(count))
            fail(e.at,
                 fmt::format(
                     "'.{}': {} has the components {}", printable(e.text), name_of(v.type),
                     std::string_view("x, y, z, w").substr(0, static_cast<std::size_t>(3 * count - 2))));
        value.nodes[k] = v.nodes[component];
    }
    return value;
}

Value Lowering::unary(const Expression& e, Flow& flow) {
    if (e.text == "!") return {Type::boolean, {apply(Operation::invert, condition(*e.operands[0], flow))}};
    Value v = expression(*e.operands[0], flow);
    if (v.type == Type::boolean || v.type == Type::texture)
        fail(e.at, fmt::format("'-' needs a number or a vector, this is {}", name_of(v.type)));
    for (int k = 0; k < components(v.type); ++k) {
        NodeId& n = v.nodes[static_cast<std::size_t>(k)];
        n = apply(Operation::negate, n);
    }
    return v;
}

Value Lowering::arithmetic(Operation operation, const Value& a, const Value& b, Place at,
                           std::string_view text) {
    for (const Value* v : {&a, &b})
        if (v->type == Type::boolean || v->type == Type::texture)
            fail(at, fmt::format("'{}' needs numbers or vectors, this is {}", text, name_of(v->type)));
    if (a.type != b.type && a.type != Type::scalar && b.type != Type::scalar)
        fail(at, fmt::format("'{}' between {} and {}: they need the same size, or one is a scalar", text,
                             name_of(a.type), name_of(b.type)));
    Value value{std::max(a.type, b.type), {}};
    value.nodes.fill(-1);
    for (int k = 0; k < components(value.type); ++k) {
        const auto i = static_cast<std::size_t>(k);
        value.nodes[i] = apply(operation, a.nodes[a.type == Type::scalar ? 0 : i],
                               b.nodes[b.type == Type::scalar ? 0 : i]);
    }
    return value;
}

Value Lowering::compared(const Expression& e, const Value& a, const Value& b) {
    if (a.type != Type::scalar || b.type != Type::scalar)
        fail(e.at,
             fmt::format("'{}' compares scalars, not {} with {}", e.text, name_of(a.type), name_of(b.type)));
    const NodeId x = a.nodes[0], y = b.nodes[0];
    NodeId n = -1;
    if (e.text == "<")
        n = apply(Operation::less, x, y);
    else if (e.text == "<=")
        n = apply(Operation::less_or_equal, x, y);
    else if (e.text == ">")
        n = apply(Operation::less, y, x);
    else if (e.text == ">=")
        n = apply(Operation::less_or_equal, y, x);
    else if (e.text == "==")
        n = apply(Operation::equal, x, y);
    else
        n = apply(Operation::invert, apply(Operation::equal, x, y));
    return {Type::boolean, {n}};
}

Value Lowering::binary(const Expression& e, Flow& flow) {
    if (e.text == "&&" || e.text == "||") {
        const NodeId a = condition(*e.operands[0], flow);
        const NodeId b = condition(*e.operands[1], flow);
        return {Type::boolean, {apply(e.text == "&&" ? Operation::both : Operation::either, a, b)}};
    }
    const Value a = expression(*e.operands[0], flow);
    const Value b = expression(*e.operands[1], flow);
    if (e.text == "|") {
        if (a.type != b.type || a.type < Type::vec2 || a.type > Type::vec4)
            fail(e.at,
                 fmt::format("'|', the dot product, is between vectors of one size, not {} and {}; brackets "
                             "around it? It binds weaker than arithmetic",
                             name_of(a.type), name_of(b.type)));
        return {Type::scalar, {dot(a, b)}};
    }
    if (e.text == "+") return arithmetic(Operation::add, a, b, e.at, e.text);
    if (e.text == "-") return arithmetic(Operation::subtract, a, b, e.at, e.text);
    if (e.text == "*") return arithmetic(Operation::multiply, a, b, e.at, e.text);
    if (e.text == "/") return arithmetic(Operation::divide, a, b, e.at, e.text);
    return compared(e, a, b);
}

Value Lowering::conditional(const Expression& e, Flow& flow) {
    const NodeId when = condition(*e.operands[0], flow);
    Value a = expression(*e.operands[1], flow);
    Value b = expression(*e.operands[2], flow);
    if (a.type == Type::texture || b.type == Type::texture)
        fail(e.at, "'?' does not choose between textures");
    if (a.type == Type::scalar) a = converted(a, b.type, e.operands[1]->at, "?");
    b = converted(b, a.type, e.operands[2]->at, "?");
    for (int k = 0; k < components(a.type); ++k) {
        const auto i = static_cast<std::size_t>(k);
        a.nodes[i] = apply(Operation::select, when, a.nodes[i], b.nodes[i]);
    }
    return a;
}

Value Lowering::constructed(const Expression& e, int count, const std::vector<Value>& arguments) {
    Value value{vector_of(count), {}};
    value.nodes.fill(-1);
    if (arguments.size() == 1 && arguments[0].type == Type::scalar)
        return converted(arguments[0], value.type, e.at, e.text);
    std::size_t filled = 0;
    for (const Value& a : arguments) {
        if (a.type == Type::boolean || a.type == Type::texture)
            fail(e.at,
                 fmt::format("{}() is made of numbers and vectors, not of {}", e.text, name_of(a.type)));
        for (int k = 0; k < components(a.type); ++k, ++filled)
            if (filled < static_cast<std::size_t>(count))
                value.nodes[filled] = a.nodes[static_cast<std::size_t>(k)];
    }
    if (filled != static_cast<std::size_t>(count))
        fail(e.at, fmt::format("{}() has {}, here are {}", e.text,
                               counted(static_cast<std::size_t>(count), "component"), filled));
    return value;
}

Value Lowering::call_expression(const Expression& e, Flow& flow) {
    std::vector<Value> arguments;
    bool usable = true;
    for (const ExpressionPointer& operand : e.operands) {
        try {
            arguments.push_back(expression(*operand, flow));
        } catch (const Unusable&) {
            if (exhausted_) throw;
            usable = false;
        }
    }
    if (!usable) throw Unusable{};
    for (const Type type : {Type::vec2, Type::vec3, Type::vec4})
        if (e.text == name_of(type)) return constructed(e, components(type), arguments);
    // Functions that stand before the one that is being read.
    const Function* const own = calls_.back();
    for (const Function& f : tree_.functions) {
        if (&f == own) break;
        if (f.name != e.text) continue;
        if (arguments.size() != f.arguments.size())
            fail(e.at, fmt::format("{}() has {}, here are {}", f.name,
                                   counted(f.arguments.size(), "argument"), arguments.size()));
        for (std::size_t i = 0; i < arguments.size(); ++i)
            arguments[i] =
                converted(arguments[i], f.arguments[i].type, e.operands[i]->at, f.arguments[i].name);
        return call(f, std::move(arguments));
    }
    if (surroundings_.look_up) {
        std::string why;
        if (const auto value = surroundings_.look_up(e.text, arguments, why)) return *value;
        if (!why.empty()) fail(e.at, why);
    }
    if (const auto value = built_in(e, arguments)) return *value;
    std::vector<std::string_view> known = built_in_names();
    for (const Function& f : tree_.functions) {
        if (f.name == e.text)
            fail(e.at, &f == own ? fmt::format("'{}' calls itself, which is not allowed", f.name)
                                 : fmt::format("'{}' must stand before its use", f.name));
        if (&f != own) known.push_back(f.name);
    }
    fail(e.at, fmt::format("there is no function '{}'{}", printable(e.text), nearest(e.text, known)));
}

} // namespace obscura::models
