// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/nested_albedo.hpp"

#include "core/error.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/textures/band_weights.hpp"
#include "renderer/textures/paged_texture.hpp"
#include "terrain/maps/map_findings.hpp"
#include "terrain/maps/patch_overlap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>

namespace obscura::renderer {

using namespace terrain;

namespace {

/// Points at which the mean over the body is taken.
constexpr int mean_points = 4096;

/// Samples of 1, missing where the map has none: what Coverage looks at.
class MaskPyramid final : public SamplePyramid {
public:
    MaskPyramid(std::int64_t width, std::int64_t height, std::vector<bool> missing)
        : width_(width), height_(height), missing_(std::move(missing)) {}

    [[nodiscard]] int levels() const override { return 1; }
    [[nodiscard]] std::int64_t width(int /*level*/) const override { return width_; }
    [[nodiscard]] std::int64_t height(int /*level*/) const override { return height_; }
    [[nodiscard]] float least() const override { return 1; }
    [[nodiscard]] float largest() const override { return 1; }
    [[nodiscard]] bool has_holes() const override { return !missing_.empty(); }
    void read(int /*level*/, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) const override {
        for (int j = 0; j < rows; ++j)
            for (int i = 0; i < columns; ++i) {
                const bool hole =
                    !missing_.empty() && missing_[static_cast<std::size_t>((y + j) * width_ + x + i)];
                out[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) +
                    static_cast<std::size_t>(i)] = hole ? std::numeric_limits<float>::quiet_NaN() : 1.0F;
            }
    }

private:
    std::int64_t width_, height_;
    std::vector<bool> missing_;
};

/// Two steps along the reference surface at right angles.
std::array<Vec3, 2> square_at(const SurfaceDomain& domain, Vec3 position_m, double edge_m) {
    Vec3 a, b;
    orthonormal_basis(domain.is_plane() ? Vec3{0, 0, 1} : normalized(position_m), a, b);
    return {a * edge_m, b * edge_m};
}

} // namespace

NestedAlbedo::NestedAlbedo(const SurfaceDomain& domain, std::vector<AlbedoSource> sources,
                           const std::vector<SpectralBand>& bands)
    : domain_(domain), bands_(bands.size()) {
    std::stable_sort(sources.begin(), sources.end(),
                     [](const AlbedoSource& a, const AlbedoSource& b) { return a.priority < b.priority; });
    for (AlbedoSource& given : sources) {
        const Texture& texture = *given.map.texture;
        const std::size_t planes = texture.planes();
        if (planes != 1 && !texture.rgb() && planes != bands.size())
            throw InputError(fmt::format(
                "{}: {} planes: allowed are 1, red, green and blue, or one for each of the {} bands",
                given.name, planes, bands.size()));
        if (texture.paged() != nullptr && given.frame.registration() == Registration::node)
            throw InputError(fmt::format(
                "{}: samples of nodes: a giant texture of albedo that is larger than memory needs those of pixels",
                given.name));
        Source source{given.name,
                      given.map.texture,
                      given.frame,
                      nullptr,
                      band_weights(texture, bands),
                      given.offset,
                      given.gain,
                      0};
        grey_ = grey_ && same_in_all_bands(source.weights, planes);
        try {
            const auto raster = std::make_shared<const Raster>(
                std::make_shared<const MaskPyramid>(given.map.width, given.map.height,
                                                    std::move(given.map.missing)),
                given.frame);
            if (!raster->whole()) source.coverage = std::make_shared<const Coverage>(raster);
        } catch (const std::invalid_argument& error) {
            throw InputError(fmt::format("{}: {}", given.name, error.what()));
        }
        notes_.push_back(fmt::format("{}: {} x {} samples, {} (east positive), albedo {:.4g} on average",
                                     given.name, given.frame.width(), given.frame.height(),
                                     edges_text(given.frame),
                                     given.offset + given.gain * given.map.texture->mean(0)));
        compare(source, given.feather_m, source.feather_m);
        sources_.push_back(std::move(source));
    }
    mean_ = mean_over_body();
}

double NestedAlbedo::weight(const Source& source, Vec3 position_m) const {
    if (!source.coverage) return 1;
    const double metres =
        source.coverage->distance(position_m) * (domain_.is_plane() ? 1 : length(position_m));
    return source.feather_m > 0 ? smoothstep(metres / source.feather_m) : metres > 0 ? 1 : 0;
}

void NestedAlbedo::lookup(const Source& source, Vec3 position_m, Vec3 a_m, Vec3 b_m, std::size_t channels,
                          double* out) {
    const MapFrame& frame = source.frame;
    const auto width = static_cast<double>(frame.width()), height = static_cast<double>(frame.height());
    const SamplePlace at = frame.place(position_m);
    const SamplePlace a = frame.step(position_m, a_m), b = frame.step(position_m, b_m);
    double planes[Texture::max_planes];
    source.texture->sample((at.x + 0.5) / width, (at.y + 0.5) / height, {a.x / width, a.y / height},
                           {b.x / width, b.y / height}, planes);
    const std::size_t count = source.texture->planes();
    for (std::size_t k = 0; k < count; ++k)
        planes[k] = source.offset + source.gain * planes[k];
    for (std::size_t c = 0; c < channels; ++c)
        out[c] = band_value(source.weights, c, planes, count);
}

