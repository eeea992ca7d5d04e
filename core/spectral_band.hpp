// Spectral bands: curves over wavelength, and the wavelengths that one plane of a frame holds.
#pragma once

#include <vector>

namespace obscura {

/// One point of a tabulated curve over wavelength.
struct SpectralPoint {
    double wavelength_m = 0;
    double value = 0;

    [[nodiscard]] bool operator==(const SpectralPoint&) const = default;
};

/// A spectral band: what a filter lets through between two wavelengths.
struct SpectralBand {
    double from_m = 400e-9, to_m = 900e-9;
    /// Of filter and optics, increasing in wavelength, linear between, held beyond; empty: 1. With the
    /// sensor's quantum efficiency as a factor, pixels hold what the detector makes use of.
    std::vector<SpectralPoint> transmission{};

    [[nodiscard]] bool operator==(const SpectralBand&) const = default;
};

} // namespace obscura
