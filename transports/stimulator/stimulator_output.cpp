// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/stimulator_output.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"

#include <fmt/format.h>
#include <lz4.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <cstring>

namespace obscura::transports {
namespace {

constexpr std::int32_t band_rows = 64;
constexpr std::int64_t check_interval_ns = 250 * ns_per_ms; // interval of status requests to an idle device
constexpr std::int64_t complaint_interval_ns = 60 * ns_per_s;
constexpr int stalls_allowed = 3;
constexpr std::size_t least_to_compress = 256; // bytes; the request costs more than fewer data
constexpr int stop_patience_ms = 200;
// Longest blocking calls announced to the watchdog: a request, and finding the device and computing its
// tables.
constexpr std::int64_t longest_request_ns = 10 * ns_per_s;
constexpr std::int64_t longest_connect_ns = 60 * ns_per_s;

Time now() {
    return MonotonicClock().now();
}

/// Smallest rectangle inside `rect` that holds all differences of two screens; width 0 if they are equal.
Region changed_part(const Region& rect, std::size_t stride, std::size_t pixel, const std::uint8_t* a,
                    const std::uint8_t* b) {
    const auto left = static_cast<std::size_t>(rect.x) * pixel;
    const auto size = static_cast<std::size_t>(rect.width) * pixel;
    const auto same_row = [&](std::int32_t y) {
        const std::size_t at = static_cast<std::size_t>(y) * stride + left;
        return std::memcmp(a + at, b + at, size) == 0;
    };
    std::int32_t top = rect.y, bottom = rect.y + rect.height;
    while (top < bottom && same_row(top))
        ++top;
    while (bottom > top && same_row(bottom - 1))
        --bottom;
    if (top == bottom) return {};
    std::size_t first = size, last = 0;
    for (std::int32_t y = top; y < bottom; ++y) {
        const std::uint8_t* ra = a + static_cast<std::size_t>(y) * stride + left;
        const std::uint8_t* rb = b + static_cast<std::size_t>(y) * stride + left;
        std::size_t i = 0;
        while (i < first && ra[i] == rb[i])
            ++i;
        first = std::min(first, i);
        std::size_t j = size;
        while (j > last && ra[j - 1] == rb[j - 1])
            --j;
        last = std::max(last, j);
    }
    const auto x0 = static_cast<std::int32_t>(first / pixel);
    const auto x1 = static_cast<std::int32_t>((last + pixel - 1) / pixel);
    return {rect.x + x0, top, x1 - x0, bottom - top};
}

} // namespace

struct StimulatorOutput::Session {
    std::unique_ptr<UsbDevice> device;
    std::unique_ptr<DisplayLink> link;
    OpticalStage* stage = nullptr;
    std::string name;
    std::vector<std::uint16_t> levels;     // drive levels of the full screen
    std::vector<std::uint8_t> next, shown; // packed screens: to show next, and as the device has it
    bool shown_known = false;              // `shown` equals the content of the device
    std::array<Lane, UsbDevice::slots> lanes;
    std::size_t turn = 0;
    bool over = false;
    int stalls = 0;
    bool idled = true;                    // the queue was empty before this frame
    std::uint64_t frame = 0;              // running number of the current frame
    TransmitTimestamps* stamps = nullptr; // time stamps of the current frame
    std::uint64_t bad_frame = 0;          // running number of the last frame that lost an update
    bool counted_late = false;
    std::int32_t copied_rows = 0;
    Time checked;
    double bytes_per_ns = 0; // measured throughput of the link
    std::uint32_t compress_rest = 0, compress_pause = 1;
    // Windows of the last frame and their regions on the screen.
    std::vector<Region> windows, places;
    // For the warnings about refresh.
    Time last_edge;
    ShutterTiming shutter;
    int same_shutter = 0;

