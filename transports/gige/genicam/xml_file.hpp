// SPDX-License-Identifier: Apache-2.0
// GenICam files as cameras hand them out: XML, plain or in a zip archive.
#pragma once

#include <string>

namespace obscura::transports::gige {

/// The XML of a GenICam file as plain text: a byte order mark is gone, CR LF is LF, and the NUL bytes with
/// which a camera fills its last word are cut. An archive in zip format holds one file *.xml, stored or
/// deflated. Throws ConfigError "FILE: what", which names no key.
[[nodiscard]] std::string contents_of_genicam_file(const std::string& file);

} // namespace obscura::transports::gige
