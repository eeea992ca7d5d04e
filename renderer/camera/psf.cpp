// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/psf.hpp"

#include "core/error.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/camera/psf_file.hpp"
#include "renderer/camera/psf_profile.hpp"
#include "renderer/lights/spectrum.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

namespace obscura::renderer {
namespace {

using std::numbers::pi;
constexpr int wavelengths_per_band = 8;
constexpr std::size_t wing_entries = 2048;
/// Memory limit for the tables of all field positions and bands.
constexpr double largest_tables_bytes = 512e6;

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

/// Fraction of the light within the core.
double core_light(const PsfProfile& p, double core_px, bool with_wings) {
    // The integral of a profile that is linear in each step.
    double sum = 0;
    double inner = p.values.front();
    for (std::size_t i = 1; i < p.values.size(); ++i) {
        const double to = static_cast<double>(i) * p.step_px;
        const double from = to - p.step_px;
        const double outer = p.values[i] * core_window(to, core_px, with_wings);
        sum += (2 * from + to) * inner + (from + 2 * to) * outer;
        inner = outer;
    }
    return sum * 2 * pi / 6 * p.step_px;
}

/// Values of `psf_at(x, y)` times the window on the grid of PsfCore, normalised to `light` in all; each is
/// the mean over `points` points along x and as dense ones along y, for patterns finer than the grid. Both
/// axes of `psf_at` are in pitches of the columns; `aspect`: see scene::Camera::pixel_aspect().
std::vector<double> grid_of(const std::function<double(double, double)>& psf_at, std::int32_t half,
                            double aspect, double core_px, bool with_wings, double light, int points) {
    const int points_y = points * std::max(1, static_cast<int>(std::ceil(aspect)));
    const std::int32_t side = 2 * half + 1;
    std::vector<double> grid(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
    const double step = 1.0 / PsfCore::per_pixel;
    double sum = 0;
    for (std::int32_t j = 0; j < side; ++j)
        for (std::int32_t i = 0; i < side; ++i) {
            const double x = (i - half) * step;
            const double y = aspect * ((j - half) * step);
            const double r = std::sqrt(x * x + y * y);
            double mean = 0;
            if (r < core_px + aspect)
                for (int b = 0; b < points_y; ++b)
                    for (int a = 0; a < points; ++a)
                        mean += psf_at(x + step * ((a + 0.5) / points - 0.5),
                                       y + aspect * step * ((b + 0.5) / points_y - 0.5));
            const double value = mean / (points * points_y) * core_window(r, core_px, with_wings);
            grid[static_cast<std::size_t>(j) * static_cast<std::size_t>(side) + static_cast<std::size_t>(i)] =
                value;
            sum += value;
        }
    for (double& v : grid)
        v *= light / (sum * step * step);
    return grid;
}

/// Table of the wings by the logarithm of the squared distance; each entry is the mean over its interval.
std::vector<float> wing_table(const RadialPsf& psf_at, double core_px, double wings_px) {
    std::vector<float> table(wing_entries);
    const double from = std::log(core_px * core_px / 4);
    const double step = (std::log(wings_px * wings_px) - from) / (wing_entries - 1);
    constexpr int points = 8;
    for (std::size_t i = 0; i < wing_entries; ++i) {
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

} // namespace

PsfCore::PsfCore(std::int32_t half, const std::vector<std::vector<double>>& psf)
    : side_(2 * half + 1 + per_pixel), reach_px_((side_ - 1) / 2.0 / per_pixel) {
    const std::int32_t from_side = 2 * half + 1;
    const auto side = static_cast<std::size_t>(side_);
    const double step = 1.0 / per_pixel;
    const auto integrate = [&](const std::vector<double>& grid) {
        // Integrate over the pixel's square, one axis after the other, by the trapezoidal rule: squares of
        // whole steps tile.
        std::vector<double> across(static_cast<std::size_t>(from_side) * side, 0.0);
        std::vector<float> out(side * side);
        for (std::int32_t j = 0; j < from_side; ++j)
            for (std::int32_t i = 0; i < side_; ++i)
                for (std::int32_t k = 0; k <= per_pixel; ++k) {
                    const std::int32_t at = i - k;
                    if (at < 0 || at >= from_side) continue;
                    const double weight = (k == 0 || k == per_pixel ? 0.5 : 1.0) * step;
                    across[static_cast<std::size_t>(j) * side + static_cast<std::size_t>(i)] +=
                        weight * grid[static_cast<std::size_t>(j) * static_cast<std::size_t>(from_side) +
                                      static_cast<std::size_t>(at)];
                }
        for (std::int32_t j = 0; j < side_; ++j)
            for (std::int32_t i = 0; i < side_; ++i) {
                double sum = 0;
                for (std::int32_t k = 0; k <= per_pixel; ++k) {
                    const std::int32_t at = j - k;
                    if (at < 0 || at >= from_side) continue;
                    const double weight = (k == 0 || k == per_pixel ? 0.5 : 1.0) * step;
                    sum += weight * across[static_cast<std::size_t>(at) * side + static_cast<std::size_t>(i)];
                }
                out[static_cast<std::size_t>(j) * side + static_cast<std::size_t>(i)] =
                    static_cast<float>(sum);
            }
        return out;
    };
    for (const std::vector<double>& grid : psf) {
        response_.push_back(integrate(grid));
        double sum = 0;
        ImagePoint moment;
        for (std::int32_t j = 0; j < from_side; ++j)
            for (std::int32_t i = 0; i < from_side; ++i) {
                const double d = grid[static_cast<std::size_t>(j) * static_cast<std::size_t>(from_side) +
                                      static_cast<std::size_t>(i)];
                sum += d;
                moment.x += d * (i - half) * step, moment.y += d * (j - half) * step;
            }
        light_.push_back(sum * step * step);
        centroid_.push_back(sum > 0 ? ImagePoint{moment.x / sum, moment.y / sum} : ImagePoint{});
    }
    const std::size_t cells = (side - 1) * (side - 1);
    const auto cell_mean = [&](const std::vector<float>& r, std::size_t i, std::size_t j) {
        const float* at = r.data() + j * side + i;
        return (static_cast<double>(at[0]) + static_cast<double>(at[1]) + static_cast<double>(at[side]) +
                static_cast<double>(at[side + 1])) /
               4;
    };
    const bool same = std::all_of(psf.begin(), psf.end(),
                                  [&](const std::vector<double>& grid) { return grid == psf.front(); });
    if (same) response_.resize(1);
    column_sums_.resize(cells);
    std::vector<double> total(cells, 0.0);
    double all = 0;
    for (std::size_t j = 0; j + 1 < side; ++j) {
        double row = 0;
        for (std::size_t i = 0; i + 1 < side; ++i) {
            double& t = total[j * (side - 1) + i];
            for (const std::vector<float>& r : response_)
                t += cell_mean(r, i, j);
            row += t;
        }
        double sum = 0;
        for (std::size_t i = 0; i + 1 < side; ++i) {
            sum += total[j * (side - 1) + i];
            column_sums_[j * (side - 1) + i] = row > 0 ? static_cast<float>(sum / row) : 1.0F;
        }
        all += row;
        row_sums_.push_back(all);
    }
    for (double& s : row_sums_)
        s /= all;
    if (same) return;
    for (const std::vector<float>& r : response_) {
        std::vector<float> ratio(cells, 0.0F);
        for (std::size_t j = 0; j + 1 < side; ++j)
            for (std::size_t i = 0; i + 1 < side; ++i) {
                const double t = total[j * (side - 1) + i];
                if (t > 0)
                    ratio[j * (side - 1) + i] =
                        static_cast<float>(cell_mean(r, i, j) * step * step * all / t);
            }
        ratio_.push_back(std::move(ratio));
    }
}

void PsfCore::sample(double u, double v, double& x, double& y, std::size_t& cell) const {
    const auto cells = static_cast<std::size_t>(side_ - 1);
    const auto row = static_cast<std::size_t>(
        std::min(std::upper_bound(row_sums_.begin(), row_sums_.end(), u) - row_sums_.begin(),
                 static_cast<std::ptrdiff_t>(cells) - 1));
    const double below = row > 0 ? row_sums_[row - 1] : 0;
    const auto first = column_sums_.begin() + static_cast<std::ptrdiff_t>(row * cells);
    const auto last = first + static_cast<std::ptrdiff_t>(cells);
    const auto column =
        static_cast<std::size_t>(std::min(std::upper_bound(first, last, static_cast<float>(v)) - first,
                                          static_cast<std::ptrdiff_t>(cells) - 1));
    const double left = column > 0 ? static_cast<double>(first[static_cast<std::ptrdiff_t>(column) - 1]) : 0;
    const double height = row_sums_[row] - below;
    const double width = static_cast<double>(first[static_cast<std::ptrdiff_t>(column)]) - left;
    const double in_row = height > 0 ? std::clamp((u - below) / height, 0.0, 1.0) : 0.5;
    const double in_column = width > 0 ? std::clamp((v - left) / width, 0.0, 1.0) : 0.5;
    y = (static_cast<double>(row) + in_row) / per_pixel - reach_px_;
    x = (static_cast<double>(column) + in_column) / per_pixel - reach_px_;
    cell = row * cells + column;
}

double PsfCore::response(std::size_t band, double x, double y) const {
    const double column = (x + reach_px_) * per_pixel;
    const double row = (y + reach_px_) * per_pixel;
    if (!(column >= 0 && row >= 0 && column < side_ - 1 && row < side_ - 1)) return 0;
    const auto i = static_cast<std::size_t>(column);
    const auto j = static_cast<std::size_t>(row);
    const auto side = static_cast<std::size_t>(side_);
    const float* at = response_[response_.size() > 1 ? band : 0].data() + j * side + i;
    const double a = column - static_cast<double>(i);
    const double b = row - static_cast<double>(j);
    const double top = static_cast<double>(at[0]) * (1 - a) + static_cast<double>(at[1]) * a;
    const double bottom = static_cast<double>(at[side]) * (1 - a) + static_cast<double>(at[side + 1]) * a;
    return top * (1 - b) + bottom * b;
}

std::unique_ptr<const Psf> Psf::make(const scene::Camera& camera, const std::vector<SpectralBand>& bands) {
    const scene::PointSpread& s = camera.psf;
    using Model = scene::PointSpread::Model;
    if (s.model == Model::gaussian && s.defocus_m == 0) return nullptr;
    const bool with_wings = s.wings_px > 0;
    if (with_wings && !(s.wings_px > s.core_px))
        throw ConfigError(fmt::format("camera: psf: wings of {} px: allowed 0 or more than the core's {} px",
                                      s.wings_px, s.core_px));
    const Aperture aperture{camera.focal_length_m / camera.aperture_m, s.obscuration, camera.pixel_pitch_m};
    const double disc_px = std::abs(s.defocus_m) / (2 * aperture.f_number) / camera.pixel_pitch_m;
    const double room_px =
        (with_wings ? 0.5 : 1) * s.core_px - (s.model == Model::gaussian ? 4 * camera.psf_sigma_px : 1);
    if (s.model == Model::table && s.defocus_m != 0)
        throw ConfigError("camera: psf: a table cannot be defocused: allowed are gaussian and airy");
    if (disc_px > room_px)
        throw ConfigError(fmt::format(
            "camera: psf: the disc of the defocus has a radius of {:.1f} px: a core of {} px allows {:.1f}",
            disc_px, s.core_px, room_px));

    const double aspect = camera.pixel_aspect();
    std::unique_ptr<Psf> psf(new Psf);
    psf->core_px_ = s.core_px;
    psf->wings_px_ = with_wings ? s.wings_px : 0;
    psf->aspect_ = aspect;
    psf->field_x_ = psf->field_y_ = {0};
    const auto half = static_cast<std::int32_t>(std::lround(psf->core_extent_px() * PsfCore::per_pixel));
    const auto check_size = [&](std::size_t places) {
        const double bytes =
            8.0 * (2.0 * half + 9) * (2.0 * half + 9) * static_cast<double>(bands.size() * places);
        if (bytes > largest_tables_bytes)
            throw ConfigError(fmt::format(
                "camera: psf: a core of {} px for {} bands at {} places takes {:.0f} MB: allowed are {:.0f}",
                s.core_px, bands.size(), places, bytes / 1e6, largest_tables_bytes / 1e6));
    };

    if (s.model == Model::table) {
        const std::vector<PsfImage> images = read_psf_file(s.file);
        std::set<double> xs;
        std::set<double> ys;
        for (const PsfImage& i : images) {
            xs.insert(i.field_x);
            ys.insert(i.field_y);
            if (i.band > static_cast<std::int32_t>(bands.size()))
                throw InputError(
                    fmt::format("{}: an image of band {}: the scene has {}", s.file, i.band, bands.size()));
        }
        psf->field_x_.assign(xs.begin(), xs.end());
        psf->field_y_.assign(ys.begin(), ys.end());
        check_size(xs.size() * ys.size());
        for (const double y : ys)
            for (const double x : xs) {
                std::vector<std::vector<double>> grids;
                std::vector<std::vector<float>> wings;
                for (std::size_t b = 0; b < bands.size(); ++b) {
                    const auto found = std::find_if(images.begin(), images.end(), [&](const PsfImage& i) {
                        return i.field_x == x && i.field_y == y &&
                               (i.band == 0 || i.band == static_cast<std::int32_t>(b) + 1);
                    });
                    if (found == images.end())
                        throw InputError(fmt::format(
                            "{}: no image for band {} at ({}, {}): places must form a grid, each with all bands",
                            s.file, b + 1, x, y));
                    const PsfImage& image = *found;
                    // Samples per pitch of the columns, along both axes.
                    const double across = image.samples_per_pixel;
                    const double down = image.samples_per_row > 0 ? image.samples_per_row / aspect : across;
                    const double scale = across * down / image.sum();
                    const auto psf_at = [&](double dx, double dy) {
                        return scale * image.at(dx * across, dy * down);
                    };
                    const auto ring = [&](double r) {
                        constexpr int points = 64;
                        double mean = 0;
                        for (int k = 0; k < points; ++k)
                            mean +=
                                psf_at(r * std::cos(2 * pi * k / points), r * std::sin(2 * pi * k / points)) /
                                points;
                        return mean;
                    };
                    const int finer =
                        std::max(1, static_cast<int>(std::max(across, down) / PsfCore::per_pixel));
                    double inside = 1;
                    if (with_wings) {
                        inside = core_light(tabulate(ring, s.core_px, 1.0 / 16), s.core_px, true);
                        wings.push_back(wing_table(ring, s.core_px, s.wings_px));
                    }
                    grids.push_back(grid_of(psf_at, half, aspect, s.core_px, with_wings, inside, finer));
                }
                psf->cores_.emplace_back(half, grids);
                if (with_wings) psf->wings_.push_back(std::move(wings));
            }
    } else {
        check_size(1);
        std::vector<std::vector<double>> grids;
        std::vector<std::vector<float>> wings;
        for (const SpectralBand& band : bands) {
            RadialPsf psf_at;
            RadialPsf far;
            double step = 1.0 / 64;
            if (s.model == Model::gaussian) {
                const double outer = std::max(disc_px, 1e-3);
                psf_at = far = [&, outer](double r) {
                    return blurred_annulus_psf(s.obscuration * outer, outer,
                                               std::max(camera.psf_sigma_px, 0.05), r);
                };
            } else {
                const auto list = wavelengths_of(band);
                const auto blend = [list](const std::function<double(double, double)>& at, double r) {
                    double sum = 0;
                    for (const auto& [wavelength, share] : list)
                        sum += share * at(wavelength, r);
                    return sum;
                };
                far = [=](double r) {
                    return blend([&](double w, double q) { return airy_psf(aperture, w, q); }, r);
                };
                psf_at = far;
                if (s.defocus_m != 0) {
                    step = 1.0 / 16;
                    psf_at = [=, defocus = s.defocus_m](double r) {
                        return blend(
                            [&](double w, double q) { return defocused_psf(aperture, w, defocus, q); }, r);
                    };
                }
            }
            const PsfProfile profile = tabulate(psf_at, s.core_px + 1, step);
            const double inside = with_wings ? core_light(profile, s.core_px, true) : 1;
            grids.push_back(grid_of([&](double x, double y) { return profile.at(std::sqrt(x * x + y * y)); },
                                    half, aspect, s.core_px, with_wings, inside, 4));
            if (with_wings) wings.push_back(wing_table(far, s.core_px, s.wings_px));
        }
        psf->cores_.emplace_back(half, grids);
        if (with_wings) psf->wings_.push_back(std::move(wings));
        psf->chromatic_ = bands.size() > 1 && s.model == Model::airy;
    }
    if (s.model == Model::table && bands.size() > 1) psf->chromatic_ = true;
    return psf;
}

PsfZones Psf::zones_at(double x, double y) const {
    if (cores_.size() == 1) return {};
    const auto find = [](const std::vector<double>& at, double value, double& share) {
        if (at.size() == 1 || value <= at.front()) {
            share = 0;
            return std::size_t{0};
        }
        const auto after = std::min(std::upper_bound(at.begin(), at.end(), value), at.end() - 1);
        const auto i = static_cast<std::size_t>(after - at.begin()) - 1;
        share = std::min(1.0, (value - at[i]) / (at[i + 1] - at[i]));
        return i;
    };
    double right = 0;
    double down = 0;
    const std::size_t i = find(field_x_, x, right);
    const std::size_t j = find(field_y_, y, down);
    const std::size_t i1 = std::min(i + 1, field_x_.size() - 1);
    const std::size_t j1 = std::min(j + 1, field_y_.size() - 1);
    const std::size_t width = field_x_.size();
    return {{j * width + i, j * width + i1, j1 * width + i, j1 * width + i1},
            {(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down}};
}

void Psf::displace(const Doubles& u, const Doubles& v, std::size_t channels, Doubles& x, Doubles& y,
                   Channels& weight) const {
    for (int i = 0; i < packet_size; ++i) {
        const PsfCore* core = &cores_.front();
        double choice = u[i];
        if (cores_.size() > 1) {
            // Select the field position by the first number; its remainder samples the core.
            const PsfZones places = zones_at(x[i], y[i]);
            int k = 0;
            while (k < 3 && choice >= places.share[k])
                choice -= places.share[k++];
            choice = places.share[k] > 0 ? std::min(choice / places.share[k], 1 - 1e-9) : 0.5;
            core = &cores_[places.zone[k]];
        }
        double dx = 0;
        double dy = 0;
        std::size_t cell = 0;
        core->sample(choice, v[i], dx, dy, cell);
        x[i] -= dx;
        y[i] -= dy;
        for (std::size_t c = 0; c < channels; ++c)
            weight.v[c][i] = core->weight(c, cell);
    }
}

double Psf::weight(ImagePoint at, std::int32_t column, std::int32_t row, std::size_t band) const {
    const double dx = column - at.x;
    const double dy = row - at.y;
    if (cores_.size() == 1) return cores_.front().response(band, dx, dy);
    const PsfZones places = zones_at(at.x, at.y);
    double sum = 0;
    for (int k = 0; k < 4; ++k)
        if (places.share[k] > 0) sum += places.share[k] * cores_[places.zone[k]].response(band, dx, dy);
    return sum;
}

ImagePoint Psf::centroid(ImagePoint at, std::span<const double> weights) const {
    const PsfZones places = zones_at(at.x, at.y);
    ImagePoint moment;
    double sum = 0;
    for (int k = 0; k < 4; ++k)
        for (std::size_t b = 0; b < weights.size(); ++b) {
            if (places.share[k] == 0) continue;
            const PsfCore& core = cores_[places.zone[k]];
            const double light = places.share[k] * weights[b] * core.light(b);
            const ImagePoint c = core.centroid(b);
            moment.x += light * c.x, moment.y += light * c.y;
            sum += light;
        }
    return sum > 0 ? ImagePoint{moment.x / sum, moment.y / sum} : ImagePoint{};
}

double Psf::wing(std::size_t zone, std::size_t band, double squared_distance_px) const {
    const double from = core_px_ * core_px_ / 4;
    if (squared_distance_px <= from || squared_distance_px >= wings_px_ * wings_px_) return 0;
    const double position =
        std::log(squared_distance_px / from) * (wing_entries - 1) / std::log(wings_px_ * wings_px_ / from);
    const auto i = std::min(static_cast<std::size_t>(position), wing_entries - 2);
    const std::vector<float>& table = wings_[zone][band];
    const auto a = static_cast<double>(table[i]);
    const auto b = static_cast<double>(table[i + 1]);
    return aspect_ * (a + (b - a) * (position - static_cast<double>(i)));
}

} // namespace obscura::renderer
