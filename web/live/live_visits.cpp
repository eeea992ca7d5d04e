// SPDX-License-Identifier: Apache-2.0
// Visits of the live pictures to the daemons: rings of the cameras that are looked at, and those that went.
#include "core/error.hpp"
#include "host/monitor_client.hpp"
#include "web/live/live_viewers.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

namespace obscura::web {
namespace {

using transports::FrameRingReader;

/// Processes whose run is remembered while no daemon of that number answers.
constexpr std::size_t max_runs = 64;
/// Looks at the daemons without that of a camera until it has gone.
constexpr int max_missed = 2;

} // namespace

void LivePictures::begin_anew(std::int64_t pid) {
    frames_->forget(pid);
    for (auto& [id, camera] : cameras_) {
        if (id.pid != pid) continue;
        camera = std::make_shared<Camera>(); // the memory of the one before gets no more frames
        for (auto& [number, viewer] : viewers_) {
            if (!viewer->request || viewer->request->camera != id) continue;
            viewer->last_serial = viewer->last_number = viewer->histogram_of = 0;
            viewer->histogram_at = {};
        }
    }
    shares_changed_ = true;
}

void LivePictures::visit(host::MonitorClient& daemon, const DaemonRun& run) {
    const std::int64_t pid = run.pid;
    struct Wanted {
        CameraId id;
        std::shared_ptr<Camera> camera;
        double hz = 0;
        bool has_ring = false;
    };
    std::vector<Wanted> wanted;
    {
        const std::lock_guard lock(mutex_);
        const auto [known, is_new] = runs_.try_emplace(pid, run.started);
        if (!is_new && std::exchange(known->second, run.started) != run.started) begin_anew(pid);
        for (const auto& [id, camera] : cameras_) {
            if (id.pid != pid) continue;
            double hz = 0;
            for (const auto& [number, viewer] : viewers_)
                if (waits(*viewer) && viewer->request->camera == id)
                    hz = std::max(hz, viewer->request->max_hz);
            if (hz > 0) wanted.push_back({id, camera, hz, camera->ring != nullptr});
        }
    }
    for (const Wanted& one : wanted) {
        try {
            std::unique_ptr<const FrameRingReader> ring;
            FileDescriptor news;
            if (!one.has_ring) {
                auto handed = daemon.call("ring", {{"camera", one.id.number}, {"pid", pid}});
                const FileDescriptor memory = handed.take_file(0);
                news = handed.take_file(1);
                if (!memory || !news) throw InputError("the daemon hands over no frames");
                ring = std::make_unique<const FrameRingReader>(memory);
            }
            {
                const std::lock_guard lock(mutex_);
                Camera& camera = *one.camera;
                if (ring) camera.ring = std::move(ring), camera.news = std::move(news);
                const auto now = Clock::now();
                if (!camera.asked || now - *camera.asked > frames_watched)
                    camera.oldest = camera.ring->newest();
                camera.asked = now;
            }
            // Twice as often as pictures are wanted: frames do not come at the times when these are due.
            const auto period_us = static_cast<std::uint64_t>(0.5e6 / one.hz);
            const nlohmann::ordered_json told =
                daemon.call("watch", {{"camera", one.id.number}, {"pid", pid}, {"period_us", period_us}})
                    .head;
            const std::lock_guard lock(mutex_);
            one.camera->tai_offset_ns = told.value("tai_offset_ns", std::int64_t{0});
        } catch (const Error& error) {
            const std::lock_guard lock(mutex_);
            gone(one.id, error.what());
        }
    }
    if (!wanted.empty()) wake();
}

void LivePictures::visited(std::span<const std::int64_t> pids) {
    const std::lock_guard lock(mutex_);
    std::vector<CameraId> missing, unseen;
    for (const auto& [id, camera] : cameras_) {
        const bool there = std::find(pids.begin(), pids.end(), id.pid) != pids.end();
        camera->missed = there ? 0 : camera->missed + 1;
        if (camera->missed >= max_missed) missing.push_back(id);
        if (!is_seen(id)) unseen.push_back(id);
    }
    for (const CameraId& id : missing)
        gone(id, "no daemon of this process answers");
    for (const CameraId& id : unseen)
        cameras_.erase(id);
    if (runs_.size() > max_runs)
        std::erase_if(runs_, [&pids](const auto& run) {
            return std::find(pids.begin(), pids.end(), run.first) == pids.end();
        });
}

void LivePictures::gone(const CameraId& id, const std::string& why) {
    cameras_.erase(id);
    for (auto& [number, viewer] : viewers_) {
        if (!viewer->request || viewer->request->camera != id) continue;
        viewer->request.reset();
        viewer->deliver({reason_text("gone", why), {}, nullptr});
    }
    shares_changed_ = true;
}

} // namespace obscura::web
