// SPDX-License-Identifier: Apache-2.0
// Solar spectral irradiance at 1 au (ASTM E490), shared by renderer and sensors.
#pragma once

namespace obscura {

/// Wavelength range of the table, metres.
constexpr double solar_spectrum_from_m = 200e-9;
constexpr double solar_spectrum_to_m = 4000e-9;

/// Irradiance of the whole solar spectrum at 1 au, 119.5 nm to 1 mm, W/m2: ASTM E490-00a.
constexpr double solar_constant_w_m2 = 1366.1;

/// IAU 2012 resolution B2.
constexpr double astronomical_unit_m = 149'597'870'700.0;

/// Spectral irradiance of the Sun at 1 au, W m-2 per metre of wavelength: ASTM E490-00a (2000), "Standard
/// Solar Constant and Zero Air Mass Solar Spectral Irradiance Tables", averaged over 10 nm bins (a step
/// function). 0 outside 200 nm .. 4 um; the table holds 1354.2 W/m2 of solar_constant_w_m2.
[[nodiscard]] double solar_spectral_irradiance_w_m3(double wavelength_m) noexcept;

/// Integral of the spectral irradiance from `from_m` to `to_m`, W/m2 at 1 au; exact at multiples of 10 nm. 0
/// if to_m <= from_m.
[[nodiscard]] double solar_band_irradiance_w_m2(double from_m, double to_m) noexcept;

} // namespace obscura
