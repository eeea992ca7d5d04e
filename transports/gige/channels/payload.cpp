// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/payload.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace obscura::transports::gige {
namespace {

/// Significant bits where the format holds every pixel in a 16-bit word, as a Frame does; else 0.
int bits_in_words(PixelFormat format) noexcept {
    switch (format) {
    case PixelFormat::mono10:
        return 10;
    case PixelFormat::mono12:
        return 12;
    case PixelFormat::mono14:
        return 14;
    case PixelFormat::mono16:
        return 16;
    default:
        return 0;
    }
}

/// Eight pixels of any depth fill whole bytes.
constexpr std::size_t byte_group = 8;

} // namespace

std::size_t chunk_payload_bytes(std::uint32_t chunks, std::int32_t rows, bool multipart,
                                std::uint32_t truth_entries) noexcept {
    const std::size_t bytes = chunk_bytes(chunks, rows, truth_entries);
    return multipart && bytes > 0 ? bytes - chunk_tag_bytes
                                  : bytes; // that part has no image and no tag of one
}

void Payload::reserve(const PayloadFormat& format) {
    format_ = format;
    if (format.packs_pixels || format.multipart || format.binning.active())
        packed_.resize(format.max_image_bytes + max_windows);
    carry_.resize(static_cast<std::size_t>(format.max_width) + byte_group);
    chunk_store_.resize(chunk_bytes(format.chunks, format.max_height, format.truth_entries));
    if (format.binning.active()) binner_.reserve(format.max_width);
}

bool Payload::begin(const Frame& frame, std::uint64_t frame_id, std::size_t packet_bytes) noexcept {
    const FrameInfo& info = frame.info;
    if (info.width <= 0 || info.height <= 0 || info.width > format_.max_width ||
        info.height > format_.max_height)
        return false;
    const Region& first = info.windows[0].sensor;
    image_ = format_.binning.of({first.x, first.y, info.width, info.height});
    if (image_.area() == 0) return false;
    frame_id_ = frame_id;
    packet_bytes_ = packet_bytes;
    direct_ = !format_.multipart && !format_.binning.active() &&
              bits_in_words(info.pixel_format) >= info.bits_per_pixel;
    valid_ = available_ = 0;
    packing_part_ = carried_ = 0;
    packing_row_ = 0;
    part_count_ = 0;

    if (format_.multipart) {
        image_bytes_ = 0;
        for (std::uint32_t w = 0; w < info.window_count; ++w) {
            const Region& r = info.windows[w].sensor;
            if (r.width <= 0 || r.height <= 0 || r.width > info.width ||
                info.windows[w].image_y + r.height > info.height || part_count_ == max_windows)
                return false;
            const std::size_t bytes = packed_bytes(info.pixel_format, r.area());
            parts_[part_count_++] = {image_bytes_, bytes, 0, 0, w};
            image_bytes_ += bytes;
        }
    } else {
        image_bytes_ = packed_bytes(info.pixel_format, image_.area());
        parts_[part_count_++] = {0, image_bytes_, 0, 0, 0};
    }
    if (image_bytes_ > format_.max_image_bytes + max_windows || (!direct_ && packed_.size() < image_bytes_))
        return false;
    data_ = direct_ ? reinterpret_cast<const std::uint8_t*>(frame.pixels().data()) : packed_.data();

    const std::size_t chunks =
        chunk_payload_bytes(format_.chunks, image_.height, format_.multipart, format_.truth_entries);
    if (chunks > 0 && format_.multipart) {
        parts_[part_count_++] = {image_bytes_, chunks, 0, 0, max_windows};
    } else if (chunks > 0) {
        parts_[0].bytes += chunks;
    }
    bytes_ = image_bytes_ + chunks;
    packets_ = 0;
    for (std::size_t i = 0; i < part_count_; ++i) {
        parts_[i].first_packet = packets_;
        parts_[i].packets = static_cast<std::uint32_t>((parts_[i].bytes + packet_bytes - 1) / packet_bytes);
        packets_ += parts_[i].packets;
    }
    return true;
}

