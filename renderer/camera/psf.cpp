// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/psf.hpp"

#include "core/error.hpp"
#include "renderer/camera/model_psf.hpp"
#include "renderer/camera/psf_file.hpp"
#include "renderer/camera/psf_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace obscura::renderer {
namespace {

/// Memory limit for the tables of all field positions and bands.
constexpr double largest_tables_bytes = 512e6;

/// Throws ConfigError if the keys contradict each other.
void check_point_spread(const scene::Camera& camera) {
    const scene::PointSpread& s = camera.psf;
    using Model = scene::PointSpread::Model;
    const bool with_wings = s.wings_px > 0;
    if (with_wings && !(s.wings_px > s.core_px))
        throw ConfigError(fmt::format("camera: psf: wings of {} px: allowed 0 or more than the core's {} px",
                                      s.wings_px, s.core_px));
    if ((s.model == Model::table || s.model == Model::model) && s.defocus_m != 0)
        throw ConfigError(fmt::format("camera: psf: a {} cannot be defocused: allowed are gaussian and airy",
                                      name_of(s.model)));
    const double disc_px = defocus_disc_px(camera);
    const double room_px =
        (with_wings ? 0.5 : 1) * s.core_px - (s.model == Model::gaussian ? 4 * camera.psf_sigma_px : 1);
    if (disc_px > room_px)
        throw ConfigError(fmt::format(
            "camera: psf: the disc of the defocus has a radius of {:.1f} px: a core of {} px allows {:.1f}",
            disc_px, s.core_px, room_px));
}

/// Throws ConfigError if the tables of so many field positions take too much memory.
void check_table_size(const PsfExtent& extent, std::size_t bands, std::size_t places) {
    const double bytes =
        8.0 * (2.0 * extent.half + 9) * (2.0 * extent.half + 9) * static_cast<double>(bands * places);
    if (bytes > largest_tables_bytes)
        throw ConfigError(fmt::format(
            "camera: psf: a core of {} px for {} bands at {} places takes {:.0f} MB: allowed are {:.0f}",
            extent.core_px, bands, places, bytes / 1e6, largest_tables_bytes / 1e6));
}

} // namespace

std::unique_ptr<const Psf> Psf::make(scene::Camera& camera, const std::vector<SpectralBand>& bands) {
    const scene::PointSpread s = camera.psf;
    using Model = scene::PointSpread::Model;
    if (s.model == Model::gaussian && s.defocus_m == 0) return nullptr;
    check_point_spread(camera);
    std::unique_ptr<Psf> psf(new Psf);
    psf->core_px_ = s.core_px;
    psf->wings_px_ = s.wings_px > 0 ? s.wings_px : 0;
    psf->aspect_ = camera.pixel_aspect();
    psf->chromatic_ = bands.size() > 1 && s.model != Model::gaussian;
    if (s.model == Model::table) {
        const std::vector<PsfImage> images = read_psf_file(s.file);
        psf->add_images(images, s.file, bands.size());
        if (!std::all_of(images.begin(), images.end(), [](const PsfImage& i) { return i.is_point(); }))
            return psf;
        // Tables would smear a point over an eighth of a pixel.
        camera.psf = {};
        camera.psf_sigma_px = 0;
        return nullptr;
    }
    if (s.model == Model::model) {
        psf->add_model(camera, bands);
        return psf;
    }
    psf->field_x_ = psf->field_y_ = {0};
    check_table_size(psf->extent(), bands.size(), 1);
    psf->add_zone(radial_psf_tables(camera, bands, psf->extent()));
    return psf;
}

void Psf::add_images(const std::vector<PsfImage>& images, const std::string& file, std::size_t bands) {
    std::set<double> xs;
    std::set<double> ys;
    for (const PsfImage& i : images) {
        xs.insert(i.field_x);
        ys.insert(i.field_y);
        if (i.band > static_cast<std::int32_t>(bands))
            throw InputError(fmt::format("{}: an image of band {}: the scene has {}", file, i.band, bands));
    }
    field_x_.assign(xs.begin(), xs.end());
    field_y_.assign(ys.begin(), ys.end());
    check_table_size(extent(), bands, xs.size() * ys.size());
    for (const double y : ys)
        for (const double x : xs)
            add_zone(image_psf_tables(images, file, {x, y}, bands, extent()));
}

void Psf::add_model(const scene::Camera& camera, const std::vector<SpectralBand>& bands) {
    const models::PsfProgram program = psf_program(camera);
    chromatic_ = bands.size() > 1 && program.depends_on_wavelength();
    constexpr int places = 5;
    const auto spread = [&](std::int32_t size) {
        if (!program.depends_on_field()) return std::vector<double>{(size - 1) / 2.0};
        std::vector<double> at;
        for (int i = 0; i < places; ++i)
            at.push_back((size - 1.0) * i / (places - 1));
        return at;
    };
    field_x_ = spread(camera.width);
    field_y_ = spread(camera.height);
    check_table_size(extent(), bands.size(), field_x_.size() * field_y_.size());
    for (const double y : field_y_)
        for (const double x : field_x_)
            add_zone(model_psf_tables(program, camera, {x, y}, bands, extent()));
}

void Psf::add_zone(PsfTables tables) {
    cores_.emplace_back(extent().half, tables.grids);
    if (wings_px_ > 0) wings_.push_back(std::move(tables.wings));
}

PsfExtent Psf::extent() const {
    return {core_px_, wings_px_, aspect_,
            static_cast<std::int32_t>(std::lround(core_extent_px() * PsfCore::per_pixel))};
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
    const double position = std::log(squared_distance_px / from) * (psf_wing_entries - 1) /
                            std::log(wings_px_ * wings_px_ / from);
    const auto i = std::min(static_cast<std::size_t>(position), psf_wing_entries - 2);
    const std::vector<float>& table = wings_[zone][band];
    const auto a = static_cast<double>(table[i]);
    const auto b = static_cast<double>(table[i + 1]);
    return aspect_ * (a + (b - a) * (position - static_cast<double>(i)));
}

} // namespace obscura::renderer
