// SPDX-License-Identifier: Apache-2.0
#include "web/live/live_pictures.hpp"

#include "core/error.hpp"
#include "web/live/jpeg.hpp"
#include "web/live/live_viewers.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

namespace obscura::web {
namespace {

using namespace std::chrono_literals;
using transports::RingFrame;

/// A viewer that got a picture within this time is expected to ask for the next.
constexpr auto expected = 1s;
/// Viewers that have neither asked nor got anything for so long take no share of the budget.
constexpr auto active = 3s;
constexpr auto share_period = 500ms;
constexpr auto histogram_period = 500ms;
/// Rings are looked at so often, should an event get lost.
constexpr auto max_wait = 250ms;
constexpr double seconds_at_once = 0.5; ///< of the budget

FileDescriptor new_wake() {
    FileDescriptor event(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (!event) throw HardwareError(std::string("eventfd: ") + std::strerror(errno));
    return event;
}

void drain(int event) {
    std::uint64_t news = 0;
    while (::read(event, &news, sizeof news) < 0 && errno == EINTR)
        continue;
}

/// Pictures at that rate between two that are `span` apart. A hidden page, which asks for none, counts for a
/// while only.
std::uint64_t wanted_between(double hz, std::chrono::steady_clock::duration span) {
    const double seconds =
        std::chrono::duration<double>(std::min<std::chrono::steady_clock::duration>(span, active)).count();
    return static_cast<std::uint64_t>(std::max(0LL, std::llround(hz * seconds) - 1));
}

bool is_shown(const transports::FrameRingHeader& frame) {
    return frame.width > 0 && frame.height > 0 && frame.width <= View::max_side &&
           frame.height <= View::max_side;
}

} // namespace

LivePictures::LivePictures(double bytes_per_s, std::shared_ptr<WebFigures> figures,
                           std::shared_ptr<KeptFrames> frames)
    : frames_(std::move(frames)),
      bytes_(bytes_per_s * seconds_at_once),
      bytes_per_s_(bytes_per_s),
      figures_(std::move(figures)),
      wake_(new_wake()),
      thread_([this] { work(); }) {
    const std::lock_guard lock(mutex_);
    bytes_.set_rate(bytes_per_s, Clock::now());
}

LivePictures::~LivePictures() {
    stop();
}

void LivePictures::stop() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
        look_ = nullptr;
    }
    wake();
    if (thread_.joinable()) thread_.join();
}

void LivePictures::wake() {
    constexpr std::uint64_t one = 1;
    while (::write(wake_.get(), &one, sizeof one) < 0 && errno == EINTR)
        continue;
}

LivePictures::ViewerId LivePictures::join(Deliver deliver) {
    const std::lock_guard lock(mutex_);
    viewers_.emplace(++last_id_, std::make_unique<Viewer>(Viewer{std::move(deliver)}));
    figures_->viewer_joined();
    return last_id_;
}

void LivePictures::leave(ViewerId viewer) {
    const std::lock_guard lock(mutex_);
    if (viewers_.erase(viewer) > 0) figures_->viewer_left();
    frames_->left(viewer);
    shares_changed_ = true;
}

void LivePictures::view(ViewerId id, const ViewRequest& request) {
    std::unique_lock lock(mutex_);
    const auto found = viewers_.find(id);
    if (found == viewers_.end()) return;
    Viewer& viewer = *found->second;
    if (!viewer.request || viewer.request->camera != request.camera) {
        viewer.last_serial = viewer.last_number = viewer.histogram_of = 0;
        viewer.histogram_at = {};
    }
    const std::optional<ViewRequest> before = std::exchange(viewer.request, request);
    viewer.changed = true;
    shares_changed_ = true;
    auto& camera = cameras_[request.camera];
    if (!camera) camera = std::make_shared<Camera>();
    // A viewer may name cameras that are not there faster than the daemons are looked at.
    if (before && !is_seen(before->camera))
        if (const auto left = cameras_.find(before->camera); left != cameras_.end() && !left->second->ring)
            cameras_.erase(left);
    look_if_wanted(viewer, lock);
}

void LivePictures::ready(ViewerId id) {
    std::unique_lock lock(mutex_);
    const auto found = viewers_.find(id);
    if (found == viewers_.end() || found->second->ready) return;
    found->second->ready = true;
    // A viewer that was inactive had no share, and keeps the rate of one before.
    if (Clock::now() - found->second->sent_at > active) shares_changed_ = true;
    look_if_wanted(*found->second, lock);
}

void LivePictures::look_if_wanted(Viewer& viewer, std::unique_lock<std::mutex>& lock) {
    const auto now = Clock::now();
    std::function<void()> look;
    if (viewer.request && viewer.ready) {
        const auto camera = cameras_.find(viewer.request->camera);
        if (camera != cameras_.end() &&
            (!camera->second->asked || now - *camera->second->asked > frames_watched))
            look = look_;
    }
    lock.unlock();
    wake();
    if (look) look();
}

