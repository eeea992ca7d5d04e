// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/texture.hpp"

#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "images/image.hpp"
#include "renderer/textures/paged_texture.hpp"
#include "terrain/maps/memory_pyramid.hpp"
#include "terrain/obt/obt_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace obscura::renderer {
namespace {

constexpr double code_max = 65535;
constexpr int max_probes = 16;
constexpr std::int64_t max_texels = std::int64_t{1} << 26;

/// Downsamples by a box filter; each output texel covers in/out input texels along an axis.
std::vector<float> halved(const std::vector<float>& in, std::int32_t width, std::int32_t height,
                          std::int32_t out_width, std::int32_t out_height) {
    const auto shrink = [](std::int32_t from, std::int32_t to, const auto& add) {
        const double step = static_cast<double>(from) / to;
        for (std::int32_t o = 0; o < to; ++o) {
            const double begin = o * step;
            const double end = (o + 1) * step;
            for (auto i = static_cast<std::int32_t>(begin); i < from && i < end; ++i) {
                const double share = std::min<double>(i + 1, end) - std::max<double>(i, begin);
                if (share > 0) add(o, i, share / step);
            }
        }
    };
    const auto at = [](std::int32_t y, std::int32_t w, std::int32_t x) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x);
    };
    std::vector<double> rows(static_cast<std::size_t>(out_width) * static_cast<std::size_t>(height), 0);
    for (std::int32_t y = 0; y < height; ++y)
        shrink(width, out_width, [&](std::int32_t o, std::int32_t i, double share) {
            rows[at(y, out_width, o)] += share * static_cast<double>(in[at(y, width, i)]);
        });
    std::vector<double> sums(static_cast<std::size_t>(out_width) * static_cast<std::size_t>(out_height), 0);
    shrink(height, out_height, [&](std::int32_t o, std::int32_t i, double share) {
        for (std::int32_t x = 0; x < out_width; ++x)
            sums[at(o, out_width, x)] += share * rows[at(i, out_width, x)];
    });
    return {sums.begin(), sums.end()};
}

double from_srgb(double x) {
    return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

/// x modulo n, never negative.
std::int32_t wrap(std::int32_t x, std::int32_t n) {
    x %= n;
    return x < 0 ? x + n : x;
}

} // namespace

Texture::Texture(std::int32_t width, std::int32_t height, const std::vector<std::vector<float>>& planes,
                 Edge edge, bool rgb)
    : edge_(edge), rgb_(rgb && planes.size() == 3) {
    assert(width > 0 && height > 0 && !planes.empty() && planes.size() <= max_planes);
    std::size_t texels = 0;
    for (std::int32_t w = width, h = height;;) {
        levels_.push_back({w, h, texels * planes.size()});
        texels += static_cast<std::size_t>(w) * static_cast<std::size_t>(h);
        if (w == 1 && h == 1) break;
        w = std::max(1, w / 2);
        h = std::max(1, h / 2);
    }
    level_count_ = levels_.size();
    width_ = width;
    height_ = height;
    texels_.resize(texels * planes.size());
    for (std::size_t p = 0; p < planes.size(); ++p) {
        const auto [least, most] = std::minmax_element(planes[p].begin(), planes[p].end());
        const double range = static_cast<double>(*most) - static_cast<double>(*least);
        const double offset = static_cast<double>(*least), scale = range / code_max;
        planes_.push_back({offset, scale, offset, offset + scale * code_max, offset});
        std::vector<float> coarser;
        for (std::size_t k = 0; k < levels_.size(); ++k) {
            const Level& level = levels_[k];
            const std::vector<float>& values = k == 0 ? planes[p] : coarser;
            std::uint16_t* out =
                texels_.data() + level.first +
                p * static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height);
            for (std::size_t i = 0; i < values.size(); ++i)
                out[i] = range > 0
                             ? static_cast<std::uint16_t>(std::lround(
                                   (static_cast<double>(values[i]) - planes_[p].offset) / range * code_max))
                             : std::uint16_t{0};
            if (k + 1 < levels_.size())
                coarser =
                    halved(values, level.width, level.height, levels_[k + 1].width, levels_[k + 1].height);
        }
        planes_[p].mean = offset + scale * texels_[levels_.back().first + p];
    }
}

