// SPDX-License-Identifier: Apache-2.0
// Spectral bands and tabulated curves over wavelength.
#pragma once

#include <vector>

namespace obscura {

/// One point of a tabulated curve over wavelength.
struct SpectralPoint {
    double wavelength_m = 0;
    double value = 0;

    [[nodiscard]] bool operator==(const SpectralPoint&) const = default;
};

/// A spectral band: the passband of a filter between two wavelengths.
struct SpectralBand {
    double from_m = 400e-9, to_m = 900e-9;
    /// Transmission of filter and optics: points of increasing wavelength, linear between them, constant
    /// beyond; empty: 1. If it includes the sensor's quantum efficiency, pixels hold the light that the
    /// detector converts.
    std::vector<SpectralPoint> transmission{};
    /// Weight of light in place of the transmission, which it includes, for images that a detector converts:
    /// see renderer::set_detector_response(). Form as above; empty: the transmission.
    std::vector<SpectralPoint> response{};

    [[nodiscard]] bool operator==(const SpectralBand&) const = default;
    /// Whether both are of one filter, whatever the detectors behind it.
    [[nodiscard]] bool same_filter(const SpectralBand& other) const {
        return from_m == other.from_m && to_m == other.to_m && transmission == other.transmission;
    }
};

} // namespace obscura
