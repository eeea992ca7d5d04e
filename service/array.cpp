// SPDX-License-Identifier: Apache-2.0
#include "service/array.hpp"

#include <lz4.h>
#include <zstd.h>

#include <type_traits>
#include <utility>

namespace obscura::service {
namespace {

constexpr int zstd_level = 1;

/// The bytes of `values` sorted by their place in the element.
template<typename Element>
std::string shuffled(const std::vector<Element>& values) {
    const std::size_t count = values.size();
    std::string out(count * sizeof(Element), '\0');
    const auto* const from = reinterpret_cast<const char*>(values.data());
    for (std::size_t place = 0; place < sizeof(Element); ++place) {
        char* const to = out.data() + place * count;
        for (std::size_t i = 0; i < count; ++i)
            to[i] = from[i * sizeof(Element) + place];
    }
    return out;
}

/// The compressed bytes; empty: they would not be fewer.
std::string compressed(const std::string& bytes, Codec codec) {
    // No longer than this: a compressor ends where its result would be no smaller.
    std::string out(bytes.size() - 1, '\0');
    std::size_t size = 0;
    if (codec == Codec::shuffle_lz4) {
        if (bytes.size() > LZ4_MAX_INPUT_SIZE) return {};
        const int written = LZ4_compress_default(bytes.data(), out.data(), static_cast<int>(bytes.size()),
                                                 static_cast<int>(out.size()));
        size = static_cast<std::size_t>(written);
    } else {
        const std::size_t written =
            ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), zstd_level);
        size = ZSTD_isError(written) != 0 ? 0 : written;
    }
    out.resize(size);
    out.shrink_to_fit();
    return out;
}

} // namespace

std::string_view dtype_of(const Array& array) {
    return std::holds_alternative<std::vector<float>>(array.values) ? "<f4" : "<u2";
}

std::span<const std::byte> bytes_of(const Array& array) {
    if (array.codec != Codec::none) return std::as_bytes(std::span(array.encoded));
    return std::visit([](const auto& values) { return std::as_bytes(std::span(values)); }, array.values);
}

void encode(Array& array, Codec codec) {
    if (codec == Codec::none || bytes_of(array).empty()) return;
    std::string encoded =
        std::visit([codec](const auto& values) { return compressed(shuffled(values), codec); }, array.values);
    if (encoded.empty()) return;
    std::visit([](auto& values) { values = std::decay_t<decltype(values)>(); }, array.values);
    array.encoded = std::move(encoded);
    array.codec = codec;
}

} // namespace obscura::service
