// SPDX-License-Identifier: Apache-2.0
// Table of the published client's commands (version 8): names, arguments, results and what they do.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::service::compatible {

/// What an argument is.
enum class ArgumentType : std::uint8_t {
    text,
    number,  ///< any
    integer, ///< whole
    flag,
    vector, ///< numbers
    list,   ///< anything
    bytes,
    any,
};
constexpr auto enum_names(ArgumentType /*type*/) {
    using T = ArgumentType;
    return std::array{EnumName{T::text, "text"},       EnumName{T::number, "number"},
                      EnumName{T::integer, "integer"}, EnumName{T::flag, "flag"},
                      EnumName{T::vector, "vector"},   EnumName{T::list, "list"},
                      EnumName{T::bytes, "bytes"},     EnumName{T::any, "any"}};
}

/// An argument of a command, by its name in messages.
struct Argument {
    std::string_view name;
    ArgumentType type = ArgumentType::any;
    bool optional = false;
};

/// Whether the published client reads the answer.
enum class Awaited : std::uint8_t {
    no,    ///< it is sent, but not read unless the client was made synchronous
    yes,   ///< the call returns once it is there
    never, ///< none is sent
};

/// Part of the manual that a command belongs to.
enum class Group : std::uint8_t {
    connection,
    camera,
    scene,
    light,
    texture,
    rendering,
    output,
    preview, ///< of another rendering mode: remembered, without effect
    removed, ///< gone from that version, but still called
};
constexpr auto enum_names(Group /*type*/) {
    using G = Group;
    return std::array{EnumName{G::connection, "connection"}, EnumName{G::camera, "camera"},
                      EnumName{G::scene, "scene"},           EnumName{G::light, "light"},
                      EnumName{G::texture, "texture"},       EnumName{G::rendering, "rendering"},
                      EnumName{G::output, "output"},         EnumName{G::preview, "preview"},
                      EnumName{G::removed, "removed"}};
}

/// One row of the table.
struct Command {
    std::string_view name;
    Group group = Group::connection;
    std::vector<Argument> arguments{};
    std::vector<std::string_view> results{}; ///< fields of the answer beside its name
    Awaited awaited = Awaited::no;
    std::string_view help{};
};

/// All rows, by name.
[[nodiscard]] const std::vector<Command>& commands();
/// The row called `name`; null: none is.
[[nodiscard]] const Command* find_command(std::string_view name) noexcept;
/// "setFocus(focus_plane_Z: number, pupil_radius: number)", and its results behind an arrow.
[[nodiscard]] std::string signature(const Command& command);

/// Message about a call that is none: the name, and the call that was likely meant.
[[nodiscard]] std::string explain_unknown_command(std::string_view name);

} // namespace obscura::service::compatible
