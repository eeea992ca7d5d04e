// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/psf_tables.hpp"

#include "core/error.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/camera/psf_core.hpp"
#include "renderer/camera/psf_profile.hpp"
#include "renderer/lights/spectrum.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

namespace obscura::renderer {
namespace {

using std::numbers::pi;
constexpr int wavelengths_per_band = 8;

/// Fraction of the light at a radius that belongs to the core; the wings begin at half its radius and fade in
/// smoothly.
double core_window(double radius_px, double core_px, bool with_wings) {
    const double t = radius_px / core_px;
    if (t >= 1) return 0;
    if (!with_wings || t <= 0.5) return 1;
    const double c = std::cos((t - 0.5) * pi);
    return c * c;
}

/// Wavelengths of a band and their fractions of the Sun's light in it.
std::vector<std::pair<double, double>> wavelengths_of(const SpectralBand& band) {
    std::vector<std::pair<double, double>> list;
    double sum = 0;
    const double step = (band.to_m - band.from_m) / wavelengths_per_band;
    for (int i = 0; i < wavelengths_per_band; ++i) {
        SpectralBand slice = band;
        slice.from_m = band.from_m + i * step;
        slice.to_m = slice.from_m + step;
        list.emplace_back(slice.from_m + step / 2, sun_irradiance_w_m2(slice));
        sum += list.back().second;
    }
    for (auto& [wavelength, share] : list)
        share = sum > 0 ? share / sum : 1.0 / wavelengths_per_band;
    return list;
}

using RadialPsf = std::function<double(double)>;

PsfProfile tabulate(const RadialPsf& psf_at, double to_px, double step_px) {
    PsfProfile p;
    p.step_px = step_px;
    const auto count = static_cast<std::size_t>(std::ceil(to_px / step_px)) + 2;
    for (std::size_t i = 0; i < count; ++i)
        p.values.push_back(psf_at(static_cast<double>(i) * step_px));
    return p;
}

/// Fraction of the light within the core, before the wings.
double core_light(const PsfProfile& p, double core_px) {
    // The integral of a profile that is linear in each step.
    double sum = 0;
    double inner = p.values.front();
    for (std::size_t i = 1; i < p.values.size(); ++i) {
        const double to = static_cast<double>(i) * p.step_px;
        const double from = to - p.step_px;
        const double outer = p.values[i] * core_window(to, core_px, true);
        sum += (2 * from + to) * inner + (from + 2 * to) * outer;
        inner = outer;
    }
    return sum * 2 * pi / 6 * p.step_px;
}

/// Values of a function of x and y at many points, both in pitches of the columns.
using PsfValues =
    std::function<void(std::span<const double> x, std::span<const double> y, std::span<double>)>;

PsfValues point_by_point(const std::function<double(double, double)>& psf_at) {
    return [psf_at](std::span<const double> x, std::span<const double> y, std::span<double> values) {
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = psf_at(x[i], y[i]);
    };
}

/// Values of `psf_at` times the window on the grid of PsfCore, normalised to `light` in all; each is the mean
/// over `points` points along x and as dense ones along y, for patterns finer than the grid.
std::vector<double> grid_of(const PsfValues& psf_at, const PsfExtent& extent, double light, int points) {
    const std::int32_t half = extent.half;
    const double aspect = extent.aspect;
    const double core_px = extent.core_px;
    const int points_y = points * std::max(1, static_cast<int>(std::ceil(aspect)));
    const std::int32_t side = 2 * half + 1;
    std::vector<double> grid(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    const double step = 1.0 / PsfCore::per_pixel;
    double sum = 0;
    std::vector<double> xs, ys, values;
    for (std::int32_t j = 0; j < side; ++j) {
        const double y = aspect * ((j - half) * step);
        const auto radius_at = [&](std::int32_t i) {
            const double x = (i - half) * step;
            return std::sqrt(x * x + y * y);
        };
        xs.clear();
        ys.clear();
        for (std::int32_t i = 0; i < side; ++i)
            if (radius_at(i) < core_px + aspect)
                for (int b = 0; b < points_y; ++b)
                    for (int a = 0; a < points; ++a) {
                        xs.push_back((i - half) * step + step * ((a + 0.5) / points - 0.5));
                        ys.push_back(y + aspect * step * ((b + 0.5) / points_y - 0.5));
                    }
        values.resize(xs.size());
        psf_at(xs, ys, values);
        auto next = values.begin();
        for (std::int32_t i = 0; i < side; ++i) {
            const double r = radius_at(i);
            double mean = 0;
            if (r < core_px + aspect)
                for (int k = 0; k < points * points_y; ++k)
                    mean += *next++;
            const double value = mean / (points * points_y) * core_window(r, core_px, extent.has_wings());
            grid[static_cast<std::size_t>(j) * static_cast<std::size_t>(side) + static_cast<std::size_t>(i)] =
                value;
            sum += value;
        }
    }
    for (double& v : grid)
        v *= light / (sum * step * step);
    return grid;
}

/// Table of the wings by the logarithm of the squared distance; each entry is the mean over its interval.
std::vector<float> wing_table(const RadialPsf& psf_at, double core_px, double wings_px) {
    std::vector<float> table(psf_wing_entries);
    const double from = std::log(core_px * core_px / 4);
    const double step = (std::log(wings_px * wings_px) - from) / (psf_wing_entries - 1);
    constexpr int points = 8;
    for (std::size_t i = 0; i < psf_wing_entries; ++i) {
        double mean = 0;
        for (int k = 0; k < points; ++k) {
            const double r =
                std::exp((from + step * (static_cast<double>(i) + (k + 0.5) / points - 0.5)) / 2);
            mean += psf_at(r) * (1 - core_window(r, core_px, true)) / points;
        }
        table[i] = static_cast<float>(mean);
    }
    return table;
}

/// PSF of a band by radius, and without defocus: what its wings are.
struct RadialBand {
    RadialPsf core, wings;
    double step_px = 1.0 / 64; ///< of its profile
};

RadialBand gaussian_band(const scene::Camera& camera) {
    const double disc_px = defocus_disc_px(camera);
    const double outer = std::max(disc_px, 1e-3);
    const RadialPsf psf_at = [&camera, outer](double r) {
        return blurred_annulus_psf(camera.psf.obscuration * outer, outer, std::max(camera.psf_sigma_px, 0.05),
                                   r);
    };
    return {psf_at, psf_at};
}

RadialBand airy_band(const scene::Camera& camera, const SpectralBand& band) {
    const Aperture aperture{camera.focal_length_m / camera.aperture_m, camera.psf.obscuration,
                            camera.pixel_pitch_m};
    const auto list = wavelengths_of(band);
    const auto blend = [list](const std::function<double(double, double)>& at, double r) {
        double sum = 0;
        for (const auto& [wavelength, share] : list)
            sum += share * at(wavelength, r);
        return sum;
    };
    const RadialPsf far = [=](double r) {
        return blend([&](double w, double q) { return airy_psf(aperture, w, q); }, r);
    };
    if (camera.psf.defocus_m == 0) return {far, far};
    const RadialPsf defocused = [=, defocus = camera.psf.defocus_m](double r) {
        return blend([&](double w, double q) { return defocused_psf(aperture, w, defocus, q); }, r);
    };
    return {defocused, far, 1.0 / 16};
}

/// The image of a band at a field position. Throws InputError if there is none.
const PsfImage& image_of(const std::vector<PsfImage>& images, const std::string& file, ImagePoint field,
                         std::size_t band) {
    const auto found = std::find_if(images.begin(), images.end(), [&](const PsfImage& i) {
        return i.field_x == field.x && i.field_y == field.y &&
               (i.band == 0 || i.band == static_cast<std::int32_t>(band) + 1);
    });
    if (found == images.end())
        throw InputError(
            fmt::format("{}: no image for band {} at ({}, {}): places must form a grid, each with all bands",
                        file, band + 1, field.x, field.y));
    return *found;
}

} // namespace

double defocus_disc_px(const scene::Camera& camera) {
    const double f_number = camera.focal_length_m / camera.aperture_m;
    return std::abs(camera.psf.defocus_m) / (2 * f_number) / camera.pixel_pitch_m;
}

PsfTables radial_psf_tables(const scene::Camera& camera, const std::vector<SpectralBand>& bands,
                            const PsfExtent& extent) {
    PsfTables tables;
    for (const SpectralBand& band : bands) {
        const RadialBand psf = camera.psf.model == scene::PointSpread::Model::gaussian
                                   ? gaussian_band(camera)
                                   : airy_band(camera, band);
        const PsfProfile profile = tabulate(psf.core, extent.core_px + 1, psf.step_px);
        const double inside = extent.has_wings() ? core_light(profile, extent.core_px) : 1;
        const auto psf_at = [&](double x, double y) { return profile.at(std::sqrt(x * x + y * y)); };
        tables.grids.push_back(grid_of(point_by_point(psf_at), extent, inside, 4));
        if (extent.has_wings())
            tables.wings.push_back(wing_table(psf.wings, extent.core_px, extent.wings_px));
    }
    return tables;
}

PsfTables image_psf_tables(const std::vector<PsfImage>& images, const std::string& file, ImagePoint field,
                           std::size_t bands, const PsfExtent& extent) {
    PsfTables tables;
    for (std::size_t b = 0; b < bands; ++b) {
        const PsfImage& image = image_of(images, file, field, b);
        // Samples per pitch of the columns, along both axes. One sample alone is as narrow as the grid.
        const double square = image.samples_per_pixel;
        const double across = image.width == 1 ? PsfCore::per_pixel : square;
        const double down = image.height == 1           ? PsfCore::per_pixel / extent.aspect
                            : image.samples_per_row > 0 ? image.samples_per_row / extent.aspect
                                                        : square;
        const double scale = across * down / image.sum();
        const auto psf_at = [&](double dx, double dy) { return scale * image.at(dx * across, dy * down); };
        const bool line = image.width == 1 || image.height == 1;
        const auto ring = [&](double r) {
            constexpr int points_per_px = 2 * PsfCore::per_pixel;
            const int points =
                line ? std::max(64, static_cast<int>(std::ceil(2 * pi * r * points_per_px))) : 64;
            double mean = 0;
            for (int k = 0; k < points; ++k)
                mean += psf_at(r * std::cos(2 * pi * k / points), r * std::sin(2 * pi * k / points)) / points;
            return mean;
        };
        const int finer = std::max(1, static_cast<int>(std::max(across, down) / PsfCore::per_pixel));
        double inside = 1;
        if (extent.has_wings()) {
            if (!image.is_point())
                inside = core_light(tabulate(ring, extent.core_px, 1.0 / 16), extent.core_px);
            tables.wings.push_back(wing_table(ring, extent.core_px, extent.wings_px));
        }
        tables.grids.push_back(grid_of(point_by_point(psf_at), extent, inside, finer));
    }
    return tables;
}

models::PsfConditions psf_conditions(const scene::Camera& camera) {
    models::PsfConditions conditions;
    conditions.pitch_m = camera.pixel_pitch_m;
    conditions.f_number = camera.focal_length_m / camera.aperture_m;
    return conditions;
}

PsfTables model_psf_tables(const models::PsfProgram& psf, const scene::Camera& camera, ImagePoint field,
                           const std::vector<SpectralBand>& bands, const PsfExtent& extent) {
    models::PsfConditions conditions = psf_conditions(camera);
    conditions.field_x_px = field.x - (camera.width - 1) / 2.0;
    conditions.field_y_px = field.y - (camera.height - 1) / 2.0;
    PsfTables tables;
    for (const SpectralBand& band : bands) {
        if (!tables.grids.empty() && !psf.depends_on_wavelength()) {
            tables.grids.push_back(tables.grids.front());
            if (extent.has_wings()) tables.wings.push_back(tables.wings.front());
            continue;
        }
        auto wavelengths = wavelengths_of(band);
        if (!psf.depends_on_wavelength()) wavelengths = {{conditions.wavelength_m, 1.0}};
        std::vector<double> one;
        const PsfValues psf_at = [&](std::span<const double> x, std::span<const double> y,
                                     std::span<double> values) {
            std::fill(values.begin(), values.end(), 0.0);
            one.resize(values.size());
            for (const auto& [wavelength, share] : wavelengths) {
                conditions.wavelength_m = wavelength;
                psf.density(conditions, x, y, one);
                for (std::size_t i = 0; i < values.size(); ++i)
                    values[i] += share * one[i];
            }
        };
        const RadialPsf ring = [&](double r) {
            std::array<double, 64> x{}, y{}, value{};
            for (std::size_t k = 0; k < x.size(); ++k) {
                const double angle = 2 * pi * static_cast<double>(k) / static_cast<double>(x.size());
                x[k] = r * std::cos(angle);
                y[k] = r * std::sin(angle);
            }
            psf_at(x, y, value);
            return std::accumulate(value.begin(), value.end(), 0.0) / static_cast<double>(x.size());
        };
        double inside = 1;
        if (extent.has_wings()) {
            inside = core_light(tabulate(ring, extent.core_px + 1, 1.0 / 64), extent.core_px);
            tables.wings.push_back(wing_table(ring, extent.core_px, extent.wings_px));
        }
        // As fine as the built-in functions; of 25 places that would take seconds.
        tables.grids.push_back(grid_of(psf_at, extent, inside, psf.depends_on_field() ? 2 : 4));
    }
    return tables;
}

} // namespace obscura::renderer