    [[nodiscard]] Region screen() const { return {0, 0, link->width(), link->height()}; }
};

StimulatorOutput::StimulatorOutput(StimulatorSettings settings, const StimulatorContext& context,
                                   std::unique_ptr<UsbBus> bus)
    : settings_(std::move(settings)),
      context_(context),
      bus_(std::move(bus)),
      queue_(settings_.queue_frames) {
    assert(bus_ != nullptr);
}

StimulatorOutput::~StimulatorOutput() {
    stop();
}

void StimulatorOutput::start() {
    if (thread_.joinable()) return;
    stage_.reset();
    table_.reset();
    if (!settings_.calibration.empty()) table_ = read_calibration(settings_.calibration);
    canvas_.assign(static_cast<std::size_t>(context_.sensor.width) *
                       static_cast<std::size_t>(context_.sensor.height),
                   0);
    stopping_ = false;
    thread_ = std::thread([this] { work(); });
}

void StimulatorOutput::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wake_.release();
    thread_.join();
    heartbeat_.rest();
}

bool StimulatorOutput::submit(const FrameRef& frame) noexcept {
    submitted_.fetch_add(1, std::memory_order_relaxed);
    if (!connected_.load(std::memory_order_acquire) || stopping_.load(std::memory_order_relaxed) ||
        !queue_.push(frame)) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    wake_.release();
    return true;
}

FrameRef StimulatorOutput::take() {
    FrameRef frame = queue_.front();
    if (frame) queue_.pop();
    return frame;
}

void StimulatorOutput::drop_queue() {
    while (take())
        dropped_.fetch_add(1, std::memory_order_relaxed);
}

void StimulatorOutput::complain(const std::string& line) {
    const Time at = now();
    if (line == last_complaint_ && at - last_complaint_at_ < complaint_interval_ns) return;
    last_complaint_ = line;
    last_complaint_at_ = at;
    log_line(LogLevel::warning, line, "stimulator DEVICE: WHY");
}

void StimulatorOutput::work() {
    enter_thread(heartbeat_.name().c_str(), context_.thread);
    while (!stopping_) {
        std::unique_ptr<Session> session;
        try {
            heartbeat_.allow_silence_until(now() + longest_connect_ns);
            session = connect();
        } catch (const std::exception& error) {
            complain(error.what());
        }
        if (session) {
            connects_.fetch_add(1, std::memory_order_relaxed);
            connected_.store(true, std::memory_order_release);
            serve(*session);
            connected_.store(false, std::memory_order_release);
        }
        drop_queue();
        const Time again = now() + (absent_ ? context_.look_ns : context_.reconnect_ns);
        while (!stopping_ && now() < again) {
            heartbeat_.beat();
            (void)wake_.try_acquire_for(std::chrono::nanoseconds(again - now()));
            drop_queue();
        }
    }
    drop_queue();
}

