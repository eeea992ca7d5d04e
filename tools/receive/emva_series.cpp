// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/emva_series.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "images/image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <locale>
#include <set>
#include <sstream>
#include <tuple>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;
using Image = std::vector<std::uint16_t>;

struct Descriptor {
    EmvaFormat format;
    struct Entry : EmvaMeasurement {
        bool bright = false;
        int line = 0;
    };
    std::vector<Entry> entries;
};

/// Number with a decimal point or, as some data sets have it, a decimal comma.
bool read_number(std::istream& words, double& value) {
    std::string word;
    if (!(words >> word)) return false;
    std::replace(word.begin(), word.end(), ',', '.');
    std::istringstream text(word);
    text.imbue(std::locale::classic());
    return (text >> value) && text.peek() == std::istringstream::traits_type::eof() && value >= 0 &&
           std::isfinite(value);
}

Descriptor read_descriptor(const std::filesystem::path& file) {
    std::ifstream text(file);
    if (!text) throw InputError(fmt::format("{}: cannot be opened", file.string()), errno);
    Descriptor result;
    EmvaFormat& format = result.format;
    const auto refuse = [&](int line, std::string_view why) {
        throw InputError(fmt::format("{}:{}: {}", file.string(), line, why));
    };
    std::string line;
    for (int number = 1; std::getline(text, line); ++number) {
        if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
        while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())))
            line.pop_back();
        std::istringstream words(line);
        std::string kind;
        if (!(words >> kind) || kind[0] == '#' || kind == "v" || kind == "l") continue;
        if (kind == "n") {
            if (format.bits != 0) refuse(number, "a second line \"n BITS WIDTH HEIGHT\"");
            if (!(words >> format.bits >> format.width >> format.height) || format.bits < 1 ||
                format.bits > 16 || format.width < 1 || format.height < 1 ||
                std::int64_t{format.width} * format.height > images::max_image_pixels)
                refuse(number, "\"n BITS WIDTH HEIGHT\" with 1 to 16 bits is wanted");
        } else if (kind == "b" || kind == "d") {
            Descriptor::Entry entry;
            entry.bright = kind == "b";
            entry.line = number;
            if (!read_number(words, entry.exposure_ns) ||
                (entry.bright && !read_number(words, entry.photons)))
                refuse(number,
                       entry.bright ? "\"b EXPOSURE_NS PHOTONS\" is wanted" : "\"d EXPOSURE_NS\" is wanted");
            result.entries.push_back(std::move(entry));
        } else if (kind == "i") {
            std::string name;
            std::getline(words >> std::ws, name);
            std::replace(name.begin(), name.end(), '\\', '/');
            if (name.empty()) refuse(number, "\"i FILE\" is wanted");
            if (result.entries.empty()) refuse(number, "an image before the first \"b\" or \"d\" line");
            result.entries.back().images.push_back(file.parent_path() / name);
        } else {
            refuse(number, fmt::format("unknown line \"{}\"; known are n, b, d, i, v and l", kind));
        }
    }
    if (format.bits == 0) throw InputError(fmt::format("{}: no line \"n BITS WIDTH HEIGHT\"", file.string()));
    std::set<std::tuple<bool, bool, double, double>> known;
    for (const Descriptor::Entry& entry : result.entries) {
        if (entry.images.size() < 2)
            refuse(entry.line, fmt::format("{} image{}; a pair, or a stack of three or more, is wanted",
                                           entry.images.size(), entry.images.size() == 1 ? "" : "s"));
        const bool pair = entry.images.size() == 2;
        if (!known.emplace(entry.bright, pair, entry.exposure_ns, entry.photons).second)
            refuse(entry.line, fmt::format("a second {} of this exposure{}", pair ? "pair" : "stack",
                                           entry.bright ? " and number of photons" : ""));
    }
    return result;
}

/// Reads a grey image and checks its size and range. Left-aligned values are shifted down.
Image read_grey(const std::filesystem::path& file, const EmvaFormat& format) {
    const images::Image image = images::read_image(file);
    if (image.width != format.width || image.height != format.height)
        throw InputError(fmt::format("{}: {} x {} pixels, where the descriptor states {} x {}", file.string(),
                                     image.width, image.height, format.width, format.height));
    if (images::colour_planes(file).size() != 1 || image.full_scale > 65535 || image.full_scale < 255)
        throw InputError(fmt::format("{}: a grey image of 8 or 16 bits is wanted", file.string()));
    const int top = (1 << (format.bits + format.shift)) - 1, low = (1 << format.shift) - 1;
    Image pixels(image.values.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const double v = image.values[i];
        // NaN marks missing pixels.
        const int value = v >= 0 && v <= top ? static_cast<int>(v) : -1;
        if (value < 0 || (value & low) != 0)
            throw InputError(fmt::format("{}: the value {} is not one of {} bits{}", file.string(), v,
                                         format.bits, format.shift > 0 ? ", left-aligned" : ""));
        pixels[i] = static_cast<std::uint16_t>(value >> format.shift);
    }
    return pixels;
}

