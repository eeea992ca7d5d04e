// SPDX-License-Identifier: Apache-2.0
// Updates of the stimulator: what of a frame has changed on the screen, and its transfers to the device.
#include "core/clock.hpp"
#include "transports/stimulator/stimulator_session.hpp"

#include <fmt/format.h>
#include <lz4.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

namespace obscura::transports {
namespace {

constexpr std::int32_t band_rows = 64;
constexpr int stalls_allowed = 3;
constexpr std::size_t min_to_compress = 256; // bytes; the request costs more than fewer data

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
        if (lane.stamps != nullptr) lane.stamps->note(transmit_slot(), stimulator_now());
        s.stalls = 0;
        const auto took_ns = static_cast<double>(stimulator_now() - lane.sent);
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
    const Time patience = stimulator_now() + 5 * ns_per_s; // beyond the time-out of the transfer itself
    Time stop_timeout{};
    while (!finish(s, slot, 20)) {
        heartbeat_.beat();
        const Time t = stimulator_now();
        if (stopping_ && stop_timeout == Time{}) stop_timeout = t + stop_timeout_ms * ns_per_ms;
        if (t > patience || (stopping_ && t > stop_timeout)) {
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
        lane.plain.size() < min_to_compress)
        return lane.plain;
    const bool automatic = settings_.compression == Compression::automatic;
    if (automatic && s.compress_rest > 0) {
        --s.compress_rest;
        return lane.plain;
    }
    const Time begin = stimulator_now();
    lane.packed.resize(lane.plain.size() - 1); // must save at least one byte
    const int size = LZ4_compress_default(
        reinterpret_cast<const char*>(lane.plain.data()), reinterpret_cast<char*>(lane.packed.data()),
        static_cast<int>(lane.plain.size()), static_cast<int>(lane.packed.size()));
    const auto took_ns = static_cast<double>(stimulator_now() - begin);
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
            lane.sent = stimulator_now();
            heartbeat_.allow_silence_until(lane.sent + max_request_ns);
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

} // namespace obscura::transports
