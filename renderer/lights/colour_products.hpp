// SPDX-License-Identifier: Apache-2.0
// Spectra of light that several coloured surfaces reflect: the mean of a product is no product of means.
#pragma once

#include "renderer/scene/scene.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Corrects light that the path tracer has weighed by scene::Body::colour, the mean of each curve over
/// sunlight: for the surfaces that a path has met and the source that lights it, the integral of the source's
/// spectrum, all their curves and the band's weight, over the product of the means. Light without a spectrum
/// counts as sunlight. Thread-safe once made.
class ColourProducts {
public:
    /// The curves that a path has met, in any order; 0: none.
    using Chain = std::uint16_t;
    static constexpr Chain none = 0;
    /// Chains that are told apart; curves that a longer path meets are weighed by their own means.
    static constexpr std::size_t max_chains = 256;
    static constexpr std::size_t sun = 0; ///< source

    ColourProducts() = default;
    /// For paths of up to `max_bounces` + 1 surfaces. Bands with their responses.
    ColourProducts(const scene::Scene& scene, std::uint32_t max_bounces);

    /// Whether all factors are 1.
    [[nodiscard]] bool empty() const { return factors_.empty(); }
    /// Chain after a surface of a body; only unless empty().
    [[nodiscard]] Chain next(Chain before, std::int32_t body) const {
        const std::size_t curve = curve_of_[static_cast<std::size_t>(body)];
        return curve == no_curve ? before : next_[before * curves_ + curve];
    }
    [[nodiscard]] std::size_t source_of_lamp(std::size_t lamp) const {
        return empty() ? sun : source_of_lamp_[lamp];
    }
    [[nodiscard]] std::size_t source_of_body(std::int32_t body) const {
        return empty() ? sun : source_of_body_[static_cast<std::size_t>(body)];
    }
    /// Only unless empty().
    [[nodiscard]] double factor(Chain chain, std::size_t source, std::size_t band) const {
        return factors_[(chain * sources_ + source) * bands_ + band];
    }

private:
    static constexpr std::size_t no_curve = SIZE_MAX;

    void add_chains(std::uint32_t surfaces);

    std::size_t curves_ = 0, sources_ = 1, bands_ = 0;
    std::vector<std::size_t> curve_of_; ///< of each body, the Sun's last
    std::vector<std::size_t> source_of_lamp_, source_of_body_;
    std::vector<Chain> next_;     ///< by chain and curve
    std::vector<double> factors_; ///< by chain, source and band
};

} // namespace obscura::renderer
