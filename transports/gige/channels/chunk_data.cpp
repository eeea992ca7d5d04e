// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/chunk_data.hpp"

#include "core/camera/frame_flags.hpp"
#include "core/camera/scene_truth.hpp"
#include "transports/gige/wire/bytes.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

namespace obscura::transports::gige {
namespace {

constexpr std::size_t region_bytes = 48;
constexpr std::size_t truth_head_bytes = 104;
constexpr std::size_t truth_body_bytes = 88;
constexpr std::size_t truth_intrinsics_bytes = 48;
constexpr std::size_t truth_ages_bytes = 8 + 8 * max_truth_bodies;

std::size_t data_bytes(Chunk c, std::int32_t rows, std::uint32_t truth_entries) noexcept {
    switch (c) {
    case Chunk::width:
    case Chunk::height:
    case Chunk::offset_x:
    case Chunk::offset_y:
    case Chunk::pixel_format:
    case Chunk::frame_flags:
    case Chunk::line_status_all:
    case Chunk::sequencer_set_active:
        return 4;
    case Chunk::regions:
        return 8 + max_windows * region_bytes;
    case Chunk::region_id:
        return 4 + max_windows * 4;
    case Chunk::row_times:
        return 8 + static_cast<std::size_t>(rows) * 16;
    case Chunk::ground_truth:
        return truth_head_bytes + max_truth_bodies * truth_body_bytes + truth_intrinsics_bytes +
               truth_ages_bytes;
    case Chunk::truth_table:
        return 8 + truth_entries * truth_entry_bytes;
    case Chunk::frame_quality:
        return frame_quality_bytes;
    default:
        return 8;
    }
}

/// Encoder of consecutive big-endian numbers.
class BigEndianWriter {
public:
    explicit BigEndianWriter(std::uint8_t* at) : at_(at) {}
    void u32(std::uint32_t v) {
        store_be32(at_, v);
        at_ += 4;
    }
    void u64(std::uint64_t v) {
        store_be64(at_, v);
        at_ += 8;
    }
    void i32(std::int32_t v) { u32(static_cast<std::uint32_t>(v)); }
    void f64(double v) { u64(std::bit_cast<std::uint64_t>(v)); }
    void vector(Vec3 v) {
        f64(v.x);
        f64(v.y);
        f64(v.z);
    }
    void pose(const Pose& p) {
        vector(p.position_m);
        f64(p.orientation.w);
        f64(p.orientation.x);
        f64(p.orientation.y);
        f64(p.orientation.z);
    }
    void bytes(const void* from, std::size_t n) {
        std::memcpy(at_, from, n);
        at_ += n;
    }
    void zeros(std::size_t n) {
        std::memset(at_, 0, n);
        at_ += n;
    }
    [[nodiscard]] std::uint8_t* at() const { return at_; }

private:
    std::uint8_t* at_;
};

template<typename DeviceTime>
void write_truth_entry(BigEndianWriter& writer, const TruthEntry& e, const Binning& binning,
                       const DeviceTime& device_time) {
    // The centre of the first pixel is at 0, of sensor pixels and of binned ones.
    const auto binned = [](double px, std::int32_t factor) { return (px + 0.5) / factor - 0.5; };
    writer.u32(static_cast<std::uint32_t>(e.kind));
    writer.u32(static_cast<std::uint32_t>(e.visibility));
    writer.u32((e.lit ? 1U : 0U) | (e.saturated ? 2U : 0U));
    writer.u32(e.window);
    writer.i32(e.object);
    writer.i32(e.item);
    writer.bytes(e.name.bytes().data(), e.name.bytes().size());
    writer.f64(binned(e.x_px, binning.horizontal));
    writer.f64(binned(e.y_px, binning.vertical));
    writer.u64(device_time(e.time));
    writer.u64(static_cast<std::uint64_t>(e.exposure_ns));
    for (const double value :
         {e.range_m, e.visible_share, e.magnitude_v, e.irradiance_w_m2, e.signal_e, e.peak_e, e.snr,
          e.psf_x_px / binning.horizontal, e.psf_y_px / binning.vertical})
        writer.f64(value);
}

void write_quality(BigEndianWriter& writer, const FrameQuality& q) {
    for (const std::uint32_t value : {static_cast<std::uint32_t>(q.level_max), q.reasons, q.groups,
                                      static_cast<std::uint32_t>(q.group_rows), q.bounces, q.bounces_asked,
                                      static_cast<std::uint32_t>(q.rows_degraded), q.tiles_missing})
        writer.u32(value);
    for (const float value : {q.error_rms, q.error_worst_group, q.unknown_share, q.samples_mean,
                              q.samples_median, q.samples_min, q.lod_deficit_share, q.lod_deficit_worst})
        writer.f64(static_cast<double>(value));
    for (const std::int64_t us : {q.budget_us, q.spent_us, q.margin_us})
        writer.u64(static_cast<std::uint64_t>(us));
    for (const float share : q.level_share)
        writer.f64(static_cast<double>(share));
    static_assert(sizeof(QualityLevel) == 1);
    writer.bytes(q.group_level.data(), q.group_level.size());
    for (const std::uint32_t value : {q.instants, static_cast<std::uint32_t>(q.rows_reprojected),
                                      static_cast<std::uint32_t>(q.rows_repeated), 0U})
        writer.u32(value);
    for (const float value : {q.error_goal, q.noise_ratio_p95})
        writer.f64(static_cast<double>(value));
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
                         std::uint64_t frame_id, std::size_t image_bytes, bool tag_image,
                         std::int64_t timestamp_origin_ns, const RegionNumbers& regions,
                         const Binning& binning, std::uint32_t truth_entries) noexcept {
    const FrameInfo& info = frame.info;
    const Region& first = info.windows[0].sensor;
    const Region image = binning.of({first.x, first.y, info.width, info.height});
    const auto device_time = [&](Time t) {
        return static_cast<std::uint64_t>(t.ns + info.tai_offset_ns - timestamp_origin_ns);
    };
    BigEndianWriter writer(out.data());
    if (tag_image) {
        writer.u32(chunk_id_base);
        writer.u32(static_cast<std::uint32_t>(image_bytes));
    }
    for (unsigned i = 0; i < chunk_count; ++i) {
        if ((selection >> i & 1) == 0) continue;
        const auto chunk = static_cast<Chunk>(i);
        const std::uint8_t* const begin = writer.at();
        switch (chunk) {
        case Chunk::timestamp:
            writer.u64(device_time(info.trigger_edge));
            break;
        case Chunk::exposure_time:
            writer.f64(static_cast<double>(info.exposure_ns) / 1000);
            break;
        case Chunk::gain:
            writer.f64(info.gain_db);
            break;
        case Chunk::frame_id:
            writer.u64(frame_id);
            break;
        case Chunk::width:
            writer.i32(image.width);
            break;
        case Chunk::height:
            writer.i32(image.height);
            break;
        case Chunk::offset_x:
            writer.i32(image.x);
            break;
        case Chunk::offset_y:
            writer.i32(image.y);
            break;
        case Chunk::pixel_format:
            writer.u32(static_cast<std::uint32_t>(info.pixel_format));
            break;
        case Chunk::trigger_id:
            writer.u64(info.trigger_id);
            break;
        case Chunk::frame_flags:
            writer.u32(reported_flags(frame));
            break;
        case Chunk::regions:
            writer.u32(info.window_count);
            writer.u32(0);
            for (std::uint32_t w = 0; w < max_windows; ++w) {
                const FrameWindow window = w < info.window_count ? info.windows[w] : FrameWindow{};
                writer.i32(window.sensor.x);
                writer.i32(window.sensor.y);
                writer.i32(window.sensor.width);
                writer.i32(window.sensor.height);
                writer.i32(window.image_y / binning.vertical);
                writer.u32(w < info.window_count ? frame.window_flags(w) : 0);
                for (const std::int64_t ns :
                     {window.exposure_requested_ns, window.exposure_min_ns, window.exposure_max_ns})
                    writer.u64(static_cast<std::uint64_t>(ns));
            }
            break;
        case Chunk::row_times:
            writer.i32(image.height);
            writer.u32(0);
            for (std::int32_t row = 0; row < image.height; ++row) {
                const auto rows = frame.row_times().subspan(static_cast<std::size_t>(row * binning.vertical),
                                                            static_cast<std::size_t>(binning.vertical));
                writer.u64(device_time(rows.front().reset));
                writer.u64(device_time(rows.back().read));
            }
            break;
        case Chunk::line_status_all:
            writer.u32(info.line_status);
            break;
        case Chunk::sequencer_set_active:
            writer.u32(info.sequence_step);
            break;
        case Chunk::region_id:
            writer.u32(info.window_count);
            for (std::uint32_t w = 0; w < max_windows; ++w)
                writer.u32(w < info.window_count ? regions[info.windows[w].request % max_windows] : 0U);
            break;
        case Chunk::ground_truth: {
            const GroundTruth& truth = info.truth;
            writer.u64(device_time(truth.mid_exposure));
            writer.pose(truth.camera);
            writer.vector(truth.sun_position_m);
            writer.u64(truth.seed);
            writer.u32(truth.body_count);
            writer.u32(truth.run);
            for (std::uint32_t b = 0; b < max_truth_bodies; ++b) {
                if (b < truth.body_count) {
                    writer.bytes(truth.bodies[b].name.data(), 32);
                    writer.pose(truth.bodies[b].pose);
                } else {
                    writer.zeros(truth_body_bytes);
                }
            }
            for (const double px : truth.intrinsics.focal_length_px)
                writer.f64(px);
            for (const double px : truth.intrinsics.principal_point_px)
                writer.f64(px);
            for (const double pitch_m : truth.intrinsics.pixel_pitch_m)
                writer.f64(1e6 * pitch_m);
            writer.f64(truth.camera_pose_age_s);
            for (std::uint32_t b = 0; b < max_truth_bodies; ++b)
                writer.f64(b < truth.body_count ? truth.bodies[b].pose_age_s : 0);
            break;
        }
        case Chunk::truth_table: {
            const SceneTruth* const truth = frame.final_scene_truth();
            const std::size_t listed = truth != nullptr ? truth->entries.size() : 0;
            const std::size_t count = std::min<std::size_t>(listed, truth_entries);
            const std::uint64_t more = listed - count + (truth != nullptr ? truth->entries_left_out : 0);
            writer.u32(static_cast<std::uint32_t>(count));
            writer.u32(static_cast<std::uint32_t>(more));
            for (std::size_t e = 0; e < count; ++e)
                write_truth_entry(writer, truth->entries[e], binning, device_time);
            writer.zeros((truth_entries - count) * truth_entry_bytes);
            break;
        }
        case Chunk::frame_quality:
            write_quality(writer, info.quality);
            break;
        }
        const auto bytes = static_cast<std::size_t>(writer.at() - begin);
        assert(bytes == data_bytes(chunk, image.height, truth_entries));
        writer.u32(chunk_id(static_cast<Chunk>(i)));
        writer.u32(static_cast<std::uint32_t>(bytes));
    }
    const auto written = static_cast<std::size_t>(writer.at() - out.data());
    assert(written <= out.size());
    return written;
}

} // namespace obscura::transports::gige
