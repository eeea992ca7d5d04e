// SPDX-License-Identifier: Apache-2.0
// Live pictures: views of the newest frames for viewers that ask for each, from the frame rings of daemons.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "web/live/daemon_watch.hpp"
#include "web/live/kept_frames.hpp"
#include "web/live/live_budget.hpp"
#include "web/live/live_message.hpp"
#include "web/live/made_pictures.hpp"
#include "web/live/web_figures.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace obscura::web {

/// What goes to a viewer: a text, or else a picture.
struct LiveDelivery {
    std::string text;
    std::array<unsigned char, picture_header_bytes> header{};
    std::shared_ptr<const std::vector<std::uint16_t>> pixels; ///< shared with viewers of the same view
    std::shared_ptr<const std::vector<unsigned char>> jpeg =
        {}; ///< goes in place of `pixels`; null: these do
};

/// A viewer has at most one picture on its way: the next is made once it has said that it is ready, from the
/// newest frame then. Nothing is made for those who are not, and a daemon copies no frames of a camera
/// without waiting viewers. A thread of its own makes pictures and histograms; the watch over the daemons
/// asks these for their rings. Thread-safe.
class LivePictures final : public DaemonVisitor {
public:
    /// `frames` gets those that viewers see.
    explicit LivePictures(double bytes_per_s = live_bytes_per_s,
                          std::shared_ptr<WebFigures> figures = std::make_shared<WebFigures>(),
                          std::shared_ptr<KeptFrames> frames = std::make_shared<KeptFrames>());
    ~LivePictures() override;
    LivePictures(const LivePictures&) = delete;
    LivePictures& operator=(const LivePictures&) = delete;

    using ViewerId = std::uint64_t;
    /// Called on the thread of this; must neither block nor call this.
    using Deliver = std::function<void(LiveDelivery)>;
    [[nodiscard]] ViewerId join(Deliver deliver);
    void leave(ViewerId viewer);
    /// Another view, of which the viewer gets a picture at once if it is ready. One that has never seen any
    /// is.
    void view(ViewerId viewer, const ViewRequest& request);
    void ready(ViewerId viewer);
    /// Nothing is delivered any more.
    void stop();
    /// Cameras that are looked at, or have been half a second ago.
    [[nodiscard]] std::size_t cameras() const;

    /// Called, on any thread, when a camera is wanted that no daemon has been asked for: the watch should
    /// look.
    void when_wanted(std::function<void()> look);

    void visit(host::MonitorClient& daemon, const DaemonRun& run) override;
    void visited(std::span<const std::int64_t> pids) override;

private:
    using Clock = std::chrono::steady_clock;
    struct Camera;
    struct Viewer;
    struct Due;

    void work();
    void wait(std::unique_lock<std::mutex>& lock, Clock::time_point until);
    void wake();
    void share(Clock::time_point now);
    [[nodiscard]] bool waits(const Viewer& viewer) const;
    [[nodiscard]] bool is_seen(const CameraId& camera) const;
    [[nodiscard]] std::vector<Due> due(Clock::time_point now, Clock::time_point& next);
    void serve(std::vector<Due>& due, std::unique_lock<std::mutex>& lock);
    /// Unlocks.
    void look_if_wanted(Viewer& viewer, std::unique_lock<std::mutex>& lock);
    void gone(const CameraId& id, const std::string& why);
    /// Forgets what is of an earlier run of the daemon.
    void begin_anew(std::int64_t pid);

    const std::shared_ptr<KeptFrames> frames_;
    mutable std::mutex mutex_; ///< of all that follows but the thread's
    bool stopping_ = false;
    ViewerId last_id_ = 0;
    std::map<ViewerId, std::unique_ptr<Viewer>> viewers_;
    std::map<CameraId, std::shared_ptr<Camera>> cameras_;
    std::map<std::int64_t, std::string> runs_; ///< DaemonRun::started by process, as seen last
    std::function<void()> look_;
    Pace bytes_;
    const double bytes_per_s_;
    const std::shared_ptr<WebFigures> figures_;
    bool shares_changed_ = true;
    Clock::time_point shared_at_{};
    FileDescriptor wake_;
    std::vector<std::uint32_t> counts_; ///< the thread's
    std::thread thread_;                ///< last, so that all else is there when it starts
};

} // namespace obscura::web
