// SPDX-License-Identifier: Apache-2.0
// Scene file from the header of a NEAR Shoemaker Multi-Spectral Imager (MSI) frame.
#pragma once

#include <filesystem>
#include <string>

namespace obscura::tools {

struct NearMsiOptions {
    std::string mesh;              ///< path of the target's shape model (OBJ, body-fixed axes)
    double metres_per_unit = 1000; ///< length of one unit of the mesh
    std::string utc;               ///< mid-exposure; empty: from the PDS3 label beside the frame
};

/// Reads a FITS frame of 433 Eros, 537 x 244 (raw) or 537 x 412 (resampled to square pixels), and returns the
/// text of a scene file in J2000 axes with the asteroid's centre as the origin. Throws InputError with a
/// one-line message.
[[nodiscard]] std::string near_msi_scene(const std::filesystem::path& frame, const NearMsiOptions& options);

} // namespace obscura::tools