void LivePictures::when_wanted(std::function<void()> look) {
    const std::lock_guard lock(mutex_);
    look_ = std::move(look);
}

bool LivePictures::waits(const Viewer& viewer) const {
    return viewer.request && (viewer.ready || Clock::now() - viewer.sent_at < expected);
}

bool LivePictures::is_seen(const CameraId& camera) const {
    return std::any_of(viewers_.begin(), viewers_.end(), [&camera](const auto& viewer) {
        return viewer.second->request && viewer.second->request->camera == camera;
    });
}

std::size_t LivePictures::cameras() const {
    const std::lock_guard lock(mutex_);
    return cameras_.size();
}

void LivePictures::work() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
        const auto now = Clock::now();
        auto next = now + max_wait;
        std::vector<Due> pictures = due(now, next);
        if (pictures.empty())
            wait(lock, next);
        else
            serve(pictures, lock);
    }
}

void LivePictures::wait(std::unique_lock<std::mutex>& lock, Clock::time_point until) {
    std::vector<std::shared_ptr<Camera>> cameras;
    std::vector<pollfd> polled{{wake_.get(), POLLIN, 0}};
    bool wanted = false;
    for (const auto& [id, camera] : cameras_) {
        if (!camera->ring) continue;
        cameras.push_back(camera);
        polled.push_back({camera->news.get(), POLLIN, 0});
    }
    for (const auto& [id, viewer] : viewers_)
        wanted = wanted || (viewer->request && viewer->ready);
    lock.unlock();
    timespec rest{};
    const auto span = std::max(Clock::duration::zero(), until - Clock::now());
    rest.tv_sec = std::chrono::duration_cast<std::chrono::seconds>(span).count();
    rest.tv_nsec = (span % 1s).count();
    // Without a viewer that waits for a picture this does not wait for frames either.
    ::ppoll(polled.data(), wanted ? polled.size() : 1, wanted ? &rest : nullptr, nullptr);
    drain(wake_.get());
    for (const auto& camera : cameras)
        drain(camera->news.get());
    lock.lock();
}

void LivePictures::share(Clock::time_point now) {
    std::vector<Wish> wishes;
    std::vector<Viewer*> of;
    for (auto& [id, one] : viewers_) {
        Viewer& viewer = *one;
        const bool idle = !viewer.ready && now - viewer.sent_at > active;
        if (!viewer.request || idle) continue;
        const auto camera = cameras_.find(viewer.request->camera);
        if (camera == cameras_.end() || camera->second->width == 0) continue;
        of.push_back(&viewer);
        View view = clipped(viewer.request->view, camera->second->width, camera->second->height);
        const PictureEncoding encoding = viewer.request->encoding;
        const std::size_t side = viewer.request->max_side != 0 ? viewer.request->max_side : max_jpeg_side;
        if (encoding != PictureEncoding::u16)
            while (std::max(view.columns(), view.rows()) > side && view.bin < View::max_bin)
                view.bin *= 2;
        wishes.push_back({view, viewer.request->max_hz, encoding, viewer.jpeg_share});
    }
    const std::vector<Share> shares = shared_out(wishes, bytes_per_s_);
    for (std::size_t i = 0; i < of.size(); ++i) {
        of[i]->view = shares[i].view;
        of[i]->jpeg = shares[i].jpeg;
        if (of[i]->hz != shares[i].hz) of[i]->pace.set_rate(shares[i].hz, now);
        of[i]->hz = shares[i].hz;
    }
    shared_at_ = now;
    shares_changed_ = false;
}

std::vector<LivePictures::Due> LivePictures::due(Clock::time_point now, Clock::time_point& next) {
    for (const auto& [id, camera] : cameras_) {
        if (!camera->ring || camera->ring->newest() <= camera->oldest) continue;
        const std::optional<RingFrame> frame = camera->ring->read();
        if (!frame) continue;
        const bool shown = is_shown(frame->header);
        const std::uint32_t width = shown ? frame->header.width : 0,
                            height = shown ? frame->header.height : 0;
        shares_changed_ = shares_changed_ || width != camera->width || height != camera->height;
        camera->width = width;
        camera->height = height;
    }
    if (shares_changed_ || now - shared_at_ > share_period) share(now);
    std::vector<Due> list;
    for (const auto& [id, seen] : viewers_) {
        const Viewer& viewer = *seen;
        if (!viewer.request || !viewer.ready || viewer.hz == 0) continue;
        const auto camera = cameras_.find(viewer.request->camera);
        if (camera == cameras_.end() || !camera->second->ring || camera->second->width == 0) continue;
        const std::uint64_t newest = camera->second->ring->newest();
        const bool has_picture = newest <= viewer.last_serial && !viewer.changed;
        if (newest <= camera->second->oldest ||
            (has_picture && (!viewer.request->histogram || newest <= viewer.histogram_of)))
            continue;
        auto at = std::max(viewer.pace.time_of(1, now), bytes_.time_of(1, now));
        if (has_picture) {
            at = viewer.histogram_at + histogram_period;
            if (newest > camera->second->histogram_of)
                at = std::max(at, camera->second->histogram_at + histogram_period);
        }
        if (at > now) {
            next = std::min(next, at);
            continue;
        }
        Due one{!has_picture, id, camera->second, viewer.request->camera, viewer.view, viewer.jpeg};
        one.flags = (viewer.hz < viewer.request->max_hz ? picture_rate_lowered : 0U) |
                    (viewer.view.bin > viewer.request->view.bin ? picture_view_lowered : 0U);
        one.last_number = viewer.last_number;
        one.histogram = viewer.request->histogram && now - viewer.histogram_at >= histogram_period;
        one.histogram_of = viewer.histogram_of;
        one.deliver = viewer.deliver;
        one.sent_at = viewer.sent_at;
        list.push_back(std::move(one));
    }
    // The viewer that has waited longest is first when the budget does not reach for all.
    std::sort(list.begin(), list.end(), [](const Due& a, const Due& b) { return a.sent_at < b.sent_at; });
    return list;
}

