// SPDX-License-Identifier: Apache-2.0
// DAF files of either byte order for tests, after NAIF's DAF Required Reading.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::test {

/// A segment: summary without addresses, and data.
struct DafSegment {
    std::string name;
    std::vector<double> doubles;
    std::vector<std::int32_t> integers;
    std::vector<double> words;
};

/// The bytes of a DAF file with at most 25 segments.
inline std::string daf_bytes(std::string_view kind, const std::vector<DafSegment>& segments,
                             bool big_endian) {
    const auto put = [&](std::string& bytes, std::size_t at, auto value) {
        std::array<char, sizeof(value)> raw{};
        std::memcpy(raw.data(), &value, sizeof(value));
        if (big_endian) std::reverse(raw.begin(), raw.end());
        bytes.replace(at, raw.size(), raw.data(), raw.size());
    };
    const std::int32_t integers = kind == "PCK" ? 5 : 6;
    const std::size_t summary = 8 * (2 + (static_cast<std::size_t>(integers) + 1) / 2);
    std::string bytes(3 * 1024, '\0');
    bytes.replace(0, 8, (std::string("DAF/") + std::string(kind) + "    ").substr(0, 8));
    put(bytes, 8, std::int32_t{2});
    put(bytes, 12, integers);
    bytes.replace(16, 60, std::string(60, ' '));
    put(bytes, 76, std::int32_t{2});
    put(bytes, 80, std::int32_t{2});
    bytes.replace(88, 8, big_endian ? "BIG-IEEE" : "LTL-IEEE");
    bytes.replace(699, 28, std::string("FTPSTR:\r:\n:\r\n:\r\0:\x81:\x10\xCE:ENDFTP", 28));
    put(bytes, 1024 + 16, static_cast<double>(segments.size()));
    std::int32_t address = 3 * 128 + 1;
    for (std::size_t i = 0; i < segments.size(); ++i) {
        const DafSegment& s = segments[i];
        std::string name = s.name;
        name.resize(summary, ' ');
        bytes.replace(2048 + i * summary, summary, name);
        std::size_t at = 1024 + 24 + i * summary;
        for (const double d : s.doubles)
            put(bytes, at, d), at += 8;
        for (const std::int32_t n : s.integers)
            put(bytes, at, n), at += 4;
        put(bytes, at, address);
        address += static_cast<std::int32_t>(s.words.size());
        put(bytes, at + 4, address - 1);
        for (const double w : s.words) {
            bytes.append(8, '\0');
            put(bytes, bytes.size() - 8, w);
        }
    }
    put(bytes, 84, address);
    bytes.resize((bytes.size() + 1023) / 1024 * 1024, '\0');
    return bytes;
}

} // namespace obscura::test