std::unique_ptr<StimulatorOutput::Session> StimulatorOutput::connect() {
    const std::vector<UsbIdentity> found = bus_->list(static_cast<std::uint16_t>(settings_.vendor_id),
                                                      static_cast<std::uint16_t>(settings_.product_id));
    const UsbIdentity* chosen = nullptr;
    std::string others;
    for (const UsbIdentity& identity : found) {
        if (settings_.serial.empty() || identity.serial == settings_.serial) {
            chosen = &identity;
            break;
        }
        others += fmt::format("{}{}", others.empty() ? "" : ", ",
                              identity.serial.empty()
                                  ? "(" + (identity.problem.empty() ? "none" : identity.problem) + ")"
                                  : identity.serial);
    }
    const std::string wanted = fmt::format("{:04x}:{:04x}{}{}", settings_.vendor_id, settings_.product_id,
                                           settings_.serial.empty() ? "" : " serial ", settings_.serial);
    absent_ = chosen == nullptr;
    if (absent_)
        throw HardwareError(
            others.empty()
                ? fmt::format("stimulator {}: not plugged in, waiting for it", wanted)
                : fmt::format("stimulator {}: not plugged in, waiting for it; there are serials {}", wanted,
                              others));
    auto session = std::make_unique<Session>();
    session->device = bus_->open(*chosen);
    session->link = std::make_unique<DisplayLink>(
        *session->device,
        DisplayWish{settings_.width, settings_.height, settings_.refresh_hz, gud_format(settings_.format)});
    session->name = session->device->description();
    const DisplayLink& link = *session->link;

    OpticalSettings optical;
    optical.screen_width = link.width();
    optical.screen_height = link.height();
    optical.sensor_width = context_.sensor.width;
    optical.sensor_height = context_.sensor.height;
    optical.levels = grey_levels(link.format(), settings_.grey);
    if (optical.levels == 0)
        throw HardwareError(fmt::format("stimulator {}: its format {} supports no grey coding but 'equal'",
                                        session->name, gud::to_string(link.format())));
    optical.dn_black = settings_.black_dn;
    optical.dn_white = white_level_dn(settings_, context_.sensor.adc_bits);
    optical.peak = settings_.peak;
    optical.dither = settings_.dither;
    // Keep the optical stage if the mode is unchanged: its tables take long to compute.
    if (!stage_ || !(stage_->settings() == optical))
        stage_ = std::make_unique<OpticalStage>(optical, table_ ? &*table_ : nullptr);
    session->stage = stage_.get();

    session->levels.assign(static_cast<std::size_t>(link.width()) * static_cast<std::size_t>(link.height()),
                           0);
    session->next.assign(link.frame_bytes(), 0);
    session->shown.assign(link.frame_bytes(), 0);
    for (Lane& lane : session->lanes) {
        lane.plain.reserve(link.frame_bytes());
        lane.packed.reserve(link.frame_bytes());
    }
    session->windows.reserve(max_windows);
    session->places.reserve(max_windows);
    session->checked = now();
    has_frame_status_ = link.has_frame_status();
    log_notice("stimulator {}: {}x{} at {:.1f} Hz, {} with {} levels{}{}{}", session->name, link.width(),
               link.height(), link.mode().refresh_hz(), gud::to_string(link.format()), optical.levels,
               link.takes_lz4() ? ", LZ4" : "", link.whole_frames_only() ? ", whole frames" : "",
               link.has_frame_status() ? ", frame status" : "");
    return session;
}

void StimulatorOutput::serve(Session& s) {
    while (!stopping_ && !s.over) {
        heartbeat_.beat();
        for (std::size_t slot = 0; slot < s.lanes.size(); ++slot)
            finish(s, slot, 0);
        if (now() - s.checked > (s.idled ? check_interval_ns : 4 * check_interval_ns)) check(s);
        if (s.over) break;
        if (const FrameRef frame = take()) {
            show(s, *frame);
            s.idled = false;
            continue;
        }
        const auto busy = std::find_if(s.lanes.begin(), s.lanes.end(), [](const Lane& l) { return l.busy; });
        if (busy != s.lanes.end()) {
            // Wait in short steps, because a new frame does not end this wait.
            finish(s, static_cast<std::size_t>(busy - s.lanes.begin()), 1);
            continue;
        }
        s.idled = true;
        (void)wake_.try_acquire_for(std::chrono::milliseconds(100));
    }
    // Wait briefly for busy lanes if the daemon stops, not at all if the device is gone.
    for (std::size_t slot = 0; slot < s.lanes.size(); ++slot) {
        Lane& lane = s.lanes[slot];
        if (!lane.busy) continue;
        UsbResult result = s.device->wait(slot, s.over ? 0 : stop_patience_ms);
        if (result.status == UsbStatus::pending) {
            s.device->cancel(slot);
            result = s.device->wait(slot, 0);
            if (result.status == UsbStatus::pending) result.status = UsbStatus::timeout;
        }
        account(s, lane, result);
    }
    if (!s.over) s.link->turn_off();
}

void StimulatorOutput::check(Session& s) {
    s.checked = now();
    heartbeat_.allow_silence_until(s.checked + longest_request_ns);
    if (s.link->has_frame_status()) {
        const Time before = now();
        const auto status = s.link->frame_status();
        const Time after = now();
        if (status) {
            const std::int64_t offset_ns =
                midpoint(before, after).ns - static_cast<std::int64_t>(status->now_ns);
            device_shown_.store(status->shown, std::memory_order_relaxed);
            device_errors_.store(status->errors, std::memory_order_relaxed);
            last_shown_ns_.store(static_cast<std::int64_t>(status->last_shown_ns) + offset_ns,
                                 std::memory_order_relaxed);
            return;
        }
        has_frame_status_ = false;
    }
    if (!s.link->alive()) {
        complain(fmt::format("stimulator {}: does not answer any more, looking for it again", s.name));
        s.over = true;
    }
}

