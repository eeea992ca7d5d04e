// SPDX-License-Identifier: Apache-2.0
#include "tools/support/emva_series.hpp"

#include "core/error.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>

namespace obscura::tools {
namespace {

using Image = std::vector<std::uint16_t>;

struct CloseFile {
    void operator()(std::FILE* f) const noexcept { std::fclose(f); }
};

/// Handles of libpng, owned outside the stack frame that longjmp() may leave.
struct Reader {
    png_structp png = nullptr;
    png_infop info = nullptr;
    ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

/// Fills `rows` from the file; false if libpng fails. No object with a destructor lives in this stack frame.
bool read_rows(Reader& reader, std::FILE* file, std::uint32_t width, std::uint32_t height, Image& image,
               std::vector<std::uint8_t*>& rows) {
    if (setjmp(png_jmpbuf(reader.png)) != 0) return false;
    png_init_io(reader.png, file);
    png_read_info(reader.png, reader.info);
    if (png_get_image_width(reader.png, reader.info) != width ||
        png_get_image_height(reader.png, reader.info) != height ||
        png_get_color_type(reader.png, reader.info) != PNG_COLOR_TYPE_GRAY)
        return false;
    const int depth = png_get_bit_depth(reader.png, reader.info);
    if (depth != 8 && depth != 16) return false;
    if (depth == 16)
        png_set_swap(reader.png);
    else
        png_set_expand_16(reader.png);
    png_read_update_info(reader.png, reader.info);
    png_read_image(reader.png, rows.data());
    if (depth == 8)
        for (std::uint16_t& v : image)
            v = static_cast<std::uint16_t>(v & 0xFF);
    return true;
}

Image read_png(const std::filesystem::path& path, std::uint32_t width, std::uint32_t height) {
    const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rb"));
    if (!file) throw InputError(fmt::format("{}: cannot be opened", path.string()));
    Image image(std::size_t{width} * height);
    std::vector<std::uint8_t*> rows(height);
    for (std::uint32_t y = 0; y < height; ++y)
        rows[y] = reinterpret_cast<std::uint8_t*>(image.data() + std::size_t{y} * width);
    Reader reader;
    // Silence libpng: the caller reports a broken file in one line.
    reader.png = png_create_read_struct(
        PNG_LIBPNG_VER_STRING, nullptr, [](png_structp png, png_const_charp) { png_longjmp(png, 1); },
        [](png_structp, png_const_charp) {});
    if (reader.png != nullptr) reader.info = png_create_info_struct(reader.png);
    if (reader.info == nullptr || !read_rows(reader, file.get(), width, height, image, rows))
        throw InputError(
            fmt::format("{}: no grey PNG of {} x {} pixels with 8 or 16 bits", path.string(), width, height));
    return image;
}

struct Entry {
    bool bright = false;
    double exposure = 0, photons = 0;
    std::vector<std::filesystem::path> images;
};

} // namespace

EmvaSeries read_emva_series(const std::filesystem::path& folder) {
    const std::filesystem::path index = folder / "EMVA1288_Data.txt";
    std::ifstream text(index);
    if (!text) throw InputError(fmt::format("{}: cannot be opened", index.string()));
    std::uint32_t width = 0, height = 0;
    std::vector<Entry> entries;
    std::string line;
    for (int number = 1; std::getline(text, line); ++number) {
        if (!line.empty() && line.back() == '\r') line.pop_back();
        std::istringstream words(line);
        std::string kind;
        if (!(words >> kind) || kind[0] == '#' || kind == "v") continue;
        bool understood = false;
        if (kind == "n") {
            int bits = 0;
            understood = static_cast<bool>(words >> bits >> width >> height) && width >= 1 && height >= 1 &&
                         width <= 65536 && height <= 65536 && std::uint64_t{width} * height <= 400'000'000;
        } else if (kind == "b" || kind == "d") {
            Entry e;
            e.bright = kind == "b";
            understood = static_cast<bool>(words >> e.exposure) &&
                         (!e.bright || static_cast<bool>(words >> e.photons));
            entries.push_back(e);
        } else if (kind == "i") {
            std::string name;
            std::getline(words >> std::ws, name);
            std::replace(name.begin(), name.end(), '\\', '/');
            understood = !name.empty() && !entries.empty() && width > 0;
            if (understood) entries.back().images.push_back(folder / name);
        }
        if (!understood)
            throw InputError(
                fmt::format("{}:{}: \"n bits width height\", \"b exposure photons\", \"d exposure\" or "
                            "\"i image\" is wanted",
                            index.string(), number));
    }
    // Compute the pair statistics of the levels whose images exist.
    struct Bright {
        double exposure;
        sensors::emva1288::PairStatistics pair;
    };
    std::map<double, sensors::emva1288::PairStatistics> dark;
    std::map<double, Bright> bright; // key: photons
    for (const Entry& e : entries) {
        const bool there = e.images.size() >= 2 && std::filesystem::exists(e.images[0]) &&
                           std::filesystem::exists(e.images[1]);
        if (!there) continue;
        const auto pair = sensors::emva1288::pair_statistics(read_png(e.images[0], width, height),
                                                             read_png(e.images[1], width, height));
        if (e.bright)
            bright[e.photons] = {e.exposure, pair};
        else
            dark[e.exposure] = pair;
    }
    EmvaSeries series;
    for (const auto& [photons, b] : bright)
        if (const auto found = dark.find(b.exposure); found != dark.end())
            series.levels.push_back({photons, b.pair, found->second});
    return series;
}

} // namespace obscura::tools
