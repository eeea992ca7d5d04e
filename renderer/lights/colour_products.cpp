// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/colour_products.hpp"

#include "core/solar_spectrum.hpp"
#include "renderer/lights/spectrum.hpp"

#include <algorithm>
#include <map>

namespace obscura::renderer {
namespace {

using Samples = std::vector<double>;
using Curve = std::vector<SpectralPoint>;

constexpr std::size_t samples = 4000; ///< over a band, midpoint rule

double sample_at_m(const SpectralBand& band, std::size_t k) {
    return band.from_m + (static_cast<double>(k) + 0.5) * (band.to_m - band.from_m) / samples;
}

Samples sampled(const Curve& curve, const SpectralBand& band) {
    Samples values(samples);
    for (std::size_t k = 0; k < samples; ++k)
        values[k] = curve_value(curve, sample_at_m(band, k));
    return values;
}

/// Light of a source through the band; of the Sun for an empty spectrum.
Samples light_of(const Curve& spectrum, const SpectralBand& band) {
    Samples light = spectrum.empty() ? Samples(samples) : sampled(spectrum, band);
    if (spectrum.empty()) {
        const double step = (band.to_m - band.from_m) / samples;
        double all = 0;
        for (std::size_t k = 0; k < samples; ++k) {
            const double from = band.from_m + static_cast<double>(k) * step;
            all += light[k] = solar_band_irradiance_w_m2(from, from + step);
        }
        if (!(all > 0)) std::fill(light.begin(), light.end(), 1.0);
    }
    for (std::size_t k = 0; k < samples; ++k)
        light[k] *= band_weight(band, sample_at_m(band, k));
    return light;
}

double sum_of_product(const Samples& a, const Samples& b) {
    double sum = 0;
    for (std::size_t k = 0; k < samples; ++k)
        sum += a[k] * b[k];
    return sum;
}

/// Index of a curve among those listed, where it is added if need be.
std::size_t listed(std::vector<Curve>& list, const Curve& curve) {
    const auto found = std::find(list.begin(), list.end(), curve);
    if (found != list.end()) return static_cast<std::size_t>(found - list.begin());
    list.push_back(curve);
    return list.size() - 1;
}

} // namespace

void ColourProducts::add_chains(std::uint32_t surfaces) {
    // How often each curve has been met, by rising number of surfaces.
    std::map<std::vector<std::uint32_t>, Chain> chains{{std::vector<std::uint32_t>(curves_), none}};
    std::vector<std::vector<std::uint32_t>> met{chains.begin()->first};
    std::size_t begin = 0;
    for (std::uint32_t k = 0; k < surfaces; ++k)
        for (const std::size_t end = met.size(); begin < end; ++begin)
            for (std::size_t curve = 0; curve < curves_; ++curve) {
                std::vector<std::uint32_t> more = met[begin];
                ++more[curve];
                auto found = chains.find(more);
                if (found == chains.end() && met.size() < max_chains) {
                    found = chains.emplace(more, static_cast<Chain>(met.size())).first;
                    met.push_back(more);
                }
                next_.push_back(found == chains.end() ? static_cast<Chain>(begin) : found->second);
            }
    // Longer ones are not told apart.
    for (; begin < met.size(); ++begin)
        next_.insert(next_.end(), curves_, static_cast<Chain>(begin));
}

ColourProducts::ColourProducts(const scene::Scene& scene, std::uint32_t max_bounces)
    : bands_(scene.bands.size()) {
    std::vector<Curve> curves, spectra{{}};
    for (const scene::Body& body : scene.bodies) {
        curve_of_.push_back(body.colour_curve.empty() ? no_curve : listed(curves, body.colour_curve));
        source_of_body_.push_back(listed(spectra, body.emission_spectrum));
    }
    curve_of_.push_back(no_curve);
    source_of_body_.push_back(sun);
    for (const scene::Lamp& lamp : scene.lamps)
        source_of_lamp_.push_back(listed(spectra, lamp.spectrum));
    curves_ = curves.size();
    sources_ = spectra.size();
    // One reflection of sunlight is what the colours are made for.
    if (curves.empty() || (max_bounces == 0 && sources_ == 1)) return;
    add_chains(max_bounces + 1);
    const std::size_t chains = next_.size() / curves_;
    factors_.assign(chains * sources_ * bands_, 1.0);
    for (std::size_t b = 0; b < bands_; ++b) {
        const SpectralBand& band = scene.bands[b];
        std::vector<Samples> lights, values, products(chains);
        for (const Curve& spectrum : spectra)
            lights.push_back(light_of(spectrum, band));
        std::vector<double> means, mean_products(chains, 1.0);
        for (const Curve& curve : curves) {
            values.push_back(sampled(curve, band));
            means.push_back(sunlit_mean(curve, band));
        }
        products[none].assign(samples, 1.0);
        std::vector<std::size_t> lengths(chains, 0);
        for (std::size_t chain = 0; chain < chains; ++chain)
            for (std::size_t curve = 0; curve < curves_; ++curve) {
                const Chain next = next_[chain * curves_ + curve];
                if (next == chain || !products[next].empty()) continue;
                products[next] = products[chain];
                for (std::size_t k = 0; k < samples; ++k)
                    products[next][k] *= values[curve][k];
                mean_products[next] = mean_products[chain] * means[curve];
                lengths[next] = lengths[chain] + 1;
            }
        const Samples ones(samples, 1.0);
        for (std::size_t chain = 1; chain < chains; ++chain)
            for (std::size_t source = 0; source < sources_; ++source) {
                const double all = sum_of_product(lights[source], ones) * mean_products[chain];
                if (!(all > 0) || (source == sun && lengths[chain] == 1)) continue;
                factors_[(chain * sources_ + source) * bands_ + b] =
                    sum_of_product(lights[source], products[chain]) / all;
            }
    }
}

} // namespace obscura::renderer
