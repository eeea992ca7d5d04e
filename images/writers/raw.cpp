// SPDX-License-Identifier: Apache-2.0
#include "images/writers/raw.hpp"

#include "images/writers/pending_file.hpp"

#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

namespace obscura::images {
namespace {

static_assert(std::endian::native == std::endian::little, "words are written as they lie in memory");

void write_bytes(const std::filesystem::path& file, const void* bytes, std::size_t count) {
    PendingFile pending(file);
    const auto close = [](std::FILE* f) { std::fclose(f); };
    std::unique_ptr<std::FILE, decltype(close)> out(std::fopen(pending.path().c_str(), "wbe"), close);
    if (!out) pending.fail(std::strerror(errno));
    if (std::fwrite(bytes, 1, count, out.get()) != count) pending.fail(std::strerror(errno));
    if (std::fclose(out.release()) != 0) pending.fail(std::strerror(errno));
    pending.commit();
}

} // namespace

void write_text(const std::filesystem::path& file, std::string_view text) {
    write_bytes(file, text.data(), text.size());
}

void write_raw16(const std::filesystem::path& file, std::int32_t width, std::int32_t height, int bits,
                 std::span<const std::uint16_t> pixels, const Cards& cards) {
    std::string sidecar = fmt::format("# {}: {} x {} pixels, 16-bit little-endian words, first row first\n"
                                      "width = {}\n"
                                      "height = {}\n"
                                      "bits = {}\n",
                                      file.filename().string(), width, height, width, height, bits);
    for (const Card& card : cards) {
        std::string value = card_text(card);
        if (std::holds_alternative<std::string>(card.value)) {
            std::string escaped;
            for (const char c : value) {
                if (c == '"' || c == '\\') escaped += '\\';
                escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
            }
            value = "\"" + escaped + "\"";
        }
        // A TOML float has a point or an exponent.
        if (std::holds_alternative<double>(card.value) && value.find_first_of(".en") == std::string::npos)
            value += ".0";
        sidecar +=
            fmt::format("{} = {}{}{}\n", card.key, value, card.comment.empty() ? "" : " # ", card.comment);
    }
    write_bytes(file, pixels.data(), pixels.size_bytes());
    write_text(std::filesystem::path(file).replace_extension(".toml"), sidecar);
}

} // namespace obscura::images
