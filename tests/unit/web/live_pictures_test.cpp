// SPDX-License-Identifier: Apache-2.0
// Live pictures from the ring of a camera in this process: whole frames, credit, and viewers that come and
// go.
#include "core/clock.hpp"
#include "emulator/control/ring_calls.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fake_daemon.hpp"
#include "tests/support/plain_frame.hpp"
#include "tests/support/temp_folder.hpp"
#include "transports/watch/watch.hpp"
#include "web/live/live_pictures.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <filesystem>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace live_pictures_test {

using namespace obscura;
using namespace obscura::web;
using namespace std::chrono_literals;

namespace {

constexpr auto timeout = 60s;
constexpr std::int32_t width = 37, height = 23; // no multiples of anything

/// Number of each pixel of a frame.
std::uint16_t dn_of(std::uint64_t frame_id) {
    return static_cast<std::uint16_t>(frame_id % 65521);
}

struct After {
    std::uint64_t after = 0;

    service::Fields fields() { return {{config::key("after", &after)}}; }
};

/// A camera that makes frames without end, each of one number, and the daemon that hands them over.
class RingBench {
public:
    RingBench() : daemon_(folder_.path() / "one.socket", [this] { return calls(); }) {
        start();
        camera_ = std::thread([this] { make_frames(); });
        pictures_.when_wanted([this] { daemons_->look_soon(); });
        daemons_.emplace(daemon_.path(), 20ms, &pictures_);
    }
    ~RingBench() {
        daemons_.reset();
        stop_ = true;
        camera_.join();
        watches_.back()->stop();
    }
    RingBench(const RingBench&) = delete;
    RingBench& operator=(const RingBench&) = delete;

    /// Another run of the daemon, whose process has the same number.
    void start() {
        const std::lock_guard lock(mutex_);
        if (!watches_.empty()) watches_.back()->stop();
        watches_.push_back(std::make_unique<transports::WatchTransport>(width * height, [] {}));
        watches_.back()->start();
    }

    [[nodiscard]] LivePictures& pictures() { return pictures_; }
    [[nodiscard]] KeptFrames& frames() { return *frames_; }
    [[nodiscard]] static CameraId camera() { return {::getpid(), 0}; }

private:
    service::Calls calls() {
        using service::Answer, service::Permission, service::Work;
        const std::lock_guard lock(mutex_);
        transports::WatchTransport* const watch = watches_.empty() ? nullptr : watches_.back().get();
        service::Calls all = emulator::ring_calls({watch}, [this, watch](std::size_t /*camera*/) {
            const std::lock_guard handing(mutex_);
            return emulator::hand_over_ring(*watch);
        });
        all.push_back(service::call<service::NoArguments>(
            "state", Permission::view, "",
            [run = watches_.size()](const service::NoArguments&, Work& /*work*/) {
                return Answer{{{"daemon", {{"pid", ::getpid()}, {"started_utc_ns", std::to_string(run)}}},
                               {"cameras", {nlohmann::json::object()}}}};
            }));
        all.push_back(
            service::call<After>("events", Permission::view, "", [](const After& /*after*/, Work& /*work*/) {
                return Answer{{{"events", nlohmann::json::array()}}};
            }));
        return all;
    }
    void make_frames() {
        for (std::uint64_t id = 1; !stop_; ++id) {
            if (const FrameRef frame = pool_.acquire()) {
                test::describe_mono16(frame->info, id, width, height);
                frame->info.seen = MonotonicClock().now();
                std::fill(frame->pixels().begin(), frame->pixels().end(), dn_of(id));
                frame->publish_rows(height);
                const std::lock_guard lock(mutex_);
                watches_.back()->submit(frame);
            }
            std::this_thread::sleep_for(200us);
        }
    }

    const test::TempFolder folder_;
    std::atomic<bool> stop_{false};
    FramePool pool_{8, width* height, height};
    std::mutex mutex_;                                                 ///< of what follows
    std::vector<std::unique_ptr<transports::WatchTransport>> watches_; ///< of each run
    test::FakeDaemon daemon_;
    std::thread camera_;
    const std::shared_ptr<KeptFrames> frames_ = std::make_shared<KeptFrames>();
    LivePictures pictures_{live_bytes_per_s, std::make_shared<WebFigures>(), frames_};
    std::optional<DaemonWatch> daemons_;
};

/// A viewer that takes what it is given.
class TestViewer {
public:
    explicit TestViewer(LivePictures& pictures)
        : pictures_(pictures), id_(pictures.join([inbox = inbox_](LiveDelivery delivery) {
              const std::lock_guard lock(inbox->mutex);
              inbox->waiting.push_back(std::move(delivery));
              inbox->changed.notify_all();
          })) {}
    ~TestViewer() { pictures_.leave(id_); }
    TestViewer(const TestViewer&) = delete;
    TestViewer& operator=(const TestViewer&) = delete;

