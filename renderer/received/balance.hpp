// SPDX-License-Identifier: Apache-2.0
// Balance of light between patches: what each one receives from the others, reflection after reflection.
#pragma once

#include "renderer/received/caustics.hpp"
#include "renderer/received/direct_irradiance.hpp"
#include "renderer/received/exchange.hpp"
#include "renderer/received/patch_scene.hpp"
#include "renderer/received/received_light.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Solves B = M + rho (E + F B) for the radiosities B: M is what patches emit and reflect of direct light by
/// their law, rho the reflectance of diffuse light, F the exchange. Beyond the first reflection surfaces
/// count as Lambert's; the first reflection of the Sun by a body far away keeps its law. Mirrors reflect to
/// no patch: their light is in the caustics. Refers to its arguments.
class Balance {
public:
    Balance(const PatchRays& rays, std::span<const BodyExchange> exchange,
            std::span<const DirectIrradiance> direct, const Caustics& caustics,
            std::span<const double> sun_w_m2);

    /// At most so many reflections; returns after how many the light was in balance.
    std::uint32_t solve(std::uint32_t max_bounces);
    /// Light of PatchScene::bodies[i]; without its name. `seed`: that of the exchange.
    [[nodiscard]] BodyReceivedLight light_of(std::size_t i, std::uint64_t seed) const;

private:
    void set_sources();
    /// Adds what the law of bodies far away makes of the Sun's first reflection to `far_`, beyond Lambert's.
    void correct_far(std::size_t i);
    /// Irradiance of exchanged light on all patches.
    void gather(std::size_t i);
    [[nodiscard]] Push exchanged_push(std::size_t i, std::uint64_t seed) const;
    [[nodiscard]] double caustic_w_m2(std::size_t i, std::size_t patch, std::size_t band) const;
    void add_sums(std::size_t i, BodyReceivedLight& out) const;

    const PatchRays& rays_;
    const PatchScene& scene_;
    const std::span<const BodyExchange> exchange_;
    const std::span<const DirectIrradiance> direct_;
    const Caustics& caustics_;
    const std::span<const double> sun_w_m2_;
    const std::size_t bands_;
    std::vector<float> source_;     ///< M, [patch of all bodies * bands + band]
    std::vector<float> radiosity_;  ///< B
    std::vector<float> near_, far_; ///< irradiance by the exchange
    std::vector<float> far_law_;    ///< part of `far_` by correct_far()
};

} // namespace obscura::renderer