void Payload::append_row(const FrameInfo& info, std::span<const std::uint16_t> row) noexcept {
    const PixelFormat format = info.pixel_format;
    const int bits = info.bits_per_pixel;
    const std::size_t width = row.size();
    std::uint8_t* const out = packed_.data() + valid_;
    const bool whole_bytes = format != PixelFormat::mono10p && format != PixelFormat::mono12p;
    if (whole_bytes || (carried_ == 0 && width % byte_group == 0)) {
        const std::size_t n = packed_bytes(format, static_cast<std::int64_t>(width));
        pack_pixels(format, bits, row, {out, n});
        valid_ += n;
        return;
    }
    std::copy(row.begin(), row.end(), carry_.begin() + static_cast<std::ptrdiff_t>(carried_));
    const std::size_t held = carried_ + width;
    const std::size_t now = held / byte_group * byte_group;
    const std::size_t n = packed_bytes(format, static_cast<std::int64_t>(now));
    pack_pixels(format, bits, std::span(carry_).first(now), {out, n});
    valid_ += n;
    carried_ = held - now;
    std::copy_n(carry_.begin() + static_cast<std::ptrdiff_t>(now), carried_, carry_.begin());
}

void Payload::finish_part(const Frame& frame) noexcept {
    if (carried_ > 0) {
        const std::size_t n = packed_bytes(frame.info.pixel_format, static_cast<std::int64_t>(carried_));
        pack_pixels(frame.info.pixel_format, frame.info.bits_per_pixel, std::span(carry_).first(carried_),
                    {packed_.data() + valid_, n});
        valid_ += n;
        carried_ = 0;
    }
    packing_row_ = 0;
    ++packing_part_;
}

void Payload::update(const Frame& frame) noexcept {
    if (done()) return;
    // Read this before the row count, so that all rows published before the frame was abandoned are seen.
    const bool abandoned = frame.abandoned();
    const std::int32_t ready = frame.rows_ready();
    const FrameInfo& info = frame.info;
    if (direct_) {
        valid_ = 2 * static_cast<std::size_t>(ready) * static_cast<std::size_t>(info.width);
    } else if (format_.binning.active()) {
        const Binning& binning = format_.binning;
        while (packing_part_ == 0 && (packing_row_ + 1) * binning.vertical <= ready) {
            append_row(info, binner_.row(frame, packing_row_, image_.width, info.pixel_format, binning));
            if (++packing_row_ == image_.height) finish_part(frame);
        }
    } else {
        const std::size_t image_parts = format_.multipart ? info.window_count : 1;
        while (packing_part_ < image_parts) {
            const FrameWindow whole{{0, 0, info.width, info.height}, 0, 0, 0};
            const FrameWindow& window = format_.multipart ? info.windows[packing_part_] : whole;
            if (window.image_y + packing_row_ >= ready) break;
            append_row(info, frame.row(window.image_y + packing_row_)
                                 .first(static_cast<std::size_t>(window.sensor.width)));
            if (++packing_row_ == window.sensor.height) finish_part(frame);
        }
    }
    available_ = valid_;
    if (ready == info.height || abandoned) {
        if (bytes_ > image_bytes_)
            write_chunks(chunk_store_, format_.chunks, frame,
                         {frame_id_, image_bytes_, !format_.multipart, format_.timestamp_origin_ns,
                          format_.regions, format_.binning, format_.truth_entries});
        available_ = bytes_;
    }
}

std::uint32_t Payload::ready_packets() const noexcept {
    if (done()) return packets_;
    std::uint32_t n = 0;
    for (const Part& p : parts()) {
        if (p.begin + p.bytes <= available_) {
            n += p.packets;
            continue;
        }
        if (p.begin < available_) n += static_cast<std::uint32_t>((available_ - p.begin) / packet_bytes_);
        break;
    }
    return n;
}

const Payload::Part& Payload::part_of(std::uint32_t i) const noexcept {
    std::size_t p = 0;
    while (p + 1 < part_count_ && parts_[p + 1].first_packet <= i)
        ++p;
    return parts_[p];
}

Payload::Pieces Payload::packet(std::uint32_t i, std::span<const std::uint8_t> zeros,
                                std::size_t& offset) const noexcept {
    const Part& part = part_of(i);
    const std::size_t from = part.begin + (i - part.first_packet) * packet_bytes_;
    const std::size_t to = std::min(part.begin + part.bytes, from + packet_bytes_);
    offset = from;
    const auto clamp = [&](std::size_t at) { return std::clamp(at, from, to); };
    const std::size_t image_end = clamp(valid_), zero_end = std::max(image_end, clamp(image_bytes_));
    Pieces pieces{};
    if (image_end > from) pieces[0] = {data_ + from, image_end - from};
    pieces[1] = zeros.first(zero_end - image_end);
    if (to > zero_end) pieces[2] = std::span{chunk_store_}.subspan(zero_end - image_bytes_, to - zero_end);
    return pieces;
}

} // namespace obscura::transports::gige