/// Empty low bits of the files: 16-bit files may hold fewer bits at the upper end.
int alignment(const std::filesystem::path& brightest, EmvaFormat format) {
    const images::Image image = images::read_image(brightest);
    const double largest = *std::max_element(image.values.begin(), image.values.end());
    return image.full_scale == 65535 && largest > std::exp2(format.bits) - 1 ? 16 - format.bits : 0;
}

emva::PairStatistics statistics(const EmvaMeasurement& pair, const EmvaFormat& format) {
    return emva::pair_statistics(read_grey(pair.images[0], format), read_grey(pair.images[1], format));
}

bool all_there(const EmvaMeasurement& measurement) {
    return std::all_of(measurement.images.begin(), measurement.images.end(),
                       [](const std::filesystem::path& file) { return path_exists(file); });
}

} // namespace

std::optional<emva::PairStatistics> EmvaSeries::dark_at(double exposure_ns) const {
    const auto above = std::lower_bound(dark.begin(), dark.end(), exposure_ns,
                                        [](const EmvaDarkPair& d, double t) { return d.exposure_ns < t; });
    if (above == dark.end()) return std::nullopt;
    if (above->exposure_ns == exposure_ns) return above->pair;
    if (above == dark.begin()) return std::nullopt;
    const auto below = above - 1;
    const double f = (exposure_ns - below->exposure_ns) / (above->exposure_ns - below->exposure_ns);
    return emva::PairStatistics{std::lerp(below->pair.mean, above->pair.mean, f),
                                std::lerp(below->pair.variance, above->pair.variance, f),
                                std::lerp(below->pair.spatial_variance, above->pair.spatial_variance, f)};
}

void EmvaSeries::add_images(const EmvaMeasurement& measurement, emva::ImageStack& stack) const {
    for (const std::filesystem::path& file : measurement.images)
        stack.add(read_grey(file, format));
}

emva::ImageStack EmvaSeries::stack(const EmvaMeasurement& measurement) const {
    emva::ImageStack result(static_cast<std::size_t>(format.width) * static_cast<std::size_t>(format.height));
    add_images(measurement, result);
    return result;
}

EmvaSeries read_emva_series(const std::filesystem::path& folder_or_descriptor) {
    EmvaSeries series;
    series.descriptor =
        is_file_at(folder_or_descriptor) ? folder_or_descriptor : folder_or_descriptor / "EMVA1288_Data.txt";
    Descriptor descriptor = read_descriptor(series.descriptor);
    series.format = descriptor.format;

    std::vector<EmvaMeasurement> bright;
    std::size_t missing = 0;
    for (Descriptor::Entry& entry : descriptor.entries) {
        if (!all_there(entry)) {
            ++missing;
            continue;
        }
        auto& kind = entry.images.size() > 2 ? series.stacks : entry.bright ? bright : series.dark_pairs;
        kind.push_back(std::move(entry));
    }
    if (missing > 0)
        series.notes.push_back(fmt::format("{} of {} measurements were left out: images are missing.",
                                           missing, descriptor.entries.size()));
    const auto fewer_photons = [](const EmvaMeasurement& a, const EmvaMeasurement& b) {
        return a.photons < b.photons;
    };
    std::stable_sort(bright.begin(), bright.end(), fewer_photons);
    std::stable_sort(
        series.dark_pairs.begin(), series.dark_pairs.end(),
        [](const EmvaMeasurement& a, const EmvaMeasurement& b) { return a.exposure_ns < b.exposure_ns; });
    if (bright.empty() || series.dark_pairs.empty())
        throw InputError(fmt::format("{}: no {} pair{}", series.descriptor.string(),
                                     bright.empty() ? "bright" : "dark",
                                     missing > 0 ? " whose images are there" : ""));
    series.format.shift = alignment(bright.back().images.front(), series.format);
    if (series.format.shift > 0)
        series.notes.push_back(fmt::format("The {} bits are left-aligned in 16; values were divided by {}.",
                                           series.format.bits, 1 << series.format.shift));

    for (const EmvaMeasurement& pair : series.dark_pairs)
        series.dark.push_back({pair.exposure_ns, statistics(pair, series.format)});
    std::size_t interpolated = 0, without = 0;
    for (EmvaMeasurement& pair : bright) {
        const auto dark = series.dark_at(pair.exposure_ns);
        if (!dark) {
            ++without;
            continue;
        }
        if (std::none_of(series.dark.begin(), series.dark.end(),
                         [&](const EmvaDarkPair& d) { return d.exposure_ns == pair.exposure_ns; }))
            ++interpolated;
        series.levels.push_back({pair.photons, statistics(pair, series.format), *dark});
        series.bright_pairs.push_back(std::move(pair));
    }
    if (interpolated > 0)
        series.notes.push_back(fmt::format(
            "{} bright pairs have no dark pair of their exposure time; its statistics were interpolated.",
            interpolated));
    if (without > 0)
        series.notes.push_back(fmt::format(
            "{} bright pairs were left out: their exposure time is outside the range of the dark pairs.",
            without));
    return series;
}

} // namespace obscura::tools
