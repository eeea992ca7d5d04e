// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/scene_tree.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "renderer/scene/position.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::scene {

std::int32_t index_of(const std::vector<Body>& bodies, const std::string& name) noexcept {
    const auto at = std::find_if(bodies.begin(), bodies.end(), [&](const Body& b) { return b.name == name; });
    return at == bodies.end() ? -1 : static_cast<std::int32_t>(at - bodies.begin());
}

std::int32_t parent_of(const std::vector<Body>& bodies, const std::string& parent, const Joint& joint,
                       const std::string& place) {
    if (joint.kind != Joint::Kind::fixed && !(length(joint.axis) > 0 && is_finite(joint.axis)))
        throw ConfigError(fmt::format("{}: its joint needs a finite axis that is not zero", place));
    for (std::size_t i = 0; i < joint.samples.size(); ++i) {
        const Joint::Sample& s = joint.samples[i];
        if (!std::isfinite(s.time_s) || !std::isfinite(s.value))
            throw ConfigError(fmt::format("{}: value {} of its joint is not finite", place, i + 1));
        if (i > 0 && !(s.time_s > joint.samples[i - 1].time_s))
            throw ConfigError(fmt::format(
                "{}: time of value {} of its joint is not later than that of value {}", place, i + 1, i));
    }
    if (parent.empty()) return -1;
    const std::int32_t index = index_of(bodies, parent);
    if (index < 0)
        throw ConfigError(fmt::format("{}: its parent '{}' is no body of the scene", place, parent));
    return index;
}

std::vector<std::int32_t> parents_of(const std::vector<Body>& bodies) {
    std::vector<std::int32_t> parents;
    for (const Body& body : bodies)
        parents.push_back(at_position(body.position, [&] {
            return parent_of(bodies, body.parent, body.joint, fmt::format("body '{}'", body.name));
        }));
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        // More steps up than there are bodies: the parents are circular.
        std::size_t steps = 0;
        std::int32_t up = parents[b];
        while (up >= 0 && steps <= bodies.size()) {
            up = parents[static_cast<std::size_t>(up)];
            ++steps;
        }
        if (up < 0) continue;
        std::string circle = bodies[static_cast<std::size_t>(up)].name;
        for (std::int32_t at = parents[static_cast<std::size_t>(up)];;
             at = parents[static_cast<std::size_t>(at)]) {
            circle += " -> " + bodies[static_cast<std::size_t>(at)].name;
            if (at == up) break;
        }
        throw ConfigError(placed(bodies[b].position, fmt::format("body '{}': parents go in a circle: {}",
                                                                 bodies[b].name, circle)));
    }
    return parents;
}

std::string explain_missing_target(const std::vector<Body>& bodies, const Motion& motion) {
    if (!motion.aim || motion.aim->body.empty() || motion.aim->body == sun_name ||
        index_of(bodies, motion.aim->body) >= 0)
        return {};
    std::string names;
    for (const Body& body : bodies)
        names += fmt::format("{}, ", body.name);
    return fmt::format("\"{}\" is no body of the scene; there are {}{}", printable(motion.aim->body), names,
                       sun_name);
}

} // namespace obscura::scene
