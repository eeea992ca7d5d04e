// SPDX-License-Identifier: Apache-2.0
// Spectra of stars by spectral class and B-V.
#pragma once

#include "core/spectral_band.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Number of wavelength bins of a star's spectrum: 20 nm wide from 120 nm, 10 nm from 300 nm, 50 nm from
/// 1100 nm to 2500 nm.
inline constexpr std::size_t star_bins = 117;
using StarBins = std::array<double, star_bins>;

/// Lower wavelength of a bin, metres; `star_bins`: the end of the last one.
[[nodiscard]] double star_bin_edge_m(std::size_t bin);

/// Spectrum of a spectral class.
struct StarTemplate {
    /// What is known of the stars that it is for: their type alone, their B-V, or either.
    enum class Known : std::uint8_t { any, type, colour };

    double number;                              ///< see SpectralType
    scene::SpectralType::Luminosity luminosity; ///< dwarf, giant or supergiant
    Known known;
    double colour_b_v; ///< of this spectrum
    StarBins flux;     ///< per wavelength, mean of the bin over the mean through V
};
/// The classes of the table, by luminosity class and ascending number. Two rows are A0V: Vega, the
/// photometric zero point (first), and the class. K stars and early M giants have two: the stellar library's
/// spectrum, for the type alone, and one of the median B-V and V-I of the class.
[[nodiscard]] const std::vector<StarTemplate>& star_templates();

/// Mean irradiance per wavelength through V of a star of V = 0, W m-2 um-1.
extern const double star_v_zero_w_m2_um;

/// Effective temperature of a star from its colour, K. Ballesteros, New insights into black bodies, EPL 97,
/// 34008 (2012), eq. 14; B-V is clamped to -0.4 .. 2.5.
[[nodiscard]] double colour_temperature_k(double colour_b_v);

/// B-V of a star: its own, or that of its type, or the Sun's.
[[nodiscard]] double star_colour(const scene::Star& star);

/// Two of star_templates() that make the spectrum of a star: `first` (1 - share) + `second` share.
struct StarMix {
    std::size_t first = 0, second = 0;
    double share = 0;
};
/// The mix that star_spectrum() takes for a star of StarSpectrum::measured.
[[nodiscard]] StarMix star_mix(const scene::Star& star);

/// Spectrum of a star, scaled as StarTemplate::flux. By templates: B-V selects between two neighbours on the
/// sequence of the luminosity class; M stars, whose B-V says little, and stars without B-V go by the type's
/// number. An unknown luminosity class is a dwarf up to B-V 0.85 and a giant beyond, which in catalogues of
/// bright stars most are (Hipparcos, V < 6.5: 84 % from 0.85 to 0.95, 97 % from 0.95 on). No sequence is
/// extrapolated.
[[nodiscard]] StarBins star_spectrum(const scene::Star& star);

/// Width of each bin inside a band, um, weighted as band_weight(): the sum of its products with a star's
/// bins is the irradiance over star_v_zero_w_m2_um for V = 0. Light beyond the last bin falls with the fourth
/// power of the wavelength and counts in that bin.
[[nodiscard]] StarBins star_band_weights_um(const SpectralBand& band);

/// Irradiance of a star in the band of the weights, W/m2.
[[nodiscard]] double star_irradiance_w_m2(const scene::Star& star, const StarBins& spectrum,
                                          const StarBins& weights_um);
[[nodiscard]] double star_irradiance_w_m2(const scene::Star& star, const SpectralBand& band);

} // namespace obscura::renderer
