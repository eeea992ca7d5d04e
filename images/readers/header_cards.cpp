// SPDX-License-Identifier: Apache-2.0
#include "images/readers/header_cards.hpp"

#include "core/error.hpp"
#include "core/io/text_file.hpp"
#include "core/text/text.hpp"

#include <ImfAttribute.h>
#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStringAttribute.h>
#include <fitsio.h>
#include <fmt/format.h>
#include <png.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

namespace obscura::images {
namespace {

std::vector<HeaderCard> cards_of_fits(const std::filesystem::path& file) {
    fitsfile* fits = nullptr;
    int status = 0;
    fits_open_diskfile(&fits, file.c_str(), READONLY, &status);
    const auto close = [](fitsfile* f) {
        int ignored = 0;
        fits_close_file(f, &ignored);
    };
    const std::unique_ptr<fitsfile, decltype(close)> owner(fits, close);
    int count = 0;
    fits_get_hdrspace(fits, &count, nullptr, &status);
    std::vector<HeaderCard> cards;
    for (int i = 1; i <= count && status == 0; ++i) {
        std::array<char, FLEN_KEYWORD> key{};
        std::array<char, FLEN_VALUE> value{};
        std::array<char, FLEN_COMMENT> comment{};
        fits_read_keyn(fits, i, key.data(), value.data(), comment.data(), &status);
        HeaderCard card{key.data(), value.data(), comment.data()};
        if (status != 0 || card.value.empty()) continue; // COMMENT and the like
        if (card.value.front() == '\'') {
            char* text = nullptr;
            fits_read_key_longstr(fits, key.data(), &text, nullptr, &status);
            if (status == 0) card.value = text;
            if (text != nullptr) fits_free_memory(text, &status);
        } else if (card.value == "T" || card.value == "F") {
            card.value = card.value == "T" ? "true" : "false";
        }
        cards.push_back(std::move(card));
    }
    if (status != 0) {
        std::array<char, FLEN_STATUS> text{};
        fits_get_errstatus(status, text.data());
        fits_clear_errmsg();
        throw InputError(fmt::format("{}: not readable as FITS: {}", file.string(), text.data()));
    }
    return cards;
}

std::vector<HeaderCard> cards_of_exr(const std::filesystem::path& file) {
    try {
        const Imf::InputFile in(file.c_str());
        std::vector<HeaderCard> cards;
        for (auto at = in.header().begin(); at != in.header().end(); ++at) {
            if (const auto* real = dynamic_cast<const Imf::DoubleAttribute*>(&at.attribute()))
                cards.push_back({at.name(), fmt::format("{}", real->value()), ""});
            else if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute()))
                cards.push_back({at.name(), text->value(), ""});
        }
        return cards;
    } catch (const std::exception& error) {
        throw InputError(fmt::format("{}: not readable as OpenEXR: {}", file.string(), error.what()));
    }
}

[[noreturn]] void on_png_error(png_structp, png_const_charp message) {
    throw std::runtime_error(message);
}
void on_png_warning(png_structp, png_const_charp) {}

std::vector<HeaderCard> cards_of_png(const std::filesystem::path& file) {
    const auto close = [](std::FILE* f) { std::fclose(f); };
    const std::unique_ptr<std::FILE, decltype(close)> in(std::fopen(file.c_str(), "rbe"), close);
    if (!in)
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)), errno);
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, on_png_error, on_png_warning);
    if (png == nullptr) throw std::bad_alloc();
    png_infop info = nullptr;
    const auto destroy = [&](png_structp) { png_destroy_read_struct(&png, &info, nullptr); };
    const std::unique_ptr<std::remove_pointer_t<png_structp>, decltype(destroy)> owner(png, destroy);
    info = png_create_info_struct(png);
    if (info == nullptr) throw std::bad_alloc();
    try {
        png_init_io(png, in.get());
        png_read_info(png, info);
        png_textp texts = nullptr;
        const int count = static_cast<int>(png_get_text(png, info, &texts, nullptr));
        std::vector<HeaderCard> cards;
        for (int i = 0; i < count; ++i)
            cards.push_back({texts[i].key, std::string(texts[i].text, texts[i].text_length), ""});
        return cards;
    } catch (const std::runtime_error& error) {
        throw InputError(fmt::format("{}: not readable as PNG: {}", file.string(), error.what()));
    }
}

/// Lines KEY = VALUE # comment, as write_raw16() makes them.
std::vector<HeaderCard> cards_of_sidecar(const std::filesystem::path& file) {
    std::string content;
    if (const std::string why = read_plain_text(file, std::size_t{16} << 20, content); !why.empty())
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), why), errno);
    std::istringstream in(content);
    std::vector<HeaderCard> cards;
    std::size_t number = 0;
    for (std::string line; std::getline(in, line);) {
        ++number;
        line = std::string(trimmed(line, " \t\r"));
        if (line.empty() || line.front() == '#') continue;
        const std::size_t equals = line.find('=');
        if (equals == std::string::npos)
            throw InputError(fmt::format("{}:{}: no KEY = VALUE: allowed is the sidecar of a raw frame",
                                         file.string(), number));
        HeaderCard card{std::string(trimmed(line.substr(0, equals), " \t\r")), "", ""};
        std::string rest = std::string(trimmed(line.substr(equals + 1), " \t\r"));
        std::size_t end = 0;
        if (!rest.empty() && rest.front() == '"') {
            for (end = 1; end < rest.size() && rest[end] != '"'; ++end) {
                if (rest[end] == '\\' && end + 1 < rest.size()) ++end;
                card.value += rest[end];
            }
            ++end;
        } else {
            end = std::min(rest.find('#'), rest.size());
            card.value = std::string(trimmed(rest.substr(0, end), " \t\r"));
        }
        const std::size_t comment = end < rest.size() ? rest.find('#', end) : std::string::npos;
        if (comment != std::string::npos)
            card.comment = std::string(trimmed(rest.substr(comment + 1), " \t\r"));
        cards.push_back(std::move(card));
    }
    return cards;
}

} // namespace

std::vector<HeaderCard> read_header_cards(const std::filesystem::path& file) {
    if (file.extension() == ".raw")
        return cards_of_sidecar(std::filesystem::path(file).replace_extension(".toml"));
    if (file.extension() == ".toml") return cards_of_sidecar(file);
    std::ifstream in(file, std::ios::binary);
    if (!in)
        throw InputError(fmt::format("{}: cannot be opened: {}", file.string(), std::strerror(errno)), errno);
    std::array<char, 8> magic{};
    in.read(magic.data(), magic.size());
    in.close();
    const std::string_view start(magic.data(), magic.size());
    if (start.starts_with("SIMPLE")) return cards_of_fits(file);
    if (start.starts_with("\x76\x2f\x31\x01")) return cards_of_exr(file);
    if (start.starts_with("\x89PNG")) return cards_of_png(file);
    throw InputError(fmt::format(
        "{}: no header: allowed are FITS, OpenEXR and PNG files and raw frames with their sidecar",
        file.string()));
}

} // namespace obscura::images