void StimulatorOutput::fail(Session& s, UsbStatus status) {
    failed_.fetch_add(1, std::memory_order_relaxed);
    s.bad_frame = s.frame;
    s.shown_known = false;
    if (status == UsbStatus::stall && ++s.stalls <= stalls_allowed) {
        complain(fmt::format("stimulator {}: refused {}", s.name,
                             s.link->last_refusal().empty() ? "an update" : s.link->last_refusal()));
        s.link->resynchronise();
        return;
    }
    if (!stopping_)
        complain(fmt::format("stimulator {}: {} during an update, looking for it again", s.name,
                             to_string(status)));
    s.over = true;
}

void StimulatorOutput::account(Session& s, Lane& lane, const UsbResult& result) {
    lane.busy = false;
    bool good = result.ok() && result.count == lane.bytes;
    bytes_.fetch_add(result.count, std::memory_order_relaxed);
    if (good) {
        updates_.fetch_add(1, std::memory_order_relaxed);
        if (lane.stamps != nullptr) lane.stamps->note(transmit_slot(), now());
        s.stalls = 0;
        const auto took_ns = static_cast<double>(now() - lane.sent);
        if (lane.bytes >= 4096 && took_ns > 0) {
            const double rate = static_cast<double>(lane.bytes) / took_ns;
            s.bytes_per_ns = s.bytes_per_ns > 0 ? 0.8 * s.bytes_per_ns + 0.2 * rate : rate;
        }
    } else {
        const std::uint64_t current =
            std::exchange(s.frame, lane.frame); // the loss belongs to the lane's frame
        fail(s, result.ok() ? UsbStatus::error : result.status);
        s.frame = current;
    }
    good = good && s.bad_frame != lane.frame;
    if (lane.ends_frame) (good ? delivered_ : dropped_).fetch_add(1, std::memory_order_relaxed);
}

bool StimulatorOutput::finish(Session& s, std::size_t slot, int wait_ms) {
    Lane& lane = s.lanes[slot];
    if (!lane.busy) return true;
    const UsbResult result = s.device->wait(slot, wait_ms);
    if (result.status == UsbStatus::pending) return false;
    account(s, lane, result);
    return true;
}

void StimulatorOutput::finish_for_sure(Session& s, std::size_t slot) {
    const Time patience = now() + 5 * ns_per_s; // beyond the time-out of the transfer itself
    Time stop_patience{};
    while (!finish(s, slot, 20)) {
        heartbeat_.beat();
        const Time t = now();
        if (stopping_ && stop_patience == Time{}) stop_patience = t + stop_patience_ms * ns_per_ms;
        if (t > patience || (stopping_ && t > stop_patience)) {
            s.device->cancel(slot);
            account(s, s.lanes[slot], {UsbStatus::timeout, 0});
            return;
        }
    }
}

