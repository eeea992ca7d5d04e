// SPDX-License-Identifier: Apache-2.0
// Sampling of the scene by cells and by points: steps 1 to 3 of WingMap.
#include "renderer/integrators/body_points.hpp"
#include "renderer/integrators/near_bodies.hpp"
#include "renderer/integrators/wing_map.hpp"
#include "renderer/packets/sampler.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Samples of a cell; of one whose first samples differ by more than a fraction of the largest; and of one
/// that some of them miss.
constexpr std::uint32_t cell_samples = 4;
constexpr std::uint32_t rough_cell_samples = 8;
constexpr std::uint32_t limb_cell_samples = 16;
constexpr double largest_spread = 0.75;
static_assert(cell_samples <= Tracer::batch_size);

/// Bodies of a smaller radius, in cells, are sampled by points: by as many as cells would take, or more.
constexpr double small_radius_cells = 16;
constexpr std::uint32_t min_points = 1024;
constexpr std::uint32_t max_points = 4096;
constexpr std::uint32_t points_per_job = 256;
static_assert(max_points >= cell_samples * 3 * small_radius_cells * small_radius_cells);

std::uint64_t stream_of(Time time, std::size_t level) {
    return static_cast<std::uint64_t>(time.ns) * 32 + level;
}

} // namespace

void WingMap::set_bodies(const Projection& lens, const RowState& row) {
    small_from_.assign(row.bodies.size(), never);
    point_jobs_.clear();
    std::size_t points = 0;
    for (std::size_t b = 0; b < row.bodies.size(); ++b) {
        const BodyState& body = row.bodies[b];
        if (body.targeted || body.cos_cone < 0) continue;
        // In pitches of the columns, as cells.
        const double radius_px = body.radius_px * std::min(1.0, psf_.aspect());
        int level = 0;
        while (radius_px >= small_radius_cells * kernels_.cell_px(static_cast<std::size_t>(level)) &&
               level < static_cast<int>(kernels_.levels()))
            ++level;
        small_from_[b] = level;
        const double away = std::acos(std::clamp(body.direction.z, -1.0, 1.0));
        if (away > std::asin(body.cone_sine) + lens.field_angle_rad(psf_.wings_reach_px() + 1)) continue;
        const double cells =
            std::min(small_radius_cells, radius_px / kernels_.cell_px(static_cast<std::size_t>(level)));
        // About as many as cells would take, to the next power of two.
        const double as_cells = 4 * cell_samples * cells * cells;
        const std::uint32_t few =
            std::clamp(std::bit_floor(static_cast<std::uint32_t>(as_cells * std::numbers::sqrt2)), min_points,
                       max_points);
        const auto add = [&](LitDisc::Part part, bool crescent, bool of_facets) {
            const int from_level = crescent ? 0 : level;
            if (from_level == static_cast<int>(kernels_.levels())) return;
            // Half as many in the dark, unless it shines by itself.
            const bool faint = part == LitDisc::Part::dark && body.built->emission.empty();
            const std::uint32_t count = crescent ? max_points : faint ? few / 2 : few;
            for (std::uint32_t first = 0; first < count; first += points_per_job) {
                point_jobs_.push_back({static_cast<std::int32_t>(b), part, from_level, first, points_per_job,
                                       count, points, of_facets});
                points += points_per_job;
            }
        };
        const bool of_facets = body.lit_facets != nullptr;
        if (of_facets) add(LitDisc::Part::lit, true, true);
        add(LitDisc::Part::lit, body.thin_crescent && !of_facets, false);
        add(LitDisc::Part::dark, false, false);
    }
    points_.assign(points, {});
    for (std::size_t i = 0; i < levels_.size(); ++i) {
        Level& l = levels_[i];
        // From the middle of a cell to its corner.
        l.near_rad = kernels_.cell_px(i) * std::numbers::sqrt2 / 2 * (1 + 1e-6) * lens.pixel_angle_rad();
        l.near_chord2.clear();
        l.sampled = false;
        for (std::size_t b = 0; b < row.bodies.size(); ++b) {
            const BodyState& body = row.bodies[b];
            const double half = (std::asin(body.cone_sine) + l.near_rad) / 2;
            l.near_chord2.push_back(
                body.cos_cone >= 0 && half < std::numbers::pi / 2 ? 4 * std::sin(half) * std::sin(half) : 5);
            l.sampled = l.sampled || (!body.targeted && small_from_[b] > static_cast<int>(i));
        }
    }
    bodies_set_ = true;
}

