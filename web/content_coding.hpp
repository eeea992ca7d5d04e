// SPDX-License-Identifier: Apache-2.0
// Content coding gzip of answers, and which codings a client takes (RFC 9110, 12.5.3).
#pragma once

#include <string>
#include <string_view>

namespace obscura::web {

/// Whether a header Accept-Encoding allows gzip. Without the header nothing is coded.
[[nodiscard]] bool takes_gzip(std::string_view accept_encoding);

/// The bytes as a gzip member without name and time. Throws std::bad_alloc.
[[nodiscard]] std::string gzipped(std::string_view bytes);

} // namespace obscura::web