void NestedAlbedo::factors_of(std::size_t count, Vec3 position_m, Vec3 a_m, Vec3 b_m, std::size_t channels,
                              double* out) const {
    // From the highest map that covers the point alone.
    std::array<double, max_sources> shares;
    std::size_t first = count;
    while (first > 0) {
        --first;
        shares[first] = weight(sources_[first], position_m);
        if (shares[first] >= 1) break;
    }
    std::fill(out, out + channels, 1.0);
    double own[max_channels];
    for (std::size_t k = first; k < count; ++k) {
        const double w = shares[k];
        if (w <= 0) continue;
        lookup(sources_[k], position_m, a_m, b_m, channels, own);
        for (std::size_t c = 0; c < channels; ++c)
            out[c] = w < 1 ? out[c] + w * (own[c] - out[c]) : own[c];
    }
}

void NestedAlbedo::factors(Vec3 position_m, Vec3 a_m, Vec3 b_m, std::size_t channels, double* out) const {
    factors_of(sources_.size(), position_m, a_m, b_m, channels, out);
}

// Means over the bands, at points with footprints as wide as their distance: of a giant texture the few tiles
// of the level of that width.
void NestedAlbedo::compare(const Source& source, std::optional<double> feather_m, double& chosen_feather_m) {
    const MapFrame& frame = source.frame;
    const double pixel_m = pixel_size_m(domain_, frame);
    const double step_m =
        pixel_m * static_cast<double>(std::max(compared_step(frame.width()), compared_step(frame.height())));
    double below_pixel_m = 0, sum = 0, below_sum = 0, squares = 0;
    std::int64_t points = 0;
    std::vector<double> own(bands_), below(bands_);
    for (const Vec3 p : compared_points(domain_, frame)) {
        if (source.coverage && source.coverage->distance(p) <= 0) continue;
        bool any = false;
        for (const Source& s : sources_)
            if (weight(s, p) > 0) {
                any = true;
                below_pixel_m = std::max(below_pixel_m, pixel_size_m(domain_, s.frame));
            }
        if (!any) continue;
        const auto [a, b] = square_at(domain_, p, step_m);
        lookup(source, p, a, b, bands_, own.data());
        factors_of(sources_.size(), p, a, b, bands_, below.data());
        double difference = 0;
        for (std::size_t c = 0; c < bands_; ++c) {
            sum += own[c] / static_cast<double>(bands_);
            below_sum += below[c] / static_cast<double>(bands_);
            difference += (own[c] - below[c]) / static_cast<double>(bands_);
        }
        squares += difference * difference;
        ++points;
    }
    chosen_feather_m = feather_m.value_or(default_feather_m(domain_, frame, below_pixel_m));
    if (sources_.empty()) return;
    if (points == 0) {
        notes_.push_back(fmt::format("{}: no albedo map below it", source.name));
        return;
    }
    const auto n = static_cast<double>(points);
    notes_.push_back(fmt::format(
        "{}: albedo at {} points over what is below it: mean {:.4g} against {:.4g}, difference {:.4g} rms; "
        "blended over {:.4g} m",
        source.name, points, sum / n, below_sum / n, std::sqrt(squares / n), chosen_feather_m));
}

double NestedAlbedo::mean_over_body() const {
    double sum = 0;
    const double edge_m = domain_.is_plane() ? domain_.half_edge_m() : 0;
    for (int k = 0; k < mean_points; ++k) {
        // Points of a golden spiral, or of a square grid of 64 by 64.
        Vec3 p;
        double step_m = 0;
        if (domain_.is_plane()) {
            step_m = 2 * edge_m / 64;
            p = {(k % 64 + 0.5) * step_m - edge_m, (k / 64 + 0.5) * step_m - edge_m, 0};
        } else {
            const double z = 1 - (2 * k + 1.0) / mean_points, rho = std::sqrt(1 - z * z);
            const double turn = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
            p = on_surface(domain_, {rho * std::cos(turn), rho * std::sin(turn), z});
            step_m = length(p) * std::sqrt(4 * std::numbers::pi / mean_points);
        }
        const auto [a, b] = square_at(domain_, p, step_m);
        double factor = 1;
        factors(p, a, b, 1, &factor);
        sum += factor;
    }
    return sum / mean_points;
}

std::vector<std::shared_ptr<const Texture>> NestedAlbedo::textures() const {
    std::vector<std::shared_ptr<const Texture>> all;
    for (const Source& source : sources_)
        all.push_back(source.texture);
    return all;
}

} // namespace obscura::renderer
