// NEAR Shoemaker's Multi-Spectral Imager: a scene from the header of one of its frames.
#pragma once

#include <filesystem>
#include <string>

namespace obscura::tools {

struct NearMsiOptions {
    std::string mesh;              ///< of the target
    double metres_per_unit = 1000; ///< of the mesh
    std::string utc;               ///< of mid-exposure; empty: from the PDS3 label beside the frame
};

/// Reads a FITS frame of 433 Eros in the 537 x 412 format (square pixels) and returns the text of a scene
/// file in J2000 axes with the asteroid's centre as the origin. Throws InputError with one line.
[[nodiscard]] std::string near_msi_scene(const std::filesystem::path& frame, const NearMsiOptions& options);

} // namespace obscura::tools
