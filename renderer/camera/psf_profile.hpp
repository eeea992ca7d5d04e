// SPDX-License-Identifier: Apache-2.0
// Radially symmetric point spread functions: light per px^2 by radius.
#pragma once

#include <vector>

namespace obscura::renderer {

/// Light per px^2 at radii of 0, step, 2 step ..., normalised to 1 in all; linear between.
struct PsfProfile {
    double step_px = 1.0 / 64;
    std::vector<double> values;

    [[nodiscard]] double at(double radius_px) const;
};

/// A round aperture, diffraction alone. Schroeder, Astronomical Optics (2000), eq. 10.2.10.
struct Aperture {
    double f_number = 2;
    double obscuration = 0; ///< diameter of the central obscuration over the aperture's
    double pitch_m = 10e-6;
};

/// Airy pattern at one wavelength, light per px^2 at `radius_px`.
[[nodiscard]] double airy_psf(const Aperture& aperture, double wavelength_m, double radius_px);
/// Diffraction pattern with the focus `defocus_m` off the sensor, by the diffraction integral over the pupil;
/// for defocus 0 equal to airy_psf(). Born and Wolf, Principles of Optics, 8.8.1.
[[nodiscard]] double defocused_psf(const Aperture& aperture, double wavelength_m, double defocus_m,
                                   double radius_px);

/// Geometric disc or annulus of light, blurred by a Gaussian.
[[nodiscard]] double blurred_annulus_psf(double inner_px, double outer_px, double sigma_px, double radius_px);

} // namespace obscura::renderer