Texture::Texture(std::shared_ptr<PagedTexture> paged, Edge edge)
    : edge_(edge), rgb_(paged->file().metadata().rgb), paged_(std::move(paged)) {
    const terrain::ObtMetadata& m = paged_->file().metadata();
    for (std::uint32_t p = 0; p < m.planes; ++p) {
        const terrain::ObtPlaneStatistics s = paged_->file().statistics(p);
        planes_.push_back({m.offset, m.scale, s.least, s.largest, s.mean});
    }
    level_count_ = paged_->levels();
    width_ = static_cast<double>(m.width);
    height_ = static_cast<double>(m.height);
}

std::size_t Texture::bytes() const {
    return paged_ ? paged_->bytes() : texels_.size() * sizeof texels_[0];
}

void Texture::add_bilinear(const Level& level, double u, double v, double weight, double* out) const {
    const double x = u * level.width - 0.5;
    const double y = v * level.height - 0.5;
    const double left = std::floor(x);
    const double top = std::floor(y);
    const double fx = x - left;
    const double fy = y - top;
    std::int32_t x0 = wrap(static_cast<std::int32_t>(left), level.width);
    std::int32_t x1 = x0 + 1 == level.width ? 0 : x0 + 1;
    if (edge_ == Edge::clamp_both) {
        x0 = std::clamp(static_cast<std::int32_t>(left), 0, level.width - 1);
        x1 = std::clamp(static_cast<std::int32_t>(left) + 1, 0, level.width - 1);
    }
    auto y0 = static_cast<std::int32_t>(top);
    std::int32_t y1 = y0 + 1;
    if (edge_ == Edge::repeat) {
        y0 = wrap(y0, level.height);
        y1 = wrap(y1, level.height);
    } else {
        y0 = std::clamp(y0, 0, level.height - 1);
        y1 = std::clamp(y1, 0, level.height - 1);
    }
    const std::size_t plane = static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height);
    const std::size_t row0 = static_cast<std::size_t>(y0) * static_cast<std::size_t>(level.width);
    const std::size_t row1 = static_cast<std::size_t>(y1) * static_cast<std::size_t>(level.width);
    for (std::size_t p = 0; p < planes_.size(); ++p) {
        const std::uint16_t* t = texels_.data() + level.first + p * plane;
        const double upper =
            (1 - fx) * t[row0 + static_cast<std::size_t>(x0)] + fx * t[row0 + static_cast<std::size_t>(x1)];
        const double lower =
            (1 - fx) * t[row1 + static_cast<std::size_t>(x0)] + fx * t[row1 + static_cast<std::size_t>(x1)];
        out[p] += weight * ((1 - fy) * upper + fy * lower);
    }
}

