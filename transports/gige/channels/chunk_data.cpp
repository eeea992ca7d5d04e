// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/chunk_data.hpp"

#include "core/camera/frame_flags.hpp"
#include "core/camera/scene_truth.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <algorithm>
#include <cstring>

namespace obscura::transports::gige {
namespace {

constexpr std::size_t region_id_bytes = 4;

std::size_t data_bytes(Chunk c, std::int32_t rows, std::uint32_t truth_entries) noexcept {
    switch (c) {
    case Chunk::regions:
        return list_head_bytes + max_windows * record_bytes<FrameWindow>();
    case Chunk::region_id:
        return region_id_bytes * (1 + max_windows);
    case Chunk::row_times:
        return list_head_bytes + static_cast<std::size_t>(rows) * record_bytes<RowTime>();
    case Chunk::ground_truth:
        return truth_ages_offset + max_truth_bodies * record_bytes<BodyAge>();
    case Chunk::truth_table:
        return list_head_bytes + truth_entries * record_bytes<TruthEntry>();
    case Chunk::frame_quality:
        return record_bytes<FrameQuality>();
    default:
        return bytes_of(head_field(c)->form);
    }
}

/// Writes the data of one chunk after the other; bytes without a field are 0.
class ChunkWriter {
public:
    ChunkWriter(const Frame& frame, const FrameHead& head, const ChunkContext& context) noexcept
        : frame_(frame), info_(frame.info), head_(head), context_(context) {}

    void write(Chunk chunk, std::uint8_t* out) const noexcept {
        switch (chunk) {
        case Chunk::regions:
            return write_windows(out);
        case Chunk::region_id:
            return write_region_ids(out);
        case Chunk::row_times:
            return write_rows(out);
        case Chunk::ground_truth:
            return write_truth(out);
        case Chunk::truth_table:
            return write_truth_table(out);
        case Chunk::frame_quality:
            return store_record(out, info_.quality);
        default:
            return store_field(out, *head_field(chunk), head_);
        }
    }

private:
    [[nodiscard]] Time device_time(Time t) const noexcept {
        return {t.ns + info_.tai_offset_ns - context_.timestamp_origin_ns};
    }
    void write_windows(std::uint8_t* out) const noexcept {
        store_be32(out, info_.window_count);
        for (std::uint32_t w = 0; w < std::min<std::uint32_t>(info_.window_count, max_windows); ++w) {
            FrameWindow window = info_.windows[w];
            window.image_y /= context_.binning.vertical;
            window.flags = frame_.window_flags(w);
            store_record(out + list_head_bytes + w * record_bytes<FrameWindow>(), window);
        }
    }
    void write_region_ids(std::uint8_t* out) const noexcept {
        store_be32(out, info_.window_count);
        for (std::uint32_t w = 0; w < std::min<std::uint32_t>(info_.window_count, max_windows); ++w)
            store_be32(out + region_id_bytes * (1 + w),
                       context_.regions[info_.windows[w].request % max_windows]);
    }
    void write_rows(std::uint8_t* out) const noexcept {
        const std::int32_t binned = context_.binning.vertical;
        const std::size_t row_bytes = record_bytes<RowTime>();
        store_be32(out, static_cast<std::uint32_t>(head_.image.height));
        std::uint8_t* at = out + list_head_bytes;
        for (std::int32_t row = 0; row < head_.image.height; ++row, at += row_bytes) {
            const auto rows = frame_.row_times().subspan(static_cast<std::size_t>(row * binned),
                                                         static_cast<std::size_t>(binned));
            store_record(at, RowTime{device_time(rows.front().reset), device_time(rows.back().read)});
        }
    }
    void write_truth(std::uint8_t* out) const noexcept {
        GroundTruth truth = info_.truth;
        truth.mid_exposure = device_time(truth.mid_exposure);
        store_record(out, truth);
        for (std::uint32_t b = 0; b < std::min<std::uint32_t>(truth.body_count, max_truth_bodies); ++b) {
            store_record(out + truth_bodies_offset + b * record_bytes<BodyTruth>(), truth.bodies[b]);
            store_record(out + truth_ages_offset + b * record_bytes<BodyAge>(),
                         BodyAge{truth.bodies[b].pose_age_s});
        }
    }
    void write_truth_table(std::uint8_t* out) const noexcept {
        const SceneTruth* const truth = frame_.final_scene_truth();
        const std::size_t listed = truth != nullptr ? truth->entries.size() : 0;
        const std::size_t count = std::min<std::size_t>(listed, context_.truth_entries);
        const std::uint64_t more = listed - count + (truth != nullptr ? truth->entries_left_out : 0);
        store_be32(out, static_cast<std::uint32_t>(count));
        store_be32(out + 4, static_cast<std::uint32_t>(more));
        for (std::size_t e = 0; e < count; ++e)
            store_record(out + list_head_bytes + e * record_bytes<TruthEntry>(), sent(truth->entries[e]));
    }
    /// The entry in device time and in the pixels of the binned image.
    [[nodiscard]] TruthEntry sent(TruthEntry e) const noexcept {
        const Binning& binning = context_.binning;
        // The centre of the first pixel is at 0, of sensor pixels and of binned ones.
        const auto binned = [](double px, std::int32_t factor) { return (px + 0.5) / factor - 0.5; };
        e.x_px = binned(e.x_px, binning.horizontal), e.y_px = binned(e.y_px, binning.vertical);
        e.psf_x_px /= binning.horizontal, e.psf_y_px /= binning.vertical;
        e.time = device_time(e.time);
        return e;
    }

