// SPDX-License-Identifier: Apache-2.0
#include "transports/v4l2/v4l2_output.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <initializer_list>
#include <utility>

namespace obscura::transports {

namespace {

constexpr std::int64_t look_after_ns = Heartbeat::max_wait_ns; // interval of checks of an idle node
constexpr std::int64_t max_open_ns = 10 * ns_per_s;            // longest set-up time of a driver
constexpr std::int64_t last_frames_ns = 300 * ns_per_ms;       // time for queued frames in stop()
constexpr std::int32_t band_rows = 64;
constexpr std::size_t max_causes = 16; // causes remembered; further ones are logged repeatedly

void count(std::atomic<std::uint64_t>& counter, std::uint64_t n = 1) {
    counter.fetch_add(n, std::memory_order_relaxed);
}

} // namespace

V4l2Output::Wake::Wake() : fd(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (fd < 0) throw HardwareError(std::string("v4l2: no eventfd: ") + std::strerror(errno));
}

V4l2Output::Wake::~Wake() {
    ::close(fd);
}

void V4l2Output::Wake::up() const noexcept {
    const std::uint64_t one = 1;
    // The only possible failure is overflow, and then the reader is awake.
    [[maybe_unused]] const ssize_t written = ::write(fd, &one, sizeof(one));
}

void V4l2Output::Wake::wait(std::int64_t timeout_ns) const noexcept {
    pollfd wait{fd, POLLIN, 0};
    const timespec timeout{timeout_ns / ns_per_s, timeout_ns % ns_per_s};
    if (::ppoll(&wait, 1, &timeout, nullptr) > 0) {
        std::uint64_t ups = 0;
        [[maybe_unused]] const ssize_t taken = ::read(fd, &ups, sizeof(ups));
    }
}

V4l2Output::V4l2Output(V4l2Settings settings, const V4l2Context& context, V4l2Calls& calls)
    : settings_(std::move(settings)),
      context_(context),
      calls_(calls),
      announced_{context_.width, context_.height, context_.bits_per_pixel},
      queue_(settings_.queue_frames) {}

V4l2Output::~V4l2Output() {
    stop();
}

void V4l2Output::start() {
    if (thread_.joinable()) return;
    stopping_ = false;
    retry_ns_ = context_.retry_first_ns;
    reported_.clear();
    described_.clear();
    missed_ = 0;
    if (settings_.required)
        open(announced_);
    else
        try_open(announced_, std::chrono::steady_clock::now());
    thread_ = std::thread([this] { work(); });
}

void V4l2Output::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wake_.up();
    thread_.join();
    heartbeat_.rest();
    node_.reset();
}

bool V4l2Output::submit(const FrameRef& frame) noexcept {
    count(submitted_);
    if (stopping_.load(std::memory_order_relaxed) || !queue_.push(frame)) {
        count(dropped_);
        return false;
    }
    wake_.up();
    return true;
}

void V4l2Output::set_trouble(const std::string& problem) {
    const std::lock_guard lock(trouble_mutex_);
    trouble_ = problem;
}

void V4l2Output::report(const std::string& problem) {
    set_trouble(problem);
    if (std::find(reported_.begin(), reported_.end(), problem) != reported_.end()) return;
    if (reported_.size() < max_causes) reported_.push_back(problem);
    count(problems_);
    log_line(LogLevel::warning, problem, "v4l2: DEVICE: WHY");
}

void V4l2Output::retry_later(Instant now) {
    next_try_ = now + std::chrono::nanoseconds(retry_ns_);
    retry_ns_ = std::min(2 * retry_ns_, context_.retry_last_ns);
}

void V4l2Output::lose(const std::string& problem, Instant now) {
    node_.reset();
    count(lost_);
    report(problem);
    retry_later(now);
}

void V4l2Output::open(V4l2Image image) {
    node_.reset();
    heartbeat_.allow_silence_until(MonotonicClock().now() + max_open_ns);
    node_ = std::make_unique<V4l2Node>(calls_, settings_, image, context_.frame_rate_hz);
    count(opened_);
    set_trouble({});
    // Log the description only when it changes: a node that opens and then fails each time must not flood
    // the log.
    if (std::string description = node_->describe(); description != described_) {
        log_line(LogLevel::notice, description, "v4l2: DEVICE: IMAGE");
        if (!node_->warning().empty()) log_line(LogLevel::warning, node_->warning(), "v4l2: DEVICE: WHY");
        described_ = std::move(description);
    }
}

void V4l2Output::try_open(V4l2Image image, Instant now) {
    try {
        open(image);
    } catch (const HardwareError& error) {
        count(refused_);
        report(error.what());
        retry_later(now);
    }
}