void WingMap::trace_points(std::int32_t index, const View& view) {
    const PointJob& job = point_jobs_[static_cast<std::size_t>(index)];
    const auto body = static_cast<std::size_t>(job.body);
    for (std::size_t i = 0; i < job.count; ++i)
        points_[job.at + i].from_level = never;
    const LitFacets* facets = view.row.bodies[body].lit_facets.get();
    if (!job.of_facets && !shines(view.row.bodies[body], job.part, facets, view.tracer)) return;
    find_occluders(view.row, job.body, view.candidates);
    const SeedWords seeds =
        seed_words(view.seed, stream_of(time_, 0), SamplePurpose::wing_points, job.body, 0);
    const BodySamples samples{
        view.row, job.body, job.first, job.count, job.of, seeds[job.part == LitDisc::Part::lit ? 0 : 2],
    };
    std::size_t used = job.at;
    const auto everywhere = [](ImagePoint) { return true; };
    const auto add = [&](ImagePoint at, std::span<const double> amount) {
        Point& point = points_[used];
        point.x = at.x;
        point.y = at.y * psf_.aspect();
        point.from_level = job.from_level;
        point.order = static_cast<std::uint32_t>(used++);
        for (std::size_t c = 0; c < amount.size(); ++c)
            point.amount[c] = static_cast<float>(amount[c]);
    };
    if (job.of_facets)
        trace_facets(samples, *facets, view.lens, view.candidates, view.tracer, everywhere, add);
    else
        trace_disc(samples, job.part, facets, view.lens, view.candidates, view.tracer, everywhere, add);
}

void WingMap::trace_cells(Job job, const View& view) {
    Level& l = levels_[job.level];
    GridRows::Row& cells = l.cells.at(job.row);
    const auto columns = static_cast<std::size_t>(source_columns(l));
    cells.lit = 0;
    cells.stage = 1;
    if (!l.sampled) return;
    // For each channel, light for the nodes of the row above the cells, then of the one below.
    cells.values.assign(2 * kernels_.channels() * columns, 0.0F);
    view.tracer.set_ray_width(view.lens.pixel_angle_rad() * kernels_.cell_px(job.level) /
                              std::sqrt(cell_samples));
    float* top = cells.values.data();
    float* bottom = top + kernels_.channels() * columns;
    for (std::int32_t k = 0; k < static_cast<std::int32_t>(columns); k += packet_size)
        trace_block(job.level, job.row, k, top, bottom, view);
    cells.lit = static_cast<std::int32_t>(columns);
}

/// Samples of 16 cells of a row of a level.
struct WingMap::CellSamples {
    const WingMap& map;
    const View& view;
    std::size_t level;
    std::int32_t row;   ///< of cells
    std::int32_t first; ///< column of the first cell
    double cell_px, cell_rows;
    Words place_seed, light_seed; ///< of the cells
    CameraRays rays[Tracer::batch_size];
    Doubles u[Tracer::batch_size], v[Tracer::batch_size], weight[Tracer::batch_size];
    int cell[Tracer::batch_size][packet_size];
    int count = 0; ///< used lanes

    CellSamples(const WingMap& of, const View& seen, std::size_t of_level, std::int32_t of_row,
                std::int32_t first_column)
        : map(of),
          view(seen),
          level(of_level),
          row(of_row),
          first(first_column),
          cell_px(of.kernels_.cell_px(of_level)),
          cell_rows(cell_px / of.psf_.aspect()) {}

