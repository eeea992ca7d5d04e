// Things of which there are several kinds (shapes, materials): one line per kind in a table.
#pragma once

#include "config/keys.hpp"
#include "renderer/scene/scene.hpp"

#include <string_view>
#include <vector>

namespace obscura::scene {

/// One kind: the word that chooses it, how it is made, the keys it has beside those of every kind.
template<typename Variant>
struct Kind {
    std::string_view name;
    Variant (*make)();
    config::Keys (*keys)(Variant&);
    std::vector<std::string_view> required;
};

[[nodiscard]] const std::vector<Kind<scene::Shape>>& shape_kinds();
[[nodiscard]] const std::vector<Kind<scene::Material>>& material_kinds();

/// The words that choose among `kinds`.
template<typename Variant>
[[nodiscard]] std::vector<std::string_view> names_of(const std::vector<Kind<Variant>>& kinds) {
    std::vector<std::string_view> names;
    for (const Kind<Variant>& kind : kinds)
        names.push_back(kind.name);
    return names;
}

/// The names of the kinds that have `key`.
template<typename Variant>
[[nodiscard]] std::vector<std::string_view> kinds_with(const std::vector<Kind<Variant>>& kinds,
                                                       std::string_view key) {
    std::vector<std::string_view> names;
    for (const Kind<Variant>& kind : kinds) {
        Variant made = kind.make();
        for (const config::Key& k : kind.keys(made))
            if (k.name == key) names.push_back(kind.name);
    }
    return names;
}

} // namespace obscura::scene
