// SPDX-License-Identifier: Apache-2.0
#include "web/server/content_coding.hpp"

#include "core/text/text.hpp"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <new>

namespace obscura::web {
namespace {

bool same_word(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// Number of the parameter q, the last one; 1: there is none, 0: it cannot be read.
double weight_of(std::string_view parameters) {
    const std::size_t begin = parameters.rfind(';');
    parameters = trimmed(begin == std::string_view::npos ? parameters : parameters.substr(begin + 1));
    if (parameters.empty()) return 1;
    const std::size_t sign = parameters.find('=');
    if (sign == std::string_view::npos || !same_word(trimmed(parameters.substr(0, sign)), "q")) return 0;
    const std::string_view digits = trimmed(parameters.substr(sign + 1));
    double weight = 0;
    const char* const end = digits.data() + digits.size();
    const auto read = std::from_chars(digits.data(), end, weight, std::chars_format::fixed);
    return read.ec == std::errc{} && read.ptr == end && weight > 0 && weight <= 1 ? weight : 0;
}

} // namespace

bool takes_gzip(std::string_view accept_encoding) {
    bool any = false;
    while (!accept_encoding.empty()) {
        const std::string_view one = accept_encoding.substr(0, accept_encoding.find(','));
        accept_encoding.remove_prefix(std::min(one.size() + 1, accept_encoding.size()));
        const std::size_t end = std::min(one.find(';'), one.size());
        const std::string_view coding = trimmed(one.substr(0, end));
        const bool wanted = weight_of(end < one.size() ? one.substr(end + 1) : std::string_view()) > 0;
        // What names gzip outweighs "*".
        if (same_word(coding, "gzip") || same_word(coding, "x-gzip")) return wanted;
        if (coding == "*") any = wanted;
    }
    return any;
}

double accepted(std::string_view accept, std::string_view type) {
    if (trimmed(accept).empty()) return 1;
    const std::string_view family = type.substr(0, type.find('/') + 1);
    int best = -1;
    double weight = 0;
    while (!accept.empty()) {
        const std::string_view one = accept.substr(0, accept.find(','));
        accept.remove_prefix(std::min(one.size() + 1, accept.size()));
        const std::size_t end = std::min(one.find(';'), one.size());
        const std::string_view range = trimmed(one.substr(0, end));
        const int exact = same_word(range, type)                                                          ? 2
                          : range.ends_with("/*") && same_word(range.substr(0, range.size() - 1), family) ? 1
                          : range == "*/*"                                                                ? 0
                                           : -1;
        if (exact <= best) continue;
        best = exact;
        weight = weight_of(end < one.size() ? one.substr(end + 1) : std::string_view());
    }
    return weight;
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
