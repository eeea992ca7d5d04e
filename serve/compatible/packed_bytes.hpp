// SPDX-License-Identifier: Apache-2.0
// Compressed byte arrays of the published client: zlib behind a length, or one LZ4 block.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace obscura::serve {

/// Data behind the four bytes of a length, which is that of the compressed or of the plain bytes, depending
/// on who wrote it, and is not used. Throws Failure: bad_argument if it is no zlib stream, too_large beyond
/// `most` bytes, of which no more are ever kept.
[[nodiscard]] std::string inflate_packed(std::string_view data, std::size_t most);

/// One LZ4 block of `size` bytes. Throws Failure as above.
[[nodiscard]] std::string expand_lz4(std::string_view block, std::size_t size, std::size_t most);

/// What inflate_packed() reads: the number of plain bytes, big-endian, and a zlib stream of `level` 0 to 9.
[[nodiscard]] std::string deflate_packed(std::string_view data, int level);

} // namespace obscura::serve