void StimulatorOutput::show(Session& s, const Frame& frame) {
    const FrameInfo& info = frame.info;
    ++s.frame;
    s.stamps = info.transmit;
    s.copied_rows = 0;
    s.counted_late = false;
    if (!s.idled && frame.complete()) { // it was complete before the device was free
        late_.fetch_add(1, std::memory_order_relaxed);
        s.counted_late = true;
    }
    warn_of_refresh(s, frame);

    const std::size_t count = std::min<std::size_t>(info.window_count, max_windows);
    const bool same = s.windows.size() == count &&
                      std::equal(s.windows.begin(), s.windows.end(), info.windows.begin(),
                                 [](const Region& a, const FrameWindow& b) { return a == b.sensor; });
    if (!same) {
        s.windows.clear();
        s.places.clear();
        for (std::size_t i = 0; i < count; ++i) {
            s.windows.push_back(info.windows[i].sensor);
            s.places.push_back(s.stage->screen_region(info.windows[i].sensor));
        }
    }
    // Determine the last rectangle before sending: the frame counts as delivered when that one has arrived.
    std::array<Region, max_windows> changed{};
    std::size_t changes = 0;
    const auto pixel = static_cast<std::size_t>(gud::bytes_per_pixel(s.link->format()));
    const std::size_t stride = static_cast<std::size_t>(s.link->width()) * pixel;
    const bool whole = !s.shown_known || s.link->whole_frames_only();
    const Region screen = s.screen();
    const std::span<const Region> places = whole ? std::span<const Region>(&screen, 1) : s.places;
    for (const Region& place : places) {
        if (place.width == 0) continue;
        if (!compute(s, frame, place)) {
            dropped_.fetch_add(1, std::memory_order_relaxed);
            return;
        }
        const Region part = whole ? place : changed_part(place, stride, pixel, s.next.data(), s.shown.data());
        if (part.width == 0)
            unchanged_.fetch_add(1, std::memory_order_relaxed);
        else
            changed[changes++] = part;
    }
    clipped_.store(s.stage->clipped(), std::memory_order_relaxed);
    // Wait for windows off the screen too: a frame ends with its rows.
    if (!copy_rows(s, frame, info.height)) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    if (changes == 0) {
        delivered_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    if (whole) s.shown_known = true; // a failing send resets it
    for (std::size_t i = 0; i < changes; ++i) {
        if (s.over || s.bad_frame == s.frame) {
            // Count the frame as lost here: its last rectangle, which would report it, is not sent.
            dropped_.fetch_add(1, std::memory_order_relaxed);
            return;
        }
        send(s, changed[i], i + 1 == changes);
    }
}

bool StimulatorOutput::copy_rows(Session& s, const Frame& frame, std::int32_t composed_rows) {
    const FrameInfo& info = frame.info;
    const std::int32_t wanted = std::min(composed_rows, info.height);
    while (s.copied_rows < wanted) {
        const std::int32_t ready = frame.rows_ready();
        if (ready <= s.copied_rows) {
            if (frame.abandoned() || stopping_) return false;
            heartbeat_.beat();
            // Poll instead of wait_rows(): a failed producer must not keep stop() from returning.
            std::this_thread::sleep_for(std::chrono::microseconds(200));
            for (std::size_t slot = 0; slot < s.lanes.size(); ++slot)
                finish(s, slot, 0);
            continue;
        }
        const Region sensor{0, 0, context_.sensor.width, context_.sensor.height};
        for (std::size_t i = 0; i < s.windows.size(); ++i) {
            const Region& window = s.windows[i];
            const std::int32_t top = info.windows[i].image_y;
            if (!window.inside(sensor) || window.width > info.width) continue;
            const std::int32_t from = std::max(top, s.copied_rows), to = std::min(top + window.height, ready);
            for (std::int32_t y = from; y < to; ++y) {
                const auto row = frame.row(y).first(static_cast<std::size_t>(window.width));
                std::copy(row.begin(), row.end(),
                          canvas_.begin() + (window.y + y - top) * std::ptrdiff_t{context_.sensor.width} +
                              window.x);
            }
        }
        s.copied_rows = ready;
    }
    return true;
}

bool StimulatorOutput::compute(Session& s, const Frame& frame, const Region& rect) {
    const auto pixel = static_cast<std::size_t>(gud::bytes_per_pixel(s.link->format()));
    const auto width = static_cast<std::size_t>(s.link->width());
    const std::int32_t end = rect.y + rect.height;
    for (std::int32_t y = rect.y; y < end; y += band_rows) {
        const std::int32_t to = std::min(y + band_rows, end);
        // Compute the row block as soon as the rows it depends on are final, while the others are produced.
        const std::int32_t camera_row = s.stage->last_camera_row(to - 1);
        std::int32_t needed = 0;
        for (std::size_t i = 0; i < s.windows.size(); ++i)
            if (camera_row >= s.windows[i].y)
                needed = std::max(needed, frame.info.windows[i].image_y +
                                              std::min(s.windows[i].height, camera_row - s.windows[i].y + 1));
        if (!copy_rows(s, frame, needed)) return false;
        s.stage->render(canvas_, rect, y, to, frame.info.frame_id, s.levels);
    }
    for (std::int32_t y = rect.y; y < end; ++y) {
        const std::size_t at = static_cast<std::size_t>(y) * width + static_cast<std::size_t>(rect.x);
        const auto n = static_cast<std::size_t>(rect.width);
        pack_levels(s.link->format(), settings_.grey, std::span(s.levels).subspan(at, n),
                    std::span(s.next).subspan(at * pixel, n * pixel));
    }
    return true;
}

std::span<const std::uint8_t> StimulatorOutput::compress(Session& s, Lane& lane) {
    if (settings_.compression == Compression::off || !s.link->takes_lz4() ||
        lane.plain.size() < least_to_compress)
        return lane.plain;
    const bool automatic = settings_.compression == Compression::automatic;
    if (automatic && s.compress_rest > 0) {
        --s.compress_rest;
        return lane.plain;
    }
    const Time begin = now();
    lane.packed.resize(lane.plain.size() - 1); // must save at least one byte
    const int size = LZ4_compress_default(
        reinterpret_cast<const char*>(lane.plain.data()), reinterpret_cast<char*>(lane.packed.data()),
        static_cast<int>(lane.plain.size()), static_cast<int>(lane.packed.size()));
    const auto took_ns = static_cast<double>(now() - begin);
    const double saved_ns =
        s.bytes_per_ns > 0
            ? static_cast<double>(lane.plain.size() - static_cast<std::size_t>(size)) / s.bytes_per_ns
            : took_ns + 1;
    if (size <= 0 || (automatic && saved_ns <= took_ns)) {
        // Retry at growing intervals, because noise does not compress.
        s.compress_rest = s.compress_pause;
        s.compress_pause = std::min<std::uint32_t>(2 * s.compress_pause, 64);
        return lane.plain;
    }
    s.compress_pause = 1;
    compressed_.fetch_add(1, std::memory_order_relaxed);
    return std::span(lane.packed).first(static_cast<std::size_t>(size));
}

void StimulatorOutput::send(Session& s, const Region& rect, bool ends_frame) {
    const auto pixel = static_cast<std::size_t>(gud::bytes_per_pixel(s.link->format()));
    const std::size_t stride = static_cast<std::size_t>(s.link->width()) * pixel;
    const std::size_t row_bytes = static_cast<std::size_t>(rect.width) * pixel;
    const auto rows_at_once = static_cast<std::int32_t>(
        std::min<std::size_t>(s.link->max_update_bytes() / row_bytes, static_cast<std::size_t>(rect.height)));
    const std::int32_t end = rect.y + rect.height;
    for (std::int32_t y = rect.y; y < end; y += rows_at_once) {
        const Region part{rect.x, y, rect.width, std::min(rows_at_once, end - y)};
        const std::size_t slot = s.turn++ % s.lanes.size(), other = 1 - slot;
        const bool last = ends_frame && part.y + part.height == end;
        Lane& lane = s.lanes[slot];
        if (!s.counted_late && y == rect.y) {
            // Lanes that are busy at this point belong to earlier frames.
            const auto earlier = [&](std::size_t i) {
                return s.lanes[i].busy && s.lanes[i].frame != s.frame && !finish(s, i, 0);
            };
            const bool held_up =
                s.link->whole_frames_only() ? earlier(slot) : earlier(slot) || earlier(other);
            if (held_up) {
                late_.fetch_add(1, std::memory_order_relaxed);
                s.counted_late = true;
            }
        }
        finish_for_sure(s, slot);
        lane.plain.resize(row_bytes * static_cast<std::size_t>(part.height));
        for (std::int32_t r = 0; r < part.height; ++r) {
            const std::size_t at =
                static_cast<std::size_t>(part.y + r) * stride + static_cast<std::size_t>(part.x) * pixel;
            std::memcpy(lane.plain.data() + static_cast<std::size_t>(r) * row_bytes, s.next.data() + at,
                        row_bytes);
            std::memcpy(s.shown.data() + at, s.next.data() + at, row_bytes);
        }
        DisplayUpdate update{part, compress(s, lane), false};
        update.compressed = update.bytes.data() != lane.plain.data();
        // A buffer request may not overtake the data of the one before.
        if (!s.link->whole_frames_only()) finish_for_sure(s, other);
        UsbStatus status = UsbStatus::gone;
        if (!s.over && s.bad_frame != s.frame) {
            lane.sent = now();
            heartbeat_.allow_silence_until(lane.sent + longest_request_ns);
            status = s.link->send(slot, update);
            if (status == UsbStatus::ok) {
                lane.busy = true;
                lane.frame = s.frame;
                lane.stamps = s.stamps;
                if (lane.stamps != nullptr) lane.stamps->note(transmit_slot(), lane.sent);
                lane.bytes = update.bytes.size();
                lane.ends_frame = last;
                continue;
            }
            fail(s, status);
        }
        // Skip the rest of a frame that has lost an update: it would be torn.
        dropped_.fetch_add(ends_frame ? 1 : 0, std::memory_order_relaxed);
        return;
    }
}

void StimulatorOutput::warn_of_refresh(Session& s, const Frame& frame) {
    const FrameInfo& info = frame.info;
    const std::int64_t period_ns = s.last_edge == Time{} ? 0 : info.trigger_edge - s.last_edge;
    s.last_edge = info.trigger_edge;
    ShutterTiming shutter{info.exposure_ns, 0, period_ns};
    if (info.height > 0)
        shutter.readout_ns = frame.row_times().back().reset - frame.row_times().front().reset;
    const auto near = [](std::int64_t a, std::int64_t b) {
        return std::abs(static_cast<double>(a - b)) <= 0.05 * std::abs(static_cast<double>(b));
    };
    const bool same = near(shutter.exposure_ns, s.shutter.exposure_ns) &&
                      near(shutter.readout_ns, s.shutter.readout_ns) &&
                      near(shutter.frame_period_ns, s.shutter.frame_period_ns);
    s.shutter = shutter;
    s.same_shutter = same ? s.same_shutter + 1 : 0;
    if (s.same_shutter != 3) return; // warn once, when the settings are stable over several frames
    ScreenTiming screen{s.link->mode().refresh_hz(), 0};
    if (s.bytes_per_ns > 0)
        screen.transfer_ns =
            static_cast<std::int64_t>(static_cast<double>(s.link->frame_bytes()) / s.bytes_per_ns);
    for (const std::string& line : explain_refresh(screen, shutter))
        log_warning("stimulator {}: {}", s.name, line);
}

TransportCounters StimulatorOutput::counters() const noexcept {
    return {submitted_.load(std::memory_order_relaxed), delivered_.load(std::memory_order_relaxed),
            dropped_.load(std::memory_order_relaxed), bytes_.load(std::memory_order_relaxed)};
}

TransportStatistics StimulatorOutput::statistics() const {
    TransportStatistics s = Transport::statistics();
    const StimulatorStatus now = status();
    s.values.insert(s.values.end(), {{"connects", now.connects},
                                     {"late", now.late},
                                     {"updates", now.updates},
                                     {"unchanged", now.unchanged},
                                     {"compressed", now.compressed},
                                     {"failed", now.failed},
                                     {"clipped_pixels", now.clipped_pixels}});
    if (now.has_frame_status)
        s.values.insert(s.values.end(),
                        {{"device_shown", now.device_shown}, {"device_errors", now.device_errors}});
    s.texts = {{"display", now.connected ? "connected" : "not found"}};
    return s;
}

StimulatorStatus StimulatorOutput::status() const noexcept {
    StimulatorStatus status;
    status.connected = connected_.load(std::memory_order_relaxed);
    status.connects = connects_.load(std::memory_order_relaxed);
    status.late = late_.load(std::memory_order_relaxed);
    status.updates = updates_.load(std::memory_order_relaxed);
    status.unchanged = unchanged_.load(std::memory_order_relaxed);
    status.compressed = compressed_.load(std::memory_order_relaxed);
    status.failed = failed_.load(std::memory_order_relaxed);
    status.clipped_pixels = clipped_.load(std::memory_order_relaxed);
    status.has_frame_status = has_frame_status_.load(std::memory_order_relaxed);
    status.device_shown = device_shown_.load(std::memory_order_relaxed);
    status.device_errors = device_errors_.load(std::memory_order_relaxed);
    status.last_shown = {last_shown_ns_.load(std::memory_order_relaxed)};
    return status;
}

} // namespace obscura::transports
