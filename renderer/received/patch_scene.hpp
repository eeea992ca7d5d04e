// SPDX-License-Identifier: Apache-2.0
// Patch scene: the bodies of a scene as patches that receive, reflect and emit light, at one instant.
#pragma once

#include "renderer/passes/built_scene.hpp"
#include "renderer/received/receivers.hpp"
#include "renderer/received/reflectance_table.hpp"
#include "renderer/world/instants.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::renderer {

/// A body whose patches exchange light.
struct PatchBody {
    std::int32_t index = 0; ///< among the built bodies
    std::shared_ptr<const Receivers> receivers;
    std::size_t first = 0; ///< number of its first patch among those of all bodies
    std::shared_ptr<const ReflectanceTable> table;
    /// Factors on the reflectance and radiance emitted, W m-2 sr-1, by patch and band; one patch's if all are
    /// the same; emission empty: none.
    std::vector<float> factor, emission;

    [[nodiscard]] double factor_of(std::size_t patch, std::size_t band, std::size_t bands) const {
        return factor[factor.size() > bands ? patch * bands + band : band];
    }
    [[nodiscard]] double emission_of(std::size_t patch, std::size_t band, std::size_t bands) const {
        if (emission.empty()) return 0;
        return emission[emission.size() > bands ? patch * bands + band : band];
    }
};

/// Patches of all bodies but the Sun. Thread-safe once made.
struct PatchScene {
    const BuiltScene* built = nullptr;
    std::vector<PatchBody> bodies;
    std::vector<std::int32_t> place_of; ///< of a built body among `bodies`; -1: none, as the Sun
    std::size_t patches = 0;
    std::size_t bands = 0;
    bool mirrors = false;

    /// Index among `bodies` of the body that has a patch, by its number among those of all bodies.
    [[nodiscard]] std::size_t body_of(std::size_t patch) const;
};

[[nodiscard]] PatchScene make_patch_scene(const BuiltScene& built, std::size_t rows);

/// A patch that a ray has met.
struct PatchHit {
    static constexpr std::uint32_t none = UINT32_MAX, inner_side = UINT32_MAX - 1;
    std::uint32_t patch = none; ///< number among those of all bodies
};

/// Rays between the bodies of a scene at an instant. Thread-safe.
class PatchRays {
public:
    PatchRays(const PatchScene& scene, const RowState& row) : scene_(scene), row_(row), instants_(row) {}

    [[nodiscard]] const PatchScene& scene() const { return scene_; }
    [[nodiscard]] const RowState& row() const { return row_; }
    [[nodiscard]] const Instants& instants() const { return instants_; }
    [[nodiscard]] const BodyState& state(const PatchBody& body) const {
        return row_.bodies[static_cast<std::size_t>(body.index)];
    }
    /// Place and axis of one of the scene's lamps, in the frame of a body.
    struct LampPlace {
        Vec3 position_m, axis;
    };
    [[nodiscard]] LampPlace lamp(const PatchBody& body, std::size_t number) const;
    /// Switches off the rays (frame of `body`) that a body blocks before their `t_max`. `others`: built
    /// bodies that may, beside itself.
    void occlude(const PatchBody& body, std::span<const std::int32_t> others, RayPacket& rays) const;
    /// Nearest hits among all bodies of rays in the frame of a built body.
    void nearest(std::int32_t frame, const RayPacket& rays, HitPacket& hits) const;
    /// The patches of the hits that nearest() has found.
    void patches(std::int32_t frame, const RayPacket& rays, const HitPacket& hits,
                 PatchHit (&out)[packet_size]) const;

private:
    const PatchScene& scene_;
    const RowState& row_;
    const Instants instants_;
};

/// Force and torque of light.
struct Push {
    Vec3 force, torque;

    void add(Vec3 at_m, Vec3 push) {
        force = force + push;
        torque = torque + cross(at_m, push);
    }
    void add(const Push& other) {
        force = force + other.force;
        torque = torque + other.torque;
    }
};

} // namespace obscura::renderer
