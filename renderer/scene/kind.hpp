// SPDX-License-Identifier: Apache-2.0
// Declaration of a kind of shape or material: its parameters as keys of scene files, and the rules between
// them.
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/description.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::scene {

/// One parameter of a kind. Its key holds the name in scene files (with the unit as its end), unit, range,
/// help and, by the value that it is bound to, the default.
struct Parameter {
    Parameter(config::Key the_key) : key(std::move(the_key)) {}
    config::Key key;
    /// An image may give the parameter place by place: scene files have the keys NAME_texture and
    /// NAME_texture_range as well.
    bool image = false;
};
using ParameterList = std::vector<Parameter>;

/// A parameter that an image may give: a number, or the first of several numbers, of which the others are
/// then 0.
[[nodiscard]] inline Parameter image_or(config::Key key) {
    Parameter parameter(std::move(key));
    parameter.image = true;
    return parameter;
}

/// A rule between several parameters that does not hold: the key to complain of, and what is allowed.
struct Conflict {
    std::string_view key;
    std::string what;
};

/// A kind of a family, as the family's registry lists it.
template<typename Family>
struct Kind {
    std::string_view name; ///< the word that chooses it
    std::string_view help; ///< what it is: one sentence for the reference
    Description<Family> (*make_default)();
    /// The parameters bound to those of a description of this kind.
    ParameterList (*parameters)(Description<Family>& description);
    std::vector<Conflict> (*conflicts)(const Description<Family>& description);
};

/// The kind whose parameters are a P. The pair of files of the kind declares beside P
///     scene::ParameterList declare(P& parameters);
/// and, where there are rules between parameters,
///     std::vector<scene::Conflict> conflicts_in(const P& parameters);
template<typename P>
[[nodiscard]] Kind<typename P::Family> kind_of() {
    using Any = Description<typename P::Family>;
    return {P::kind, P::help, [] { return Any(P{}); }, [](Any& d) { return declare(d.template get<P>()); },
            []([[maybe_unused]] const Any& d) -> std::vector<Conflict> {
                if constexpr (requires(const P& p) { conflicts_in(p); })
                    return conflicts_in(d.template get<P>());
                else
                    return {};
            }};
}

/// The row of `kinds` that is called `name`; null: none.
template<typename K>
[[nodiscard]] const K* find_kind(const std::vector<K>& kinds, std::string_view name) {
    const auto at =
        std::find_if(kinds.begin(), kinds.end(), [&](const K& kind) { return kind.name == name; });
    return at == kinds.end() ? nullptr : &*at;
}

/// The words that choose among `kinds`.
template<typename K>
[[nodiscard]] std::vector<std::string_view> names_of(const std::vector<K>& kinds) {
    std::vector<std::string_view> names;
    for (const K& kind : kinds)
        names.push_back(kind.name);
    return names;
}

[[nodiscard]] config::Keys keys_of(const ParameterList& parameters);

/// Name of a key's quantity without the unit that ends it: "slope" of slope_deg.
[[nodiscard]] std::string_view quantity_of(const config::Key& key);

/// Checks the values that `keys` are bound to, of a description that did not come from a file. Throws
/// ConfigError `place: name value unit: allowed range`, in SI units, at the first that is out of its range.
void check_ranges(const config::Keys& keys, const std::string& place);

/// Throws ConfigError for the first of `conflicts`, if any.
void refuse_conflicts(const std::vector<Conflict>& conflicts, const config::Keys& keys,
                      const std::string& place);

/// Checks ranges and rules of `description`, which is of that kind. Throws ConfigError.
template<typename Family>
void check_description(const Kind<Family>& kind, Description<Family> description, const std::string& place) {
    const config::Keys keys = keys_of(kind.parameters(description));
    check_ranges(keys, place);
    refuse_conflicts(kind.conflicts(description), keys, place);
}

} // namespace obscura::scene
