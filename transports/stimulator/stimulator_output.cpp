// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/stimulator_output.hpp"

#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"
#include "transports/stimulator/stimulator_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>

namespace obscura::transports {
namespace {

constexpr std::int64_t check_interval_ns = 250 * ns_per_ms; // interval of status requests to an idle device
constexpr std::int64_t complaint_interval_ns = 60 * ns_per_s;
/// Longest blocking call announced to the watchdog: finding the device and computing its tables.
constexpr std::int64_t max_connect_ns = 60 * ns_per_s;

} // namespace

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
    const Time at = stimulator_now();
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
            heartbeat_.allow_silence_until(stimulator_now() + max_connect_ns);
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
        const Time again = stimulator_now() + (absent_ ? context_.look_ns : context_.reconnect_ns);
        while (!stopping_ && stimulator_now() < again) {
            heartbeat_.beat();
            (void)wake_.try_acquire_for(std::chrono::nanoseconds(again - stimulator_now()));
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
    session->checked = stimulator_now();
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
        if (stimulator_now() - s.checked > (s.idled ? check_interval_ns : 4 * check_interval_ns)) check(s);
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
        UsbResult result = s.device->wait(slot, s.over ? 0 : stop_timeout_ms);
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
    s.checked = stimulator_now();
    heartbeat_.allow_silence_until(s.checked + max_request_ns);
    if (s.link->has_frame_status()) {
        const Time before = stimulator_now();
        const auto status = s.link->frame_status();
        const Time after = stimulator_now();
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