    void view(const CameraId& camera, double max_hz = 60) { pictures_.view(id_, {camera, {}, max_hz}); }
    void ready() { pictures_.ready(id_); }
    /// The next picture; none: it did not come in time.
    std::optional<LiveDelivery> picture(std::chrono::milliseconds longest = timeout) {
        return next(longest, [](const LiveDelivery& one) { return one.pixels != nullptr; });
    }
    /// The next text that begins so.
    std::optional<LiveDelivery> text(std::string_view begin) {
        return next(timeout, [begin](const LiveDelivery& one) { return one.text.starts_with(begin); });
    }

private:
    struct Inbox {
        std::mutex mutex;
        std::condition_variable changed;
        std::deque<LiveDelivery> waiting;
    };

    template<typename Fits>
    std::optional<LiveDelivery> next(std::chrono::milliseconds longest, Fits fits) {
        std::unique_lock lock(inbox_->mutex);
        std::deque<LiveDelivery>& waiting = inbox_->waiting;
        const auto find = [&] { return std::find_if(waiting.begin(), waiting.end(), fits); };
        if (!inbox_->changed.wait_for(lock, longest, [&] { return find() != waiting.end(); }))
            return std::nullopt;
        const auto found = find();
        std::optional<LiveDelivery> one(std::move(*found));
        waiting.erase(found);
        return one;
    }

    const std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
    LivePictures& pictures_;
    const LivePictures::ViewerId id_;
};

std::uint64_t frame_of(const LiveDelivery& picture) {
    std::uint64_t id = 0;
    for (std::size_t i = 8; i-- > 0;)
        id = id << 8 | picture.header[16 + i];
    return id;
}

std::ptrdiff_t open_files() {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
}

} // namespace

TEST_CASE("a picture is of one frame while others are written, and each is newer", "[web]") {
    RingBench bench;
    TestViewer viewer(bench.pictures());
    viewer.view(bench.camera());
    std::uint64_t last = 0;
    for (int i = 0; i < 60; ++i) {
        const auto picture = viewer.picture();
        REQUIRE(picture);
        const std::uint64_t id = frame_of(*picture);
        REQUIRE(id > last);
        last = id;
        REQUIRE(picture->pixels->size() == std::size_t{width * height});
        REQUIRE(std::all_of(picture->pixels->begin(), picture->pixels->end(),
                            [id](std::uint16_t dn) { return dn == dn_of(id); }));
        viewer.ready();
    }
    const auto histogram = viewer.text(R"({"histogram")");
    REQUIRE(histogram);
}

TEST_CASE("viewers go on with another run of a daemon whose process has the same number", "[web]") {
    RingBench bench;
    TestViewer viewer(bench.pictures());
    viewer.view(bench.camera());
    for (int run = 0; run < 2; ++run) {
        for (int i = 0; i < 20; ++i) {
            const auto picture = viewer.picture();
            REQUIRE(picture);
            std::uint64_t number = 0;
            std::memcpy(&number, picture->header.data() + 64, sizeof number);
            // What is kept under that number is this frame, not that of the run before.
            const auto kept = bench.frames().find(bench.camera(), number);
            if (kept) CHECK(kept->pixels.front() == dn_of(frame_of(*picture)));
            viewer.ready();
        }
        bench.start();
    }
}

TEST_CASE("a viewer that is not ready gets no further picture", "[web]") {
    RingBench bench;
    TestViewer viewer(bench.pictures());
    viewer.view(bench.camera());
    REQUIRE(viewer.picture());
    CHECK_FALSE(viewer.picture(300ms));
    viewer.ready();
    CHECK(viewer.picture());
}

TEST_CASE("a camera that is not there is told of", "[web]") {
    RingBench bench;
    TestViewer viewer(bench.pictures());
    viewer.view({bench.camera().pid, 5});
    CHECK(viewer.text(R"({"gone")"));
    viewer.view({1, 0});
    CHECK(viewer.text(R"({"gone")"));
    viewer.view(bench.camera());
    CHECK(viewer.picture());
}

TEST_CASE("viewers that come and go leave no files and no threads behind", "[web]") {
    RingBench bench;
    const auto visit = [&bench] {
        TestViewer first(bench.pictures()), second(bench.pictures());
        first.view(bench.camera());
        second.view(bench.camera(), 5);
        second.view({bench.camera().pid, 3});
        CHECK(first.picture());
    };
    const auto rest = [&bench] {
        while (bench.pictures().cameras() > 0)
            std::this_thread::sleep_for(5ms);
    };
    const auto threads = [] {
        return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {});
    };
    // The ring keeps the events of the readers that it has been handed to last.
    for (std::size_t i = 0; i < transports::FrameRing::max_reported + 1; ++i)
        visit(), rest();
    const auto files = open_files(), count = threads();
    for (int i = 0; i < 12; ++i)
        visit(), rest();
    // A look at the daemons holds some of its own, and the daemon has a thread for it.
    const auto end = std::chrono::steady_clock::now() + timeout;
    while ((open_files() > files || threads() > count) && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(5ms);
    CHECK(open_files() <= files);
    CHECK(threads() <= count);
}

} // namespace live_pictures_test
