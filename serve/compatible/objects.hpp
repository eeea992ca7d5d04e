// SPDX-License-Identifier: Apache-2.0
// Objects and models by name, within the limit of how many there are.
#pragma once

#include "serve/compatible/client_state.hpp"
#include "service/compatible/arguments.hpp"

#include <fmt/format.h>

#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace obscura::serve::compatible {

/// Largest number of objects, of models of a kind and of aliases.
constexpr std::size_t max_objects = 100'000;

/// Creates or replaces the element called as the argument says. Throws Failure for an empty name, or one too
/// many.
template<typename Element>
Element& put(std::map<std::string, Element>& all, const service::compatible::Arguments& arguments,
             std::string_view argument, Element element) {
    const std::string& name = arguments.text(argument);
    constexpr std::size_t longest = 200;
    if (name.empty() || name.size() > longest)
        throw arguments.refused(argument, fmt::format("{} bytes", name.size()),
                                fmt::format("1 to {}", longest));
    if (all.size() >= max_objects && !all.contains(name))
        throw arguments.refused(argument, "one more", fmt::format("{} in all", max_objects));
    return all[name] = std::move(element);
}

} // namespace obscura::serve::compatible
