// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/packed_bytes.hpp"

#include "service/failure.hpp"

#include <fmt/format.h>
#include <lz4.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <new>

namespace obscura::serve {
namespace {

using service::Failure;
using service::FailureCode;

constexpr std::size_t length_bytes = 4;

Failure broken(const char* what) {
    return service::bad_argument("data", fmt::format("data: {}", what));
}
Failure too_large(std::size_t most) {
    return {FailureCode::too_large, fmt::format("data: more than {} bytes when expanded", most)};
}

/// zlib counts in 32 bits.
Bytef* bytes_of(std::string_view text) {
    return reinterpret_cast<Bytef*>(const_cast<char*>(text.data())); // NOLINT: zlib does not write to it
}

/// Ends the stream of zlib.
struct Inflating {
    z_stream stream{};
    Inflating() {
        if (::inflateInit(&stream) != Z_OK) throw std::bad_alloc();
    }
    ~Inflating() { ::inflateEnd(&stream); }
    Inflating(const Inflating&) = delete;
    Inflating& operator=(const Inflating&) = delete;
};

} // namespace

std::string inflate_packed(std::string_view data, std::size_t most) {
    if (data.size() < length_bytes) throw broken("no length, and no zlib stream");
    data.remove_prefix(length_bytes);
    if (data.size() > std::numeric_limits<uInt>::max()) throw too_large(most);
    Inflating inflating;
    z_stream& stream = inflating.stream;
    stream.next_in = bytes_of(data);
    stream.avail_in = static_cast<uInt>(data.size());
    std::string plain;
    std::array<char, 1 << 16> piece; // NOLINT(cppcoreguidelines-pro-type-member-init): filled by zlib
    int state = Z_OK;
    while (state == Z_OK) {
        stream.next_out = bytes_of({piece.data(), piece.size()});
        stream.avail_out = static_cast<uInt>(piece.size());
        state = ::inflate(&stream, Z_NO_FLUSH);
        const std::size_t more = piece.size() - stream.avail_out;
        if (more > most - plain.size()) throw too_large(most);
        plain.append(piece.data(), more);
    }
    if (state != Z_STREAM_END) throw broken("no whole zlib stream");
    return plain;
}

std::string expand_lz4(std::string_view block, std::size_t size, std::size_t most) {
    if (size > most || size > static_cast<std::size_t>(LZ4_MAX_INPUT_SIZE)) throw too_large(most);
    if (block.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) throw too_large(most);
    std::string plain(size, '\0');
    if (::LZ4_decompress_safe(block.data(), plain.data(), static_cast<int>(block.size()),
                              static_cast<int>(size)) != static_cast<int>(size))
        throw broken("no LZ4 block of the announced size");
    return plain;
}

std::string deflate_packed(std::string_view data, int level) {
    uLongf bytes = ::compressBound(data.size());
    std::string packed(length_bytes + bytes, '\0');
    for (std::size_t i = 0; i < length_bytes; ++i)
        packed[i] = static_cast<char>(data.size() >> (8 * (length_bytes - 1 - i)));
    if (::compress2(bytes_of(packed) + length_bytes, &bytes, bytes_of(data), data.size(),
                    std::clamp(level, 0, 9)) != Z_OK)
        throw std::bad_alloc();
    packed.resize(length_bytes + bytes);
    return packed;
}

} // namespace obscura::serve