void LivePictures::serve(std::vector<Due>& due, std::unique_lock<std::mutex>& lock) {
    for (Due& one : due) {
        const auto now = Clock::now();
        if (stopping_ || bytes_.time_of(1, now) > now) return;
        Camera& camera = *one.camera;
        const transports::FrameRingReader& ring = *camera.ring; // once there it stays as long as the camera
        lock.unlock();
        const std::optional<RingFrame> frame = ring.read();
        bool whole = frame && is_shown(frame->header);
        MadePicture made;
        std::shared_ptr<const KeptFrame> kept;
        if (whole) {
            const transports::FrameRingHeader& header = frame->header;
            if (one.picture)
                made = camera.made.picture(*frame, clipped(one.view, header.width, header.height), one.jpeg);
            if (one.histogram && now - camera.histogram_at >= histogram_period) {
                camera.histogram = histogram_text(
                    header.frame_id, histogram_of(frame->pixels, std::clamp(header.bits, 8U, 16U), counts_));
                camera.histogram_of = frame->serial;
                camera.histogram_at = now;
            }
            if (one.picture && !frames_->find(one.id, header.number)) kept = kept_frame(one.id, *frame);
            whole = ring.intact(*frame);
            if (!whole) { // overwritten meanwhile: the next turn takes a newer one
                camera.made.clear();
                camera.histogram_at = {};
                camera.histogram_of = 0;
            }
        }
        const std::string histogram = whole && one.histogram && camera.histogram_of > one.histogram_of
                                          ? camera.histogram
                                          : std::string();
        lock.lock();
        const auto now_there = cameras_.find(one.id);
        if (now_there == cameras_.end() || now_there->second != one.camera) continue; // of an earlier run
        if (whole && kept) frames_->keep(std::move(kept));
        const auto found = viewers_.find(one.viewer);
        if (!whole || found == viewers_.end()) continue;
        Viewer& viewer = *found->second;
        if (!viewer.request || viewer.request->camera != one.id) continue;
        if (one.picture) {
            viewer.ready = viewer.changed = false;
            viewer.last_serial = frame->serial;
            const std::uint64_t number = frame->header.number;
            const std::uint64_t skipped =
                one.last_number > 0 && number > one.last_number ? number - one.last_number - 1 : 0;
            viewer.last_number = number;
            figures_->pictured(
                std::min(skipped, wanted_between(viewer.request->max_hz, now - viewer.sent_at)));
            viewer.sent_at = now;
            viewer.pace.take(1, now);
            frames_->shown(one.viewer, one.id, number);
            const std::chrono::nanoseconds made_at = now.time_since_epoch();
            bytes_.take(static_cast<double>(picture_header_bytes +
                                            (made.jpeg ? made.jpeg->size() : 2 * made.pixels->size())),
                        now);
            // Some more than this one: the next may need it.
            if (made.jpeg)
                viewer.jpeg_share =
                    1.25 * static_cast<double>(made.jpeg->size()) / static_cast<double>(made.view.bytes());
            LiveDelivery picture;
            picture.header =
                picture_header(one.id.number, frame->header, made.view, one.flags,
                               static_cast<std::uint32_t>(std::min<std::uint64_t>(skipped, UINT32_MAX)),
                               camera.tai_offset_ns != 0 ? made_at.count() + camera.tai_offset_ns : 0);
            picture.header[51] = made.jpeg ? 1 : 0;
            picture.pixels = std::move(made.pixels);
            picture.jpeg = std::move(made.jpeg);
            one.deliver(std::move(picture));
        }
        if (histogram.empty()) continue;
        viewer.histogram_of = camera.histogram_of;
        viewer.histogram_at = now;
        one.deliver({histogram, {}, nullptr});
    }
}

} // namespace obscura::web
