// SPDX-License-Identifier: Apache-2.0
// Arrays of messages: values with name and shape, and the codecs that they are sent with.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::service {

/// How the bytes of an array are sent. Those that compress sort the bytes first: the first bytes of all
/// elements, then all second ones, and so on.
enum class Codec : std::uint8_t {
    none,
    shuffle_lz4,  ///< one LZ4 block
    shuffle_zstd, ///< one zstd frame, level 1
};
constexpr auto enum_names(Codec /*type*/) {
    return std::array{EnumName{Codec::none, "none"}, EnumName{Codec::shuffle_lz4, "shuffle-lz4"},
                      EnumName{Codec::shuffle_zstd, "shuffle-zstd"}};
}

/// Irradiance and layers; digital numbers.
using Values = std::variant<std::vector<float>, std::vector<std::uint16_t>>;

/// An array of a message: little-endian, C order.
struct Array {
    std::string name;
    std::vector<std::size_t> shape;
    Values values;
    Codec codec = Codec::none;
    std::string encoded{}; ///< with a codec, instead of the values

    [[nodiscard]] std::vector<float>& floats() { return std::get<std::vector<float>>(values); }
};

/// Type of the elements: "<f4" or "<u2".
[[nodiscard]] std::string_view dtype_of(const Array& array);
/// Bytes as they are sent.
[[nodiscard]] std::span<const std::byte> bytes_of(const Array& array);

/// Encodes the values of an array that has no codec. What would not become smaller, or is larger than one
/// block of LZ4 can be, stays as it is.
void encode(Array& array, Codec codec);

} // namespace obscura::service