    const Frame& frame_;
    const FrameInfo& info_;
    const FrameHead& head_;
    const ChunkContext& context_;
};

FrameHead head_of(const Frame& frame, const ChunkContext& context) noexcept {
    const FrameInfo& info = frame.info;
    const Region& first = info.windows[0].sensor;
    FrameHead head;
    head.timestamp_ns =
        static_cast<std::uint64_t>(info.trigger_edge.ns + info.tai_offset_ns - context.timestamp_origin_ns);
    head.exposure_us = static_cast<double>(info.exposure_ns) / 1000;
    head.gain_db = info.gain_db;
    head.frame_id = context.frame_id;
    head.trigger_id = info.trigger_id;
    head.image = context.binning.of({first.x, first.y, info.width, info.height});
    head.pixel_format = static_cast<std::uint32_t>(info.pixel_format);
    head.flags = reported_flags(frame);
    head.line_status = info.line_status;
    head.sequencer_set = info.sequence_step;
    return head;
}

} // namespace

std::size_t chunk_bytes(std::uint32_t selection, std::int32_t rows, std::uint32_t truth_entries) noexcept {
    if (selection == 0) return 0;
    std::size_t bytes = chunk_tag_bytes;
    for (unsigned i = 0; i < chunk_count; ++i)
        if ((selection >> i & 1) != 0)
            bytes += data_bytes(static_cast<Chunk>(i), rows, truth_entries) + chunk_tag_bytes;
    return bytes;
}

std::size_t write_chunks(std::span<std::uint8_t> out, std::uint32_t selection, const Frame& frame,
                         const ChunkContext& context) noexcept {
    std::uint8_t* at = out.data();
    const auto tag = [&at](std::uint32_t id, std::size_t bytes) {
        store_be32(at, id);
        store_be32(at + 4, static_cast<std::uint32_t>(bytes));
        at += chunk_tag_bytes;
    };
    if (context.tag_image) tag(chunk_id_base, context.image_bytes);
    const FrameHead head = head_of(frame, context);
    const ChunkWriter writer(frame, head, context);
    for (unsigned i = 0; i < chunk_count; ++i) {
        if ((selection >> i & 1) == 0) continue;
        const auto chunk = static_cast<Chunk>(i);
        const std::size_t bytes = data_bytes(chunk, head.image.height, context.truth_entries);
        std::memset(at, 0, bytes);
        writer.write(chunk, at);
        at += bytes;
        tag(chunk_id(chunk), bytes);
    }
    return static_cast<std::size_t>(at - out.data());
}

} // namespace obscura::transports::gige
