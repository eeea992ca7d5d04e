// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/scene_tree.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "renderer/scene/position.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

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
    if (parent.empty()) return no_parent;
    if (parent == camera_name) return camera_parent;
    const std::int32_t index = index_of(bodies, parent);
    if (index < 0)
        throw ConfigError(fmt::format("{}: its parent '{}' is no body of the scene{}", place, parent,
                                      did_you_mean(parent, names_of(bodies))));
    return index;
}

namespace {

/// The tree of a scene as numbers: bodies by their index, the camera after them.
class Tree {
public:
    Tree(const Scene& scene, std::vector<std::int32_t> parents) : scene_(scene), up_(std::move(parents)) {
        const std::string& own = scene.camera.parent;
        camera_ = static_cast<std::int32_t>(up_.size());
        up_.push_back(own.empty()          ? no_parent
                      : own == camera_name ? camera_parent
                                           : index_of(scene.bodies, own));
        for (std::int32_t& up : up_)
            if (up == camera_parent) up = camera_;
    }
    [[nodiscard]] std::int32_t camera() const { return camera_; }
    [[nodiscard]] std::string name(std::int32_t i) const {
        return i == camera_ ? std::string(camera_name) : scene_.bodies[static_cast<std::size_t>(i)].name;
    }
    [[nodiscard]] std::int32_t up(std::int32_t i) const { return up_[static_cast<std::size_t>(i)]; }
    /// "a -> b -> a" if the parents of `i` go in a circle, else empty.
    [[nodiscard]] std::string circle_above(std::int32_t i) const {
        // More steps up than there are things: the parents are circular.
        std::size_t steps = 0;
        while (i >= 0 && steps++ <= up_.size())
            i = up(i);
        if (i < 0) return {};
        std::string circle = name(i);
        for (std::int32_t at = up(i);; at = up(at)) {
            circle += " -> " + name(at);
            if (at == i) return circle;
        }
    }
    /// Whether `i` hangs on the camera, if nothing is circular.
    [[nodiscard]] bool on_camera(std::int32_t i) const {
        while (i >= 0 && i != camera_)
            i = up(i);
        return i == camera_;
    }

private:
    const Scene& scene_;
    std::vector<std::int32_t> up_;
    std::int32_t camera_ = 0;
};

} // namespace

std::vector<std::int32_t> parents_of(const Scene& scene) {
    const std::vector<Body>& bodies = scene.bodies;
    std::vector<std::int32_t> parents;
    for (const Body& body : bodies)
        parents.push_back(at_position(body.position, [&] {
            return parent_of(bodies, body.parent, body.joint, fmt::format("body '{}'", body.name));
        }));
    const Tree tree(scene, parents);
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (const std::string circle = tree.circle_above(static_cast<std::int32_t>(b)); !circle.empty())
            throw ConfigError(placed(bodies[b].position, fmt::format("body '{}': parents go in a circle: {}",
                                                                     bodies[b].name, circle)));
    if (const std::string circle = tree.circle_above(tree.camera()); !circle.empty())
        throw ConfigError(
            placed(scene.camera.position, fmt::format("camera: parents go in a circle: {}", circle)));
    if (const auto& aim = scene.camera.motion.aim)
        if (const std::int32_t target = index_of(bodies, aim->body); target >= 0 && tree.on_camera(target))
            throw ConfigError(placed(
                scene.camera.position,
                fmt::format("camera: look_at: '{}' hangs on the camera; allowed are bodies that do not",
                            printable(aim->body))));
    return parents;
}

std::vector<std::string_view> names_of(const std::vector<Body>& bodies) {
    std::vector<std::string_view> names;
    for (const Body& body : bodies)
        names.push_back(body.name);
    return names;
}

std::string explain_missing_target(const Scene& scene, const Motion& motion) {
    if (!motion.aim || motion.aim->body.empty() || motion.aim->body == sun_name ||
        index_of(scene.bodies, motion.aim->body) >= 0)
        return {};
    std::string names;
    std::vector<std::string_view> known{sun_name};
    for (const Body& body : scene.bodies) {
        names += fmt::format("{}, ", body.name);
        known.push_back(body.name);
    }
    for (const Landmark& landmark : scene.landmarks) {
        names += fmt::format("{}, ", landmark.name);
        known.push_back(landmark.name);
    }
    return fmt::format("\"{}\" is no body or landmark of the scene; there are {}{}{}",
                       printable(motion.aim->body), names, sun_name, did_you_mean(motion.aim->body, known));
}

} // namespace obscura::scene
