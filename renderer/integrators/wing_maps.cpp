// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/wing_maps.hpp"

#include <algorithm>

namespace obscura::renderer {

WingMap& WingMaps::map_at(Time time) {
    for (Held& h : held_)
        if (h.map->holds(time, first_x_, width_)) {
            h.used = request_;
            return *h.map;
        }
    const auto oldest = std::min_element(held_.begin(), held_.end(),
                                         [](const Held& a, const Held& b) { return a.used < b.used; });
    if (held_.size() < kept || oldest->used == request_) {
        held_.push_back({std::make_unique<WingMap>(psf_, kernels_), request_});
        held_.back().map->begin(time, first_x_, width_);
        return *held_.back().map;
    }
    oldest->used = request_;
    oldest->map->begin(time, first_x_, width_);
    return *oldest->map;
}

std::span<const WingMaps::Needed> WingMaps::find(std::uint64_t frame_id, std::span<const RowTime> rows,
                                                 std::int32_t first_y, std::int32_t first_x,
                                                 std::int32_t width) {
    ++request_;
    if (key_times_.live() && frame_id != frame_id_)
        for (Held& h : held_)
            h.map->forget();
    frame_id_ = frame_id;
    first_y_ = first_y;
    first_x_ = first_x;
    width_ = width;
    needed_.clear();
    shares_.clear();
    row_end_.clear();
    std::sort(held_.begin(), held_.end(), [](const Held& a, const Held& b) { return a.used > b.used; });
    if (held_.size() > kept) held_.resize(kept);
    for (std::size_t r = 0; r < rows.size(); ++r) {
        const std::int32_t y = first_y + static_cast<std::int32_t>(r);
        if (r == 0 || rows[r] != rows[r - 1]) key_times_.find(rows[r], keys_);
        for (const KeyTime& key : keys_) {
            auto found = std::find_if(needed_.begin(), needed_.end(),
                                      [&](const Needed& n) { return n.map->time() == key.time; });
            if (found == needed_.end()) found = needed_.insert(found, {&map_at(key.time), y, y});
            found->last_y = y;
            shares_.push_back({found->map, key.weight});
        }
        row_end_.push_back(shares_.size());
    }
    return needed_;
}

void WingMaps::add(std::size_t r, std::vector<double>& light, std::vector<float>& scratch) const {
    for (std::size_t i = r > 0 ? row_end_[r - 1] : 0; i < row_end_[r]; ++i)
        shares_[i].map->add(first_y_ + static_cast<std::int32_t>(r), shares_[i].weight, first_x_, width_,
                            light, scratch);
}

} // namespace obscura::renderer