void V4l2Output::delivered() {
    count(delivered_);
    count(bytes_, node_->image_bytes());
    retry_ns_ = context_.retry_first_ns;
    if (reported_.empty()) return;
    log_notice("v4l2: {}: takes images again; {} were not shown", settings_.device, missed_);
    reported_.clear();
    missed_ = 0;
}

void V4l2Output::work() {
    enter_thread(heartbeat_.name().c_str(), context_.thread);
    Instant give_up{};
    for (;;) {
        heartbeat_.beat();
        const Instant now = std::chrono::steady_clock::now();
        const FrameRef frame = queue_.front();
        if (!frame) {
            if (stopping_) return;
            if (!node_ && now >= next_try_) {
                try_open(announced_, now);
                continue;
            }
            const std::int64_t pause_ns =
                node_ ? look_after_ns
                      : std::chrono::duration_cast<std::chrono::nanoseconds>(next_try_ - now).count();
            wake_.wait(std::min(pause_ns, look_after_ns));
            if (node_ && std::chrono::steady_clock::now() - now >= std::chrono::nanoseconds(look_after_ns) &&
                !node_->alive())
                lose(node_->problem(), now);
            continue;
        }
        if (stopping_ && give_up == Instant{}) give_up = now + std::chrono::nanoseconds(last_frames_ns);
        if (stopping_ && now > give_up)
            count(dropped_);
        else
            send(*frame);
        queue_.pop();
    }
}

void V4l2Output::send(const Frame& frame) {
    const FrameInfo& info = frame.info;
    const Instant now = std::chrono::steady_clock::now();
    const V4l2Image image{info.width, info.height, info.bits_per_pixel};
    const auto drop = [this](std::atomic<std::uint64_t>& why) {
        count(why);
        count(dropped_);
        if (&why == &no_node_) ++missed_;
    };
    announced_ = image;
    if (node_ && node_->image() != image) {
        node_.reset();
        next_try_ = now;
    }
    if (!node_ && now >= next_try_) try_open(image, now);
    if (!node_) return drop(no_node_);

    V4l2Result result = node_->acquire(context_.buffer_wait_ns);
    if (result == V4l2Result::ok) {
        for (std::int32_t done = 0; done < info.height;) {
            const std::int32_t wanted = std::min(done + band_rows, info.height);
            const std::int32_t ready = frame.wait_rows(wanted, &heartbeat_);
            if (ready < wanted) return drop(partial_);
            node_->fill(frame, done, ready);
            done = ready;
        }
        if ((frame.flags.load(std::memory_order_relaxed) & frame_dropped) != 0) return drop(partial_);
        info.note_transmit(transmit_slot(), MonotonicClock().now());
        result = node_->send(info.frame_id, info.trigger_edge, context_.buffer_wait_ns);
        info.note_transmit(transmit_slot(), MonotonicClock().now());
    }
    switch (result) {
    case V4l2Result::ok:
        return delivered();
    case V4l2Result::busy:
        return drop(busy_);
    case V4l2Result::lost:
        lose(node_->problem(), now);
        return drop(no_node_);
    case V4l2Result::out_of_order:
        settings_.io = V4l2Io::write;
        lose(fmt::format("v4l2: {}: the driver gives buffers back out of order; going on with write()",
                         settings_.device),
             now);
        next_try_ = now;
        return drop(no_node_);
    }
}

TransportCounters V4l2Output::counters() const noexcept {
    return {submitted_.load(std::memory_order_relaxed), delivered_.load(std::memory_order_relaxed),
            dropped_.load(std::memory_order_relaxed), bytes_.load(std::memory_order_relaxed)};
}

TransportStatistics V4l2Output::statistics() const {
    TransportStatistics s = Transport::statistics();
    const V4l2Counters c = v4l2_counters();
    for (const auto& [name, value] :
         std::initializer_list<std::pair<const char*, std::uint64_t>>{{"node_opened", c.opened},
                                                                      {"node_lost", c.lost},
                                                                      {"node_refused", c.refused},
                                                                      {"no_node", c.no_node},
                                                                      {"busy", c.busy},
                                                                      {"partial", c.partial}})
        s.values.push_back({name, value});
    const std::lock_guard lock(trouble_mutex_);
    s.texts = {{"node", settings_.device}, {"trouble", trouble_}};
    return s;
}

V4l2Counters V4l2Output::v4l2_counters() const noexcept {
    const auto get = [](const std::atomic<std::uint64_t>& c) { return c.load(std::memory_order_relaxed); };
    return {get(opened_),  get(lost_), get(refused_), get(problems_),
            get(no_node_), get(busy_), get(partial_)};
}

} // namespace obscura::transports
