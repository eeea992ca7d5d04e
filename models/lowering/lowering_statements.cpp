// SPDX-License-Identifier: Apache-2.0
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "models/lowering/lowering.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>

namespace obscura::models {

void Lowering::fail(Place at, std::string what) {
    findings_.error(at, std::move(what));
    throw Unusable{};
}

void Lowering::visit(Place at) {
    if (exhausted_) throw Unusable{};
    if (++visits_ > max_visits || graph_.full()) {
        exhausted_ = true;
        fail(at,
             fmt::format("too much work: with all its calls and loops written out the function has more than "
                         "{} expressions",
                         max_visits));
    }
}

std::string Lowering::nearest(std::string_view name, const std::vector<std::string_view>& known) {
    return name.size() < 2 ? "" : did_you_mean(name, known); // any letter is close to another
}

std::optional<Value> Lowering::result_of_call(const Function& function, std::vector<Value> arguments) {
    visits_ = 0;
    exhausted_ = false;
    calls_.clear();
    try {
        return call(function, std::move(arguments));
    } catch (const Unusable&) {
        return {};
    }
}

Value Lowering::call(const Function& function, std::vector<Value> arguments) {
    calls_.push_back(&function);
    Flow flow;
    flow.returned = graph_.constant(0);
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const Argument& a = function.arguments[i];
        for (std::size_t k = 0; k < i; ++k)
            if (function.arguments[k].name == a.name)
                findings_.error(a.at, fmt::format("'{}' is the name of an earlier argument", a.name));
        const Value value = a.normalised ? normalised(arguments[i]) : arguments[i];
        flow.variables.push_back({a.name, value, Variable::State::assigned});
    }
    try {
        block(function.body, flow);
    } catch (const Unusable&) {
        calls_.pop_back();
        throw;
    }
    calls_.pop_back();
    if (!flow.always_returned && !tree_.whole) throw Unusable{}; // the return may be what could not be read
    if (!flow.always_returned)
        fail(function.at, fmt::format("'{}' has a way to its end without return", function.name));
    if (!flow.result) throw Unusable{};
    return *flow.result;
}

void Lowering::statement(const Statement& s, Flow& flow) {
    visit(s.at);
    switch (s.kind) {
    case Statement::Kind::declare:
        return declare(s, flow);
    case Statement::Kind::assign:
        return assign(s, flow);
    case Statement::Kind::give:
        return give(s, flow);
    case Statement::Kind::branch:
        return branch(s, flow);
    case Statement::Kind::loop:
        return loop(s, flow);
    case Statement::Kind::block:
        return block(s, flow);
    }
}

void Lowering::block(const Statement& s, Flow& flow) {
    const std::size_t outer = flow.variables.size();
    for (const Statement& inner : s.body) {
        if (flow.always_returned) {
            findings_.warning(inner.at, "is never reached: a return stands before it");
            break;
        }
        try {
            statement(inner, flow);
        } catch (const Unusable&) {
            if (exhausted_) throw;
        }
    }
    flow.variables.resize(outer);
}

Lowering::Variable* Lowering::find(Flow& flow, std::string_view name) {
    const auto at = std::find_if(flow.variables.rbegin(), flow.variables.rend(),
                                 [&](const Variable& v) { return v.name == name; });
    return at == flow.variables.rend() ? nullptr : &*at;
}

void Lowering::declare(const Statement& s, Flow& flow) {
    if (s.type == Type::texture) fail(s.at, "a variable cannot be a texture");
    flow.variables.push_back({s.name, {s.type, {}}, Variable::State::unusable});
    const std::size_t index = flow.variables.size() - 1;
    Variable::State state = Variable::State::unassigned;
    if (s.value != nullptr) {
        const Value value = converted(expression(*s.value, flow), s.type, s.value->at, s.name);
        flow.variables[index].value = value;
        state = Variable::State::assigned;
    }
    flow.variables[index].state = state;
}

