// SPDX-License-Identifier: Apache-2.0
#include "web/live/kept_frames.hpp"

#include "core/camera/frame_record.hpp"
#include "host/frame_members.hpp"

#include <algorithm>
#include <utility>

namespace obscura::web {

std::shared_ptr<const KeptFrame> kept_frame(const CameraId& camera, const transports::RingFrame& frame) {
    const transports::FrameRingHeader& header = frame.header;
    const transports::FrameRingPose& pose = frame.truth.camera;
    auto kept = std::make_shared<KeptFrame>();
    kept->camera = camera;
    kept->number = header.number;
    kept->head = {{"number", header.number}, {"skipped", 0}, {"rows", header.rows}, {"flags", header.flags}};
    host::add_members(kept->head, FrameAnswer{.frame = header.frame_id,
                                              .trigger = header.trigger_id,
                                              .edge_tai_ns = header.edge_tai_ns,
                                              .exposure_us = static_cast<double>(header.exposure_ns) / 1e3,
                                              .gain_db = header.gain_db,
                                              .bits = header.bits,
                                              .mid_exposure_tai_ns = header.mid_exposure_tai_ns,
                                              .camera_position_m = pose.position_m,
                                              .camera_orientation = pose.orientation});
    kept->width = header.width;
    kept->height = header.height;
    kept->pixels.assign(frame.pixels.begin(), frame.pixels.end());
    return kept;
}

void KeptFrames::keep(std::shared_ptr<const KeptFrame> frame) {
    const std::lock_guard lock(mutex_);
    if (frame->bytes() > most_ || place({frame->camera, frame->number}) != frames_.end()) return;
    bytes_ += frame->bytes();
    while (bytes_ > most_) {
        auto first = std::find_if(frames_.begin(), frames_.end(), [this](const auto& one) {
            return !is_shown({one->camera, one->number});
        });
        if (first == frames_.end()) first = frames_.begin();
        bytes_ -= (*first)->bytes();
        frames_.erase(first);
    }
    frames_.push_back(std::move(frame));
}

void KeptFrames::forget(std::int64_t pid) {
    const std::lock_guard lock(mutex_);
    std::erase_if(frames_, [&](const auto& frame) {
        if (frame->camera.pid != pid) return false;
        bytes_ -= frame->bytes();
        return true;
    });
    for (auto& [viewer, last] : shown_)
        for (Id& id : last)
            if (id.camera.pid == pid) id = {};
}

std::shared_ptr<const KeptFrame> KeptFrames::find(const CameraId& camera, std::uint64_t number) const {
    const std::lock_guard lock(mutex_);
    const auto found = place({camera, number});
    return found == frames_.end() ? nullptr : *found;
}

void KeptFrames::shown(ViewerId viewer, const CameraId& camera, std::uint64_t number) {
    const std::lock_guard lock(mutex_);
    const Id id{camera, number};
    auto& last = shown_[viewer];
    if (last[0] != id) last = {id, last[0]};
}

void KeptFrames::left(ViewerId viewer) {
    const std::lock_guard lock(mutex_);
    shown_.erase(viewer);
}

KeptFrames::Frames::const_iterator KeptFrames::place(const Id& id) const {
    return std::find_if(frames_.begin(), frames_.end(), [&id](const auto& one) {
        return Id{one->camera, one->number} == id;
    });
}

bool KeptFrames::is_shown(const Id& id) const {
    return std::any_of(shown_.begin(), shown_.end(), [&id](const auto& viewer) {
        return viewer.second[0] == id || viewer.second[1] == id;
    });
}

} // namespace obscura::web
