// SPDX-License-Identifier: Apache-2.0
// EMVA 1288 characterisation of a running camera by series of exposure times.
#pragma once

#include "tools/characterise/characterise_report.hpp"
#include "tools/receive/camera_series.hpp"

namespace obscura::tools {

struct CameraOptions {
    CameraSeriesSettings series;
    double photons_per_s = 0; ///< photons per pixel and second; 0: unknown
    bool dark = false;        ///< the series is taken without light
    /// System gain K of an earlier lit series, used with `dark`; 0: unknown.
    double gain_dn_per_e = 0;
};

/// Dark noise, DSNU and dark current of a series without light. In electrons if K is given, else in DN.
[[nodiscard]] Characterisation characterise_dark_camera(const CameraSeries& series,
                                                        const CameraOptions& options);

/// Photon transfer under constant light with varying exposure time. The shortest exposure replaces the dark
/// image, so dark current counts as light; its statistics are the same (Poisson). Throws HardwareError.
[[nodiscard]] Characterisation characterise_lit_camera(const CameraSeries& series,
                                                       const CameraOptions& options);

} // namespace obscura::tools
