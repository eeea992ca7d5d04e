// SPDX-License-Identifier: Apache-2.0
// Declaration of a kind of shape or material: its parameters as keys of scene files, and rules between them.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/description.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::scene {

/// One parameter of a kind. Its key holds the name in scene files (ending in the unit), unit, range and help,
/// and through the value it is bound to the default.
struct Parameter {
    Parameter(config::Key the_key) : key(std::move(the_key)) {}
    config::Key key;
    /// The parameter can be textured: scene files then have the keys NAME_texture and NAME_texture_range too.
    bool image = false;
};
using ParameterList = std::vector<Parameter>;

/// Declares a parameter that can be textured: a number, or the first of several numbers, whose others are
/// then 0.
[[nodiscard]] inline Parameter image_or(config::Key key) {
    Parameter parameter(std::move(key));
    parameter.image = true;
    return parameter;
}

/// Violated rule between parameters: the key to report, and what is allowed.
struct Conflict {
    std::string_view key;
    std::string what;
};

/// One kind of a family, as the family's registry lists it.
template<typename Family>
struct Kind {
    std::string_view name; ///< value of the key that selects it
    std::string_view help; ///< one sentence for the reference pages
    Description<Family> (*make_default)();
    /// Parameters, bound to those of a description of this kind.
    ParameterList (*parameters)(Description<Family>& description);
    std::vector<Conflict> (*conflicts)(const Description<Family>& description);
    /// Tables and lists within the body's table, bound to the description; only those of the section count.
    config::Section (*tables)(Description<Family>& description);
};

/// The kind whose parameters are a P. Its pair of files declares beside P
///     scene::ParameterList declare(P& parameters);
/// and, if there are rules between parameters,
///     std::vector<scene::Conflict> conflicts_in(const P& parameters);
/// and, if there are tables within that of the body, a section whose tables and lists they are,
///     config::Section tables_in(P& parameters);
template<typename P>
[[nodiscard]] Kind<typename P::Family> kind_of() {
    using Any = Description<typename P::Family>;
    return {P::kind,
            P::help,
            [] { return Any(P{}); },
            [](Any& d) { return declare(d.template get<P>()); },
            []([[maybe_unused]] const Any& d) -> std::vector<Conflict> {
                if constexpr (requires(const P& p) { conflicts_in(p); })
                    return conflicts_in(d.template get<P>());
                else
                    return {};
            },
            []([[maybe_unused]] Any& d) -> config::Section {
                if constexpr (requires(P & p) { tables_in(p); })
                    return tables_in(d.template get<P>());
                else
                    return {};
            }};
}

/// The element of `kinds` with that name; null: none.
template<typename K>
[[nodiscard]] const K* find_kind(const std::vector<K>& kinds, std::string_view name) {
    const auto at =
        std::find_if(kinds.begin(), kinds.end(), [&](const K& kind) { return kind.name == name; });
    return at == kinds.end() ? nullptr : &*at;
}

/// Names of all `kinds`.
template<typename K>
[[nodiscard]] std::vector<std::string_view> names_of(const std::vector<K>& kinds) {
    std::vector<std::string_view> names;
    for (const K& kind : kinds)
        names.push_back(kind.name);
    return names;
}

[[nodiscard]] config::Keys keys_of(const ParameterList& parameters);

/// Name of a key without the unit that ends it: "slope" of slope_deg.
[[nodiscard]] std::string_view quantity_of(const config::Key& key);

/// Checks the values that `keys` are bound to, for descriptions that do not come from a file. Throws
/// ConfigError `place: name value unit: allowed range`, in SI units, at the first value out of range.
void check_ranges(const config::Keys& keys, const std::string& place);

/// Throws ConfigError for the first of `conflicts`, if any.
void refuse_conflicts(const std::vector<Conflict>& conflicts, const config::Keys& keys,
                      const std::string& place);

/// Checks ranges and rules of `description`, which must be of that kind. Throws ConfigError.
template<typename Family>
void check_description(const Kind<Family>& kind, Description<Family> description, const std::string& place) {
    const config::Keys keys = keys_of(kind.parameters(description));
    check_ranges(keys, place);
    refuse_conflicts(kind.conflicts(description), keys, place);
}

} // namespace obscura::scene