void Texture::sample(double u, double v, TextureAxis a, TextureAxis b, double* out) const {
    const double w = width_;
    const double h = height_;
    const auto texels = [&](TextureAxis axis) {
        return std::sqrt(axis.u * axis.u * w * w + axis.v * axis.v * h * h);
    };
    double longer = texels(a);
    double shorter = texels(b);
    if (longer < shorter) {
        std::swap(longer, shorter);
        std::swap(a, b);
    }
    // Limit the footprint to one turn: several turns about a pole have the same mean.
    const double excess = std::max({1.0, std::abs(a.u), std::abs(a.v)});
    a = {a.u / excess, a.v / excess};
    longer /= excess;
    const double wanted = std::ceil(longer / std::max(shorter, 1.0));
    const int probes = wanted >= max_probes ? max_probes : std::max(1, static_cast<int>(wanted));
    const double width = std::max({1.0, shorter, longer / probes});
    // Mip level: a base-2 logarithm, linear between powers of two; the same on every machine.
    int exponent = 0;
    const double mantissa = std::frexp(std::min(width, 0x1p30), &exponent);
    const double level = static_cast<double>(exponent - 1) + (2 * mantissa - 1);
    const auto last = static_cast<double>(level_count_ - 1);
    const double at = std::min(level, last);
    const auto fine = static_cast<std::size_t>(at);
    const double coarse_share = at - static_cast<double>(fine);

    for (std::size_t p = 0; p < planes_.size(); ++p)
        out[p] = 0;
    for (int k = 0; k < probes; ++k) {
        const double along = (k + 0.5) / probes - 0.5;
        double pu = u + along * a.u;
        double pv = v + along * a.v;
        pu = edge_ == Edge::clamp_both ? std::clamp(pu, 0.0, 1.0) : pu - std::floor(pu);
        pv = edge_ == Edge::repeat ? pv - std::floor(pv) : std::clamp(pv, 0.0, 1.0);
        const auto add = [&](std::size_t at_level, double weight) {
            if (paged_)
                paged_->add_bilinear(at_level, pu, pv, {edge_ != Edge::clamp_both, edge_ == Edge::repeat},
                                     weight, out);
            else
                add_bilinear(levels_[at_level], pu, pv, weight, out);
        };
        add(fine, 1 - coarse_share);
        if (coarse_share > 0) add(fine + 1, coarse_share);
    }
    for (std::size_t p = 0; p < planes_.size(); ++p)
        out[p] = planes_[p].offset + planes_[p].scale * out[p] / probes;
}

