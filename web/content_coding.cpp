// SPDX-License-Identifier: Apache-2.0
#include "web/content_coding.hpp"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <new>

namespace obscura::web {
namespace {

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t'))
        text.remove_prefix(1);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t'))
        text.remove_suffix(1);
    return text;
}

bool same_word(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// Whether the parameters of a coding give it a weight above 0. One that cannot be read is none.
bool is_wanted(std::string_view parameters) {
    parameters = trimmed(parameters);
    if (parameters.empty()) return true;
    const std::size_t sign = parameters.find('=');
    if (sign == std::string_view::npos || !same_word(trimmed(parameters.substr(0, sign)), "q")) return false;
    const std::string_view digits = trimmed(parameters.substr(sign + 1));
    double weight = 0;
    const char* const end = digits.data() + digits.size();
    const auto read = std::from_chars(digits.data(), end, weight, std::chars_format::fixed);
    return read.ec == std::errc{} && read.ptr == end && weight > 0 && weight <= 1;
}

} // namespace

bool takes_gzip(std::string_view accept_encoding) {
    bool any = false;
    while (!accept_encoding.empty()) {
        const std::string_view one = accept_encoding.substr(0, accept_encoding.find(','));
        accept_encoding.remove_prefix(std::min(one.size() + 1, accept_encoding.size()));
        const std::size_t end = std::min(one.find(';'), one.size());
        const std::string_view coding = trimmed(one.substr(0, end));
        const bool wanted = is_wanted(end < one.size() ? one.substr(end + 1) : std::string_view());
        // What names gzip outweighs "*".
        if (same_word(coding, "gzip") || same_word(coding, "x-gzip")) return wanted;
        if (coding == "*") any = wanted;
    }
    return any;
}

std::string gzipped(std::string_view bytes) {
    constexpr int gzip_window = 15 + 16; // 16: a gzip header instead of zlib's
    constexpr int memory_level = 8;
    z_stream stream{};
    if (::deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, gzip_window, memory_level,
                       Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::bad_alloc();
    std::string out(::deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
    // zlib reads it only.
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    ::deflate(&stream, Z_FINISH); // deflateBound() leaves room for all of it
    out.resize(stream.total_out);
    ::deflateEnd(&stream);
    return out;
}

} // namespace obscura::web
