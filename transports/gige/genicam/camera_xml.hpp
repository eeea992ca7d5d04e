// SPDX-License-Identifier: Apache-2.0
// The GenICam description of this camera, zipped at build time from camera.xml.
#pragma once

#include <cstdint>
#include <span>

namespace obscura::transports::gige {

/// The zip archive that clients read; static storage.
[[nodiscard]] std::span<const std::uint8_t> zipped_camera_xml() noexcept;

} // namespace obscura::transports::gige
