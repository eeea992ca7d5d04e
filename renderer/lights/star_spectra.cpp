// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/star_spectra.hpp"

#include "renderer/lights/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace obscura::renderer {
namespace {

using scene::SpectralType;
using Luminosity = SpectralType::Luminosity;

constexpr double sun_b_v = 0.65;
constexpr double first_m_type = 6;

/// V of Bessell, UBVRI passbands, PASP 102, 1181 (1990), table 2.
const SpectralBand& band_v() {
    static const SpectralBand band = [] {
        constexpr std::array transmissions{0.0,  .03,  .163, .458, .78,  .967, 1.0,  .973,
                                           .898, .792, .684, .574, .461, .359, .27,  .197,
                                           .135, .081, .045, .025, .017, .013, .009, 0.0};
        SpectralBand v{470e-9, 700e-9};
        for (std::size_t i = 0; i < transmissions.size(); ++i)
            v.transmission.push_back({(470 + 10 * static_cast<double>(i)) * 1e-9, transmissions[i]});
        return v;
    }();
    return band;
}

double product_of_curves(const StarBins& a, const StarBins& b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

double colour_of(const StarTemplate& t) {
    return t.colour_b_v;
}
double number_of(const StarTemplate& t) {
    return t.number;
}

/// Whether a template belongs to the stars of a luminosity class. Classes that the table lacks are taken from
/// the next one: early giants are as dwarfs, late M dwarfs and late supergiants as giants.
bool belongs(const StarTemplate& t, Luminosity luminosity) {
    constexpr double last_early_giant = 4.6;
    constexpr double last_dwarf = 6.2;
    constexpr double first_late_supergiant = 4.9;
    switch (luminosity) {
    case Luminosity::dwarf:
        return t.luminosity == Luminosity::dwarf || t.number > last_dwarf;
    case Luminosity::giant:
        return t.luminosity == Luminosity::giant ||
               (t.luminosity == Luminosity::dwarf && t.number < last_early_giant);
    case Luminosity::supergiant:
        return t.luminosity == Luminosity::supergiant ||
               (t.luminosity == Luminosity::giant && t.number > first_late_supergiant);
    case Luminosity::unknown:
        break;
    }
    constexpr double giants_from_b_v = 0.85;
    return t.luminosity == (t.colour_b_v < giants_from_b_v ? Luminosity::dwarf : Luminosity::giant);
}

/// Templates of a luminosity class in order of their colour or their number.
class Sequence {
public:
    using Order = double (*)(const StarTemplate&);

    Sequence(Luminosity luminosity, Order order) : order_(order) {
        constexpr double last_by_colour = 6.15; // later M stars are no redder in B-V
        const bool by_number = order == number_of;
        const auto other = by_number ? StarTemplate::Known::colour : StarTemplate::Known::type;
        for (const StarTemplate& t : star_templates())
            if (belongs(t, luminosity) && t.known != other && (by_number || t.number < last_by_colour))
                templates_.push_back(&t);
        std::stable_sort(templates_.begin(), templates_.end(),
                         [order](const auto* a, const auto* b) { return order(*a) < order(*b); });
    }

    /// Mix at `x`, linear between neighbours, which keeps the mean through V; ends hold.
    [[nodiscard]] StarMix at(double x) const {
        const auto above =
            std::upper_bound(templates_.begin(), templates_.end(), x,
                             [this](double at, const StarTemplate* t) { return at < order_(*t); });
        if (above == templates_.begin()) return {index(templates_.front()), index(templates_.front()), 0};
        const StarTemplate* const a = *(above - 1);
        if (above == templates_.end()) return {index(a), index(a), 0};
        const StarTemplate* const b = *above;
        return {index(a), index(b), (x - order_(*a)) / (order_(*b) - order_(*a))};
    }

    /// Colour of the neighbour at or before `x`.
    [[nodiscard]] double colour_at(double x) const {
        const StarTemplate* found = templates_.front();
        for (const StarTemplate* t : templates_)
            if (order_(*t) <= x) found = t;
        return found->colour_b_v;
    }

private:
    [[nodiscard]] static std::size_t index(const StarTemplate* t) {
        return static_cast<std::size_t>(t - star_templates().data());
    }

    Order order_;
    std::vector<const StarTemplate*> templates_;
};

const Sequence& by_colour(Luminosity luminosity) {
    static const std::array sequences{
        Sequence{Luminosity::unknown, colour_of}, Sequence{Luminosity::dwarf, colour_of},
        Sequence{Luminosity::giant, colour_of}, Sequence{Luminosity::supergiant, colour_of}};
    return sequences[static_cast<std::size_t>(luminosity)];
}

const Sequence& by_number(Luminosity luminosity) {
    static const std::array sequences{
        Sequence{Luminosity::giant, number_of}, Sequence{Luminosity::dwarf, number_of},
        Sequence{Luminosity::giant, number_of}, Sequence{Luminosity::supergiant, number_of}};
    return sequences[static_cast<std::size_t>(luminosity)];
}

bool has_number(const scene::Star& star) {
    return star.type && !std::isnan(star.type->number);
}

/// Planck's law up to a constant factor.
double black_body(double wavelength_m, double temperature_k) {
    constexpr double c2_m_k = 1.438776877e-2; // second radiation constant, CODATA 2018
    return std::pow(wavelength_m, -5) / std::expm1(c2_m_k / (wavelength_m * temperature_k));
}

StarBins black_body_bins(double temperature_k) {
    static const StarBins v_um = star_band_weights_um(band_v());
    StarBins flux{};
    for (std::size_t i = 0; i < star_bins; ++i)
        flux[i] = black_body((star_bin_edge_m(i) + star_bin_edge_m(i + 1)) / 2, temperature_k);
    const double scale = std::accumulate(v_um.begin(), v_um.end(), 0.0) / product_of_curves(flux, v_um);
    for (double& f : flux)
        f *= scale;
    return flux;
}

/// Integral of a band's weight, which is linear between its points, over a range inside the band, m.
double integral(const SpectralBand& band, double from_m, double to_m) {
    double sum = 0;
    double a = from_m;
    const auto add_to = [&](double b) {
        sum += (b - a) * (band_weight(band, a) + band_weight(band, b)) / 2;
        a = b;
    };
    for (const SpectralPoint& p : weights_of(band))
        if (p.wavelength_m > a && p.wavelength_m < to_m) add_to(p.wavelength_m);
    add_to(to_m);
    return sum;
}

} // namespace

double star_bin_edge_m(std::size_t bin) {
    constexpr std::size_t fine = 9; // first bin 10 nm wide, and first bin 50 nm wide
    constexpr std::size_t coarse = 89;
    const auto n = static_cast<double>(bin);
    if (bin <= fine) return (120 + 20 * n) * 1e-9;
    if (bin <= coarse) return (300 + 10 * (n - fine)) * 1e-9;
    return (1100 + 50 * (n - coarse)) * 1e-9;
}

double colour_temperature_k(double colour_b_v) {
    const double c = 0.92 * std::clamp(colour_b_v, -0.4, 2.5);
    return 4600 * (1 / (c + 1.7) + 1 / (c + 0.62));
}

double star_colour(const scene::Star& star) {
    if (star.colour_b_v) return *star.colour_b_v;
    return has_number(star) ? by_number(star.type->luminosity).colour_at(star.type->number) : sun_b_v;
}

StarMix star_mix(const scene::Star& star) {
    if (!has_number(star))
        return by_colour(star.type ? star.type->luminosity : Luminosity::unknown)
            .at(star.colour_b_v.value_or(sun_b_v));
    if (!star.colour_b_v || star.type->number >= first_m_type)
        return by_number(star.type->luminosity).at(star.type->number);
    return by_colour(star.type->luminosity).at(*star.colour_b_v);
}

StarBins star_spectrum(const scene::Star& star) {
    if (star.spectrum == scene::StarSpectrum::black_body)
        return black_body_bins(colour_temperature_k(star_colour(star)));
    const StarMix mix = star_mix(star);
    const StarBins& a = star_templates()[mix.first].flux;
    const StarBins& b = star_templates()[mix.second].flux;
    StarBins flux{};
    for (std::size_t i = 0; i < star_bins; ++i)
        flux[i] = a[i] + mix.share * (b[i] - a[i]);
    return flux;
}

StarBins star_band_weights_um(const SpectralBand& band) {
    StarBins weights{};
    for (std::size_t i = 0; i < star_bins; ++i) {
        const double from = std::max(band.from_m, star_bin_edge_m(i));
        const double to = std::min(band.to_m, star_bin_edge_m(i + 1));
        if (to > from) weights[i] = integral(band, from, to) * 1e6;
    }
    const double from = std::max(band.from_m, star_bin_edge_m(star_bins));
    constexpr int steps = 400;
    const double step = (band.to_m - from) / steps;
    const double middle = (star_bin_edge_m(star_bins - 1) + star_bin_edge_m(star_bins)) / 2;
    for (int i = 0; i < steps && step > 0; ++i) {
        const double wavelength = from + (i + 0.5) * step;
        weights.back() += band_weight(band, wavelength) * std::pow(middle / wavelength, 4) * step * 1e6;
    }
    return weights;
}

double star_irradiance_w_m2(const scene::Star& star, const StarBins& spectrum, const StarBins& weights_um) {
    return star_v_zero_w_m2_um * std::pow(10, -0.4 * star.magnitude_v) *
           product_of_curves(spectrum, weights_um);
}

double star_irradiance_w_m2(const scene::Star& star, const SpectralBand& band) {
    return star_irradiance_w_m2(star, star_spectrum(star), star_band_weights_um(band));
}

} // namespace obscura::renderer
