// SPDX-License-Identifier: Apache-2.0
// Value of an expression while a text becomes a graph: one node for each component.
#pragma once

#include "models/graph/graph.hpp"
#include "models/language/findings.hpp"
#include "models/language/syntax.hpp"

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::models {

/// Nodes of a value, one for each component.
struct Value {
    Type type = Type::scalar;
    /// As many as the type has components; the first of a texture is its number, not a node.
    std::array<NodeId, 4> nodes{-1, -1, -1, -1};
    friend bool operator==(const Value&, const Value&) = default;
};

/// A parameter, global or constant that functions see by its name.
struct NamedValue {
    std::string_view name;
    Value value;
};

/// What the surroundings of a model know beyond its text. Empty functions know nothing.
struct Surroundings {
    /// Names that the renderer gives, beside the parameters.
    std::vector<NamedValue> constants{};
    /// Dot product of two vectors that has a node already, such as that of a direction and the normal.
    std::function<std::optional<NodeId>(const Value& a, const Value& b)> dot{};
    /// Whether a vector is of unit length.
    std::function<bool(const Value&)> is_unit{};
    /// Value (vec4) of a function that reads a texture, called `name`; a text says why it cannot be.
    std::function<std::optional<Value>(std::string_view name, const std::vector<Value>& arguments,
                                       std::string& why)>
        look_up{};
    /// Value of the parameter with that index where it is not the usual one.
    std::function<std::optional<Value>(std::size_t parameter)> parameter{};
};

} // namespace obscura::models