namespace {

/// Texels of a file in memory.
struct Planes {
    std::int32_t width = 0, height = 0;
    std::vector<std::vector<float>> values;
    bool rgb = false;
    double full_scale = 1;
};

bool is_factor(double x) {
    return std::abs(x) <= 1e30;
}

[[noreturn]] void refuse_infinite(const std::filesystem::path& file) {
    throw InputError(fmt::format("{}: a value is not a finite number: textures need all", file.string()));
}

/// The file of a giant texture that is larger than memory; else null.
std::shared_ptr<const terrain::ObtFile> large_texture(const std::filesystem::path& file) {
    if (!terrain::ObtFile::is_one(file)) return nullptr;
    auto texture = std::make_shared<const terrain::ObtFile>(file);
    const terrain::ObtMetadata& m = texture->metadata();
    return m.height > max_texels / m.width ? texture : nullptr;
}

/// All texels of a giant texture. `holes`: missing ones are NaN, instead of an error.
Planes read_obt(const std::filesystem::path& file, bool holes) {
    const terrain::ObtFile texture(file);
    const terrain::ObtMetadata& m = texture.metadata();
    const auto texels = static_cast<std::size_t>(m.width * m.height);
    require_memory(m.planes * texels * (sizeof(float) + 2 * sizeof(std::uint16_t)), file.string());
    Planes read{static_cast<std::int32_t>(m.width), static_cast<std::int32_t>(m.height), {}, m.rgb};
    read.values.assign(m.planes, std::vector<float>(texels));
    for (std::uint32_t p = 0; p < m.planes; ++p) {
        if (texture.statistics(p).holes && !holes)
            throw InputError(
                fmt::format("{}: samples of plane {} are missing: textures need all", file.string(), p));
        texture.read(p, 0, 0, 0, read.width, read.height, read.values[p]);
        for (const float v : read.values[p])
            if (!is_factor(static_cast<double>(v)) && !(holes && std::isnan(v))) refuse_infinite(file);
    }
    return read;
}

Planes read_image_planes(const std::filesystem::path& file, TextureCoding coding, bool holes) {
    const std::vector<std::string> names = images::colour_planes(file);
    if (names.size() > Texture::max_planes)
        throw InputError(fmt::format("{}: {} planes: a texture has at most {}", file.string(), names.size(),
                                     Texture::max_planes));
    Planes read;
    read.rgb = names[0] != "0";
    for (const std::string& name : names) {
        const images::Image image = images::read_image(file, name);
        if (std::int64_t{image.width} * image.height > max_texels)
            throw InputError(fmt::format("{}: {} x {} texels: a texture has at most {}", file.string(),
                                         image.width, image.height, max_texels));
        read.width = image.width;
        read.height = image.height;
        read.full_scale = image.full_scale;
        // All planes as float, then with their coarser copies as 16 bits.
        if (read.values.empty())
            require_memory(names.size() * image.values.size() * (sizeof(float) + 2 * sizeof(std::uint16_t)),
                           file.string());
        std::vector<float> plane;
        plane.reserve(image.values.size());
        for (const double value : image.values) {
            const double x = value / image.full_scale;
            if (!is_factor(x) && !(holes && std::isnan(x))) refuse_infinite(file);
            plane.push_back(static_cast<float>(
                coding == TextureCoding::srgb && !std::isnan(x) ? from_srgb(std::clamp(x, 0.0, 1.0)) : x));
        }
        read.values.push_back(std::move(plane));
    }
    return read;
}

Planes read_planes(const std::filesystem::path& file, TextureCoding coding, bool holes) {
    return terrain::ObtFile::is_one(file) ? read_obt(file, holes) : read_image_planes(file, coding, holes);
}

/// Gives missing texels the mean of those around, in the smallest square of a power of two that has any, and
/// marks them.
void fill_missing(Planes& planes, std::vector<bool>& missing, const std::filesystem::path& file) {
    for (std::vector<float>& plane : planes.values) {
        if (std::none_of(plane.begin(), plane.end(), [](float v) { return std::isnan(v); })) continue;
        missing.resize(plane.size());
        require_memory(terrain::MemoryPyramid::bytes(planes.width, planes.height), file.string());
        const terrain::MemoryPyramid means(planes.width, planes.height, plane);
        for (std::size_t i = 0; i < plane.size(); ++i) {
            if (!std::isnan(plane[i])) continue;
            missing[i] = true;
            const auto x = static_cast<std::int64_t>(i) % planes.width,
                       y = static_cast<std::int64_t>(i) / planes.width;
            for (int level = 1; level < means.levels() && std::isnan(plane[i]); ++level)
                means.read(level, x >> level, y >> level, 1, 1, {&plane[i], 1});
            if (std::isnan(plane[i])) throw InputError(fmt::format("{}: no pixel has data", file.string()));
        }
    }
}

} // namespace

Texture read_texture(const std::filesystem::path& file, TextureCoding coding,
                     const std::function<Texture::Edge(std::int64_t, std::int64_t)>& edge) {
    if (auto large = large_texture(file)) {
        const Texture::Edge end = edge(large->metadata().width, large->metadata().height);
        return {std::make_shared<PagedTexture>(std::move(large)), end};
    }
    const Planes read = read_planes(file, coding, false);
    return {read.width, read.height, read.values, edge(read.width, read.height), read.rgb};
}

MapTexture read_map_texture(const std::filesystem::path& file, TextureCoding coding,
                            const std::function<Texture::Edge(std::int64_t, std::int64_t)>& edge) {
    MapTexture map;
    if (auto large = large_texture(file)) {
        map.width = large->metadata().width;
        map.height = large->metadata().height;
        map.texture = std::make_shared<const Texture>(std::make_shared<PagedTexture>(std::move(large)),
                                                      edge(map.width, map.height));
        return map;
    }
    Planes read = read_planes(file, coding, true);
    fill_missing(read, map.missing, file);
    map.width = read.width;
    map.height = read.height;
    map.full_scale = read.full_scale;
    map.texture = std::make_shared<const Texture>(read.width, read.height, read.values,
                                                  edge(map.width, map.height), read.rgb);
    return map;
}

} // namespace obscura::renderer
