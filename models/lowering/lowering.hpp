// SPDX-License-Identifier: Apache-2.0
// From the syntax tree of a model to its graph: functions become part of their callers, loops are unrolled,
// and branches become selections.
#pragma once

#include "models/graph/graph.hpp"
#include "models/language/findings.hpp"
#include "models/language/syntax.hpp"
#include "models/lowering/value.hpp"

#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::models {

/// Most expressions that are visited for one entry point, so that small texts cannot ask for much work.
inline constexpr int max_visits = 20'000;

/// Thrown within the lowering at an error that has been noted.
struct Unusable {};

/// Thread-bound. Keeps references to all that it is given.
class Lowering {
public:
    Lowering(const SyntaxTree& tree, Graph& graph, Findings& findings, std::vector<NamedValue> names,
             const Surroundings& surroundings)
        : tree_(tree),
          graph_(graph),
          findings_(findings),
          names_(std::move(names)),
          surroundings_(surroundings) {}

    /// What a function of the file returns for `arguments`, which have the types that it declares. Nothing if
    /// there are errors; all that can be found is noted.
    std::optional<Value> result_of_call(const Function& function, std::vector<Value> arguments);

private:
    struct Variable {
        std::string_view name;
        Value value;
        enum class State : std::uint8_t { unassigned, partly_assigned, assigned, unusable } state;
    };
    /// State of one call on its way through the statements.
    struct Flow {
        std::vector<Variable> variables;
        NodeId returned = 0; ///< condition: a return came before
        std::optional<Value> result{};
        bool always_returned = false;
    };

    // lowering_statements.cpp
    Value call(const Function& function, std::vector<Value> arguments);
    void statement(const Statement& s, Flow& flow);
    void block(const Statement& s, Flow& flow);
    void declare(const Statement& s, Flow& flow);
    void assign(const Statement& s, Flow& flow);
    void give(const Statement& s, Flow& flow);
    void branch(const Statement& s, Flow& flow);
    void loop(const Statement& s, Flow& flow);
    Flow merged(NodeId condition, Flow yes, Flow no, std::size_t outer);
    Variable* find(Flow& flow, std::string_view name);

    // lowering_expressions.cpp
    Value expression(const Expression& e, Flow& flow);
    Value name(const Expression& e, Flow& flow);
    Value member(const Expression& e, Flow& flow);
    Value unary(const Expression& e, Flow& flow);
    Value binary(const Expression& e, Flow& flow);
    Value compared(const Expression& e, const Value& a, const Value& b);
    Value conditional(const Expression& e, Flow& flow);
    Value call_expression(const Expression& e, Flow& flow);
    Value constructed(const Expression& e, int count, const std::vector<Value>& arguments);
    NodeId condition(const Expression& e, Flow& flow);

    // built_in.cpp
    /// Nothing: there is no built-in function of that name.
    std::optional<Value> built_in(const Expression& e, const std::vector<Value>& arguments);
    std::optional<Value> vector_function(const Expression& e, const std::vector<Value>& arguments);
    /// A function of each component by itself, on vectors of one size and scalars.
    Value by_component(const Expression& e, const std::vector<Value>& arguments);
    NodeId component_function(std::string_view name, const std::array<NodeId, 3>& a);
    NodeId dot(const Value& a, const Value& b);
    Value normalised(const Value& v);
    Value scaled(const Value& v, NodeId factor);
    Value arithmetic(Operation operation, const Value& a, const Value& b, Place at, std::string_view text);

    /// `v` as a value of `type`: a scalar is the same in all components of a vector. Notes an error.
    Value converted(const Value& v, Type type, Place at, std::string_view what);
    NodeId apply(Operation operation, NodeId a, NodeId b = -1, NodeId c = -1) {
        return graph_.apply(operation, a, b, c);
    }
    void visit(Place at);
    [[noreturn]] void fail(Place at, std::string what);
    [[nodiscard]] static std::string nearest(std::string_view name,
                                             const std::vector<std::string_view>& known);

    const SyntaxTree& tree_;
    Graph& graph_;
    Findings& findings_;
    std::vector<NamedValue> names_;
    const Surroundings& surroundings_;
    int visits_ = 0;
    bool exhausted_ = false;
    /// Functions that are being read, innermost last: calls reach only those that stand before it.
    std::vector<const Function*> calls_;
};

/// Names of all built-in functions, for suggestions.
[[nodiscard]] const std::vector<std::string_view>& built_in_names();
/// Constants M_PI and its kind; nothing: there is none of that name.
[[nodiscard]] std::optional<double> built_in_constant(std::string_view name);
[[nodiscard]] const std::vector<std::string_view>& built_in_constant_names();

} // namespace obscura::models
