// SPDX-License-Identifier: Apache-2.0
// Syntax tree of a SuMoL file.
#pragma once

#include "models/language/findings.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::models {

/// Types of values. `boolean` has no name in the language: comparisons have it.
enum class Type : std::uint8_t { boolean, scalar, vec2, vec3, vec4, texture };

/// Number of components; 0: a texture.
[[nodiscard]] constexpr int components(Type type) {
    constexpr std::array<int, 6> counts{1, 1, 2, 3, 4, 0};
    return counts[static_cast<std::size_t>(type)];
}
[[nodiscard]] constexpr std::string_view name_of(Type type) {
    constexpr std::array<std::string_view, 6> names{"condition", "scalar", "vec2", "vec3", "vec4", "texture"};
    return names[static_cast<std::size_t>(type)];
}
/// Vector of so many components, scalar for 1.
[[nodiscard]] constexpr Type vector_of(int count) {
    constexpr std::array<Type, 5> types{Type::scalar, Type::scalar, Type::vec2, Type::vec3, Type::vec4};
    return types[static_cast<std::size_t>(count)];
}

/// Expression, with the expressions that it is made of.
struct Expression {
    enum class Kind : std::uint8_t {
        number,      ///< value
        name,        ///< text
        member,      ///< operand 0 . text
        unary,       ///< text operand 0
        binary,      ///< operand 0 text operand 1
        conditional, ///< operand 0 ? 1 : 2
        call,        ///< text(operands): function, built-in or constructor
    };
    Kind kind = Kind::number;
    Place at;
    std::string_view text{}; ///< in the source
    double value = 0;
    std::vector<std::unique_ptr<Expression>> operands{};
    int depth = 1; ///< of the tree below
};
using ExpressionPointer = std::unique_ptr<Expression>;

/// Statement, with the statements within it.
struct Statement {
    enum class Kind : std::uint8_t {
        declare, ///< type name [= value]
        assign,  ///< name[.member] text value; text: = += -= *= /=
        give,    ///< return value
        branch,  ///< if (value) body 0 else body 1
        loop,    ///< for (body 0; value; body 1) body 2
        block,   ///< body
    };
    Kind kind = Kind::block;
    Place at;
    Type type = Type::scalar;
    std::string_view name{}, member{}, text{};
    ExpressionPointer value{}; ///< null: none
    std::vector<Statement> body{};
};

/// Argument of a function.
struct Argument {
    Type type = Type::scalar;
    std::string_view name;
    Place at;
    bool normalised = false; ///< written with $
};

/// Function of a file, with its body.
struct Function {
    Type type = Type::scalar;
    std::string_view name;
    Place at;
    std::vector<Argument> arguments;
    Statement body;
};

/// Values of a property, parameter or global: as many as its type has components.
struct Default {
    Type type = Type::scalar;
    std::array<double, 4> value{};
};

/// Property, parameter or global.
struct Declaration {
    enum class Kind : std::uint8_t { property, parameter, global };
    Kind kind = Kind::parameter;
    std::string_view name;
    Place at;
    Default value;
    std::string_view remark{}; ///< comment "//! unit, min..max, help" behind it
};

/// All that a file declares.
struct SyntaxTree {
    std::vector<Declaration> declarations;
    std::vector<Function> functions; ///< in the order of the file
    bool whole = true;               ///< all of the text could be read
};

} // namespace obscura::models
