// SPDX-License-Identifier: Apache-2.0
// Rows of the table of calls as the routes use them: call_rows.py makes them of clients/calls.json.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

namespace obscura::web {

/// A field of a query, of a body or of an answer.
struct Parameter {
    enum class Type : std::uint8_t { boolean, integer, number, string, array, object, any };
    std::string_view name;
    Type type = Type::string;
    std::string_view help;
    bool required = false;
    double min = 0, max = std::numeric_limits<double>::max(); ///< of numbers
    std::string_view unit{};
    std::span<const std::string_view> choices{}; ///< of strings; empty: any
    Type items = Type::any;                      ///< of arrays
    std::size_t size = 0;                        ///< of arrays; 0: any
    std::string_view initial{};                  ///< the default as JSON; empty: none is told
};
constexpr auto enum_names(Parameter::Type /*type*/) {
    using T = Parameter::Type;
    return std::array{EnumName{T::boolean, "boolean"}, EnumName{T::integer, "integer"},
                      EnumName{T::number, "number"},   EnumName{T::string, "string"},
                      EnumName{T::array, "array"},     EnumName{T::object, "object"},
                      EnumName{T::any, "any"}};
}

/// A call of the daemon.
struct CallRow {
    std::string_view name, help, permission;
    bool has_camera;                   ///< its field `camera`, which is none of `fields`: paths have it
    std::span<const Parameter> fields; ///< of the request
    std::span<const Parameter> results;
};

} // namespace obscura::web
