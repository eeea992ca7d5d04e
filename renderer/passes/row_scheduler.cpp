// SPDX-License-Identifier: Apache-2.0
#include "renderer/passes/row_scheduler.hpp"

namespace obscura::renderer {

void RowScheduler::begin(const RowsOf& of, bool first, Scratch& local) const {
    if (local.frame != of.frame) local.whole.request = local.fewer.request = local.middle.request = 0;
    local.frame = of.frame;
    if (built_.settings.before_row && of.alone == nullptr) built_.settings.before_row(first);
    local.pins.clear();
    for (const SurfaceTiles* const tiles : built_.terrains)
        local.pins.push_back(tiles->pin());
}

void RowScheduler::end(Scratch& local) const {
    local.work.row_done();
    if (!built_.terrains.empty()) {
        surface_hits_.fetch_add(local.detail.hits, std::memory_order_relaxed);
        tiles_missed_.fetch_add(local.detail.missed, std::memory_order_relaxed);
        for (std::size_t k = 0; k < local.detail.coarser.size(); ++k)
            surface_coarser_[k].fetch_add(local.detail.coarser[k], std::memory_order_relaxed);
    }
    if (local.detail.doubtful > 0) rays_doubtful_.fetch_add(local.detail.doubtful, std::memory_order_relaxed);
    local.detail = {};
    if (local.filled > 0) pixels_filled_.fetch_add(local.filled, std::memory_order_relaxed);
    local.filled = 0;
    rays_done_.fetch_add(local.counts.rays, std::memory_order_relaxed);
    samples_done_.fetch_add(local.counts.samples, std::memory_order_relaxed);
    local.counts = {};
}

RenderWork RowScheduler::work() const noexcept {
    RenderWork work = work_done_.read();
    work.rays = rays_done_.load(std::memory_order_relaxed);
    work.samples = samples_done_.load(std::memory_order_relaxed);
    work.rays_doubtful = rays_doubtful_.load(std::memory_order_relaxed);
    work.surface_hits = surface_hits_.load(std::memory_order_relaxed);
    work.tiles_missed = tiles_missed_.load(std::memory_order_relaxed);
    work.pixels_filled = pixels_filled_.load(std::memory_order_relaxed);
    for (std::size_t k = 0; k < work.surface_coarser.size(); ++k)
        work.surface_coarser[k] = surface_coarser_[k].load(std::memory_order_relaxed);
    return work;
}

} // namespace obscura::renderer
