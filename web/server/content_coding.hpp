// SPDX-License-Identifier: Apache-2.0
// Content negotiation: coding gzip of answers, and media types (RFC 9110, 12.5).
#pragma once

#include <string>
#include <string_view>

namespace obscura::web {

/// Whether a header Accept-Encoding allows gzip. Without the header nothing is coded.
[[nodiscard]] bool takes_gzip(std::string_view accept_encoding);

/// Weight that a header Accept gives a media type, 0 to 1: that of the most specific range that has it.
/// Without the header 1.
[[nodiscard]] double accepted(std::string_view accept, std::string_view type);

/// The bytes as a gzip member without name and time. Throws std::bad_alloc.
[[nodiscard]] std::string gzipped(std::string_view bytes);

} // namespace obscura::web