    /// Finds the bodies near the cells; returns the cells that show one which is sampled by them.
    [[nodiscard]] Lanes find_bodies() const;
    void set_seeds();
    /// Adds a sample to be traced: samples of a cell follow each other, so that rays of a packet are alike.
    void add(int of_cell, std::uint32_t index);
    /// Traces the samples that were added.
    void trace();
    /// Sets the number of samples that cells need, after their first.
    void set_counts(std::uint32_t (&counts)[packet_size]) const;
    /// Deposits the samples' light, shared among `counts` samples of each cell, and forgets them. `at`: index
    /// of the first cell in the rows of nodes above and below, of `columns` nodes for each channel.
    void deposit(const std::uint32_t (&counts)[packet_size], std::int32_t at, std::size_t columns, float* top,
                 float* bottom);
};

Lanes WingMap::CellSamples::find_bodies() const {
    const Level& l = map.levels_[level];
    Doubles x;
    Doubles y;
    Doubles unused;
    Vec3s centre;
    for (int i = 0; i < packet_size; ++i) {
        x.v[i] = (first + i + 0.5) * cell_px;
        y.v[i] = (row + 0.5) * cell_rows;
    }
    view.lens.rays(x, y, centre, unused);
    view.candidates.clear();
    Lanes covered{};
    for (std::size_t b = 0; b < view.row.bodies.size(); ++b) {
        const BodyState& body = view.row.bodies[b];
        Lanes near;
        if (!near_body(body, centre, l.near_chord2[b], l.near_rad, near)) continue;
        // Bodies that are not sampled here hide what is behind them.
        view.candidates.push_back(static_cast<std::int32_t>(b));
        if (body.targeted || map.small_from_[b] <= static_cast<int>(level)) continue;
        for (int i = 0; i < packet_size; ++i)
            covered.on[i] |= near.on[i];
    }
    return covered;
}

void WingMap::CellSamples::set_seeds() {
    for (int i = 0; i < packet_size; ++i) {
        const SeedWords seeds =
            seed_words(view.seed, stream_of(map.time_, level), SamplePurpose::wing_cells, first + i, row);
        place_seed.v[i] = seeds[0];
        light_seed.v[i] = seeds[1];
    }
}

void WingMap::CellSamples::add(int of_cell, std::uint32_t index) {
    const int k = count / packet_size;
    const int lane = count % packet_size;
    cell[k][lane] = of_cell;
    rays[k].index.v[lane] = index;
    ++count;
}

void WingMap::CellSamples::trace() {
    const int packets = (count + packet_size - 1) / packet_size;
    for (int k = 0; k < packets; ++k) {
        CameraRays& packet = rays[k];
        const int lanes = std::min(count - k * packet_size, packet_size);
        Lanes active;
        Words seeds;
        for (int i = 0; i < packet_size; ++i) {
            // Unused lanes repeat the first, switched off.
            active.on[i] = i < lanes ? -1 : 0;
            if (i >= lanes) {
                cell[k][i] = cell[k][0];
                packet.index.v[i] = packet.index.v[0];
            }
            seeds.v[i] = place_seed.v[cell[k][i]];
            packet.light_seed.v[i] = light_seed.v[cell[k][i]];
        }
        sobol_pair(packet.index, seeds, u[k], v[k]);
        Doubles px;
        Doubles py;
        for (int i = 0; i < packet_size; ++i) {
            px.v[i] = (first + cell[k][i] + u[k].v[i]) * cell_px;
            py.v[i] = (row + v[k].v[i]) * cell_rows;
        }
        view.lens.rays(px, py, packet.direction, weight[k]);
        view.tracer.intersect(packet, active, view.candidates);
        view.tracer.count_samples(active);
        for (int i = 0; i < packet_size; ++i) {
            std::int32_t& hit = packet.hits.body[i];
            if (hit < 0) continue;
            const auto body = static_cast<std::size_t>(hit);
            if (map.small_from_[body] <= static_cast<int>(level) ||
                view.row.bodies[body].splatted(packet.direction.lane(i), packet.hits.primitive[i]))
                hit = -1;
        }
    }
    view.tracer.radiance({rays, static_cast<std::size_t>(packets)});
}