void Lowering::assign(const Statement& s, Flow& flow) {
    Variable* const variable = find(flow, s.name);
    if (variable == nullptr) {
        for (const NamedValue& n : names_)
            if (n.name == s.name)
                fail(s.at, fmt::format("'{}' is a parameter or global: it has no other value", s.name));
        std::vector<std::string_view> known;
        for (const Variable& v : flow.variables)
            known.push_back(v.name);
        fail(s.at, fmt::format("'{}' is not declared{}", printable(s.name), nearest(s.name, known)));
    }
    const auto index = static_cast<std::size_t>(variable - flow.variables.data());
    const Type type = variable->value.type;
    if (type == Type::texture) fail(s.at, fmt::format("'{}' is a texture: it has no other value", s.name));
    Value value;
    try {
        value = expression(*s.value, flow);
    } catch (const Unusable&) {
        flow.variables[index].state = Variable::State::unusable;
        throw;
    }
    Variable& v = flow.variables[index];
    if (v.state == Variable::State::unusable) throw Unusable{};
    std::size_t component = 0;
    Type target = type;
    if (!s.member.empty()) {
        component =
            s.member.size() == 1 ? std::string_view("xyzw").find(s.member[0]) : std::string_view::npos;
        if (component >= static_cast<std::size_t>(components(type)) || type == Type::scalar)
            fail(s.at, fmt::format("'{}' is {}: it has no component '{}'", s.name, name_of(type),
                                   printable(s.member)));
        target = Type::scalar;
    }
    const bool whole = s.member.empty() && s.text == "=";
    if (!whole && v.state != Variable::State::assigned)
        fail(s.at, fmt::format("'{}' may have no value here", s.name));
    if (s.text != "=") {
        const Value before = s.member.empty() ? v.value : Value{Type::scalar, {v.value.nodes[component]}};
        const Operation operation = s.text == "+="   ? Operation::add
                                    : s.text == "-=" ? Operation::subtract
                                    : s.text == "*=" ? Operation::multiply
                                                     : Operation::divide;
        value = arithmetic(operation, before, value, s.at, s.text);
    }
    value = converted(value, target, s.value->at, s.name);
    if (s.member.empty())
        v.value = value;
    else
        v.value.nodes[component] = value.nodes[0];
    v.state = Variable::State::assigned;
}

void Lowering::give(const Statement& s, Flow& flow) {
    flow.always_returned = true; // even if the value cannot be used
    const Function& function = *calls_.back();
    const Value value = converted(expression(*s.value, flow), function.type, s.value->at, function.name);
    Value result = value;
    if (flow.result)
        for (int k = 0; k < components(value.type); ++k) {
            const auto i = static_cast<std::size_t>(k);
            result.nodes[i] = apply(Operation::select, flow.returned, flow.result->nodes[i], value.nodes[i]);
        }
    flow.result = result;
    flow.returned = graph_.constant(1);
}

Lowering::Flow Lowering::merged(NodeId condition, Flow yes, Flow no, std::size_t outer) {
    Flow flow = yes;
    flow.variables.resize(outer);
    for (std::size_t i = 0; i < outer; ++i) {
        const Variable& a = yes.variables[i];
        const Variable& b = no.variables[i];
        Variable& v = flow.variables[i];
        if (yes.always_returned || no.always_returned) {
            v = yes.always_returned ? b : a;
            continue;
        }
        if (a.state == Variable::State::unusable || b.state == Variable::State::unusable) {
            v.state = Variable::State::unusable;
        } else if (a.state == Variable::State::assigned && b.state == Variable::State::assigned) {
            for (int k = 0; k < components(v.value.type); ++k) {
                const auto c = static_cast<std::size_t>(k);
                if (v.value.type == Type::texture) break;
                v.value.nodes[c] = apply(Operation::select, condition, a.value.nodes[c], b.value.nodes[c]);
            }
        } else if (a.state != b.state) {
            v.state = Variable::State::partly_assigned;
        }
    }
    flow.returned = apply(Operation::select, condition, yes.returned, no.returned);
    flow.always_returned = yes.always_returned && no.always_returned;
    if (!flow.result) flow.result = no.result;
    if (yes.result && no.result)
        for (int k = 0; k < components(flow.result->type); ++k) {
            const auto c = static_cast<std::size_t>(k);
            flow.result->nodes[c] =
                apply(Operation::select, condition, yes.result->nodes[c], no.result->nodes[c]);
        }
    return flow;
}

void Lowering::branch(const Statement& s, Flow& flow) {
    NodeId when = -1;
    try {
        when = condition(*s.value, flow);
    } catch (const Unusable&) {
        if (exhausted_) throw;
    }
    const std::size_t outer = flow.variables.size();
    Flow yes = flow, no = flow;
    const auto run = [&](const Statement& body, Flow& f) {
        try {
            statement(body, f);
        } catch (const Unusable&) {
            if (exhausted_) throw;
        }
        f.variables.resize(outer);
    };
    run(s.body[0], yes);
    if (s.body.size() > 1) run(s.body[1], no);
    if (when < 0) when = graph_.constant(0); // an error: no graph will be used
    if (graph_.is_constant(when))
        flow = graph_.node(when).value != 0 ? std::move(yes) : std::move(no);
    else
        flow = merged(when, std::move(yes), std::move(no), outer);
}

void Lowering::loop(const Statement& s, Flow& flow) {
    const std::size_t outer = flow.variables.size();
    statement(s.body[0], flow);
    while (!flow.always_returned) {
        const NodeId again = condition(*s.value, flow);
        if (!graph_.is_constant(again))
            fail(s.value->at,
                 "the bounds of a loop must be constants: this condition depends on a parameter or "
                 "an argument");
        if (graph_.node(again).value == 0) break;
        statement(s.body[2], flow);
        if (!flow.always_returned) statement(s.body[1], flow);
    }
    flow.variables.resize(outer);
}

} // namespace obscura::models