void WingMap::CellSamples::set_counts(std::uint32_t (&counts)[packet_size]) const {
    for (int first_of_cell = 0; first_of_cell < count; first_of_cell += cell_samples) {
        double least = no_hit;
        double most = 0;
        std::uint32_t hits = 0;
        for (int s = first_of_cell; s < first_of_cell + static_cast<int>(cell_samples); ++s) {
            const CameraRays& packet = rays[s / packet_size];
            double value = 0;
            if (packet.hits.body[s % packet_size] >= 0) {
                ++hits;
                for (std::size_t c = 0; c < map.kernels_.channels(); ++c)
                    value += packet.radiance.v[c].v[s % packet_size];
            }
            least = std::min(least, value);
            most = std::max(most, value);
        }
        std::uint32_t& needed = counts[cell[first_of_cell / packet_size][first_of_cell % packet_size]];
        needed = cell_samples;
        if (most - least > largest_spread * most)
            needed = hits < cell_samples ? limb_cell_samples : rough_cell_samples;
    }
}

void WingMap::CellSamples::deposit(const std::uint32_t (&counts)[packet_size], std::int32_t at,
                                   std::size_t columns, float* top, float* bottom) {
    for (int s = 0; s < count; ++s) {
        const int k = s / packet_size;
        const int i = s % packet_size;
        if (rays[k].hits.body[i] < 0) continue;
        const int of_cell = cell[k][i];
        const auto node = static_cast<std::size_t>(at) + static_cast<std::size_t>(of_cell);
        const double right = u[k].v[i];
        const double down = v[k].v[i];
        const double scale = weight[k].v[i] * cell_px * cell_rows / counts[of_cell];
        for (std::size_t c = 0; c < map.kernels_.channels(); ++c) {
            const double light = rays[k].radiance.v[c].v[i] * scale;
            float* above = top + c * columns + node;
            float* below = bottom + c * columns + node;
            above[0] += static_cast<float>(light * (1 - right) * (1 - down));
            below[0] += static_cast<float>(light * (1 - right) * down);
            if (node + 1 == columns) continue;
            above[1] += static_cast<float>(light * right * (1 - down));
            below[1] += static_cast<float>(light * right * down);
        }
    }
    count = 0;
}

void WingMap::trace_block(std::size_t level, std::int32_t row, std::int32_t at, float* top, float* bottom,
                          const View& view) const {
    const Level& l = levels_[level];
    const auto columns = static_cast<std::size_t>(source_columns(l));
    CellSamples samples(*this, view, level, row, l.first_column - margin + at);
    const Lanes covered = samples.find_bodies();
    if (!covered.any()) return;
    samples.set_seeds();
    for (int i = 0; i < packet_size; ++i)
        for (std::uint32_t s = 0; covered.on[i] != 0 && s < cell_samples; ++s)
            samples.add(i, s);
    samples.trace();
    std::uint32_t counts[packet_size] = {};
    samples.set_counts(counts);
    samples.deposit(counts, at, columns, top, bottom);
    // Trace the cells that need more samples.
    for (int i = 0; i < packet_size; ++i)
        for (std::uint32_t s = cell_samples; s < counts[i]; ++s) {
            samples.add(i, s);
            if (samples.count < static_cast<int>(Tracer::batch_size) * packet_size) continue;
            samples.trace();
            samples.deposit(counts, at, columns, top, bottom);
        }
    if (samples.count > 0) {
        samples.trace();
        samples.deposit(counts, at, columns, top, bottom);
    }
}

} // namespace obscura::renderer
