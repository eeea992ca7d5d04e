// SPDX-License-Identifier: Apache-2.0
// Bytes of the chunks: their layout is public, so that every byte of a block is compared.
#include "core/camera/frame.hpp"
#include "core/camera/scene_truth.hpp"
#include "core/fnv.hpp"
#include "tests/support/catch.hpp"
#include "transports/gige/channels/chunk_data.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace chunk_data_test {

using namespace obscura;
using namespace obscura::transports::gige;

namespace {

/// Different numbers one after the other, so that exchanged fields show.
class Numbers {
public:
    template<typename... Values>
    void fill(Values&... values) {
        (set(values), ...);
    }

private:
    void set(double& value) { value = 0.5 + static_cast<double>(++count_) * 1.25; }
    void set(float& value) { value = 0.25F + static_cast<float>(++count_) * 0.125F; }
    void set(Time& value) { value.ns = std::int64_t{1'000'000'007} * ++count_; }
    void set(Vec3& v) { fill(v.x, v.y, v.z); }
    void set(Pose& p) {
        fill(p.position_m, p.orientation.w, p.orientation.x, p.orientation.y, p.orientation.z);
    }
    void set(Region& r) { fill(r.x, r.y, r.width, r.height); }
    template<typename Integer>
    void set(Integer& value) {
        value = static_cast<Integer>(3 + 8 * ++count_);
    }
    int count_ = 0;
};

void fill_quality(FrameQuality& q, Numbers& numbers) {
    q.level_max = QualityLevel::reprojected;
    numbers.fill(q.reasons, q.error_rms, q.error_worst_group, q.error_goal, q.noise_ratio_p95,
                 q.unknown_share, q.samples_mean, q.samples_median, q.samples_min, q.bounces, q.bounces_asked,
                 q.instants, q.rows_degraded, q.rows_reprojected, q.rows_repeated, q.budget_us, q.spent_us,
                 q.group_rows, q.groups, q.lod_deficit_share, q.lod_deficit_worst, q.tiles_missing);
    q.rays_doubtful = 0x01020304;
    q.margin_us = -1500;
    for (float& share : q.level_share)
        numbers.fill(share);
    for (std::size_t g = 0; g < q.group_level.size(); ++g)
        q.group_level[g] = static_cast<QualityLevel>(g % quality_level_count);
}

void fill_truth(GroundTruth& truth, Numbers& numbers) {
    numbers.fill(truth.mid_exposure, truth.camera, truth.camera_pose_age_s, truth.sun_position_m, truth.seed,
                 truth.run);
    truth.body_count = 3;
    for (std::uint32_t b = 0; b < truth.body_count; ++b) {
        BodyTruth& body = truth.bodies[b];
        const std::string name = "body " + std::to_string(b);
        std::copy(name.begin(), name.end(), body.name.begin());
        numbers.fill(body.pose, body.pose_age_s);
    }
    for (auto* pair : {&truth.intrinsics.focal_length_px, &truth.intrinsics.principal_point_px})
        numbers.fill((*pair)[0], (*pair)[1]);
    truth.intrinsics.pixel_pitch_m = {10e-6, 16.3e-6};
}

void fill_entry(TruthEntry& e, Numbers& numbers) {
    e.kind = TruthKind::landmark;
    e.visibility = TruthVisibility::partly;
    e.saturated = true;
    e.name.set("Aristarchus");
    numbers.fill(e.window, e.object, e.item, e.x_px, e.y_px, e.psf_x_px, e.psf_y_px, e.time, e.exposure_ns,
                 e.range_m, e.visible_share, e.magnitude_v, e.irradiance_w_m2, e.signal_e, e.peak_e);
}

void fill(Frame& frame) {
    Numbers numbers;
    FrameInfo& info = frame.info;
    info.width = 64, info.height = 12;
    info.pixel_format = PixelFormat::mono12p;
    info.clock_state = ClockState::holdover;
    numbers.fill(info.frame_id, info.trigger_id, info.trigger_edge, info.tai_offset_ns, info.gain_db,
                 info.exposure_ns, info.line_status, info.sequence_step);
    info.window_count = 2;
    for (std::uint32_t w = 0; w < info.window_count; ++w) {
        FrameWindow& window = info.windows[w];
        numbers.fill(window.sensor, window.image_y, window.exposure_requested_ns, window.flags,
                     window.exposure_min_ns, window.exposure_max_ns);
        window.request = 1 - w;
    }
    frame.flags.store(frame_late | frame_degraded);
    frame.saturated_windows.store(2);
    for (RowTime& row : frame.row_times())
        numbers.fill(row.reset, row.read);
    fill_truth(info.truth, numbers);
    fill_quality(info.quality, numbers);
    frame.scene_truth()->entries.resize(2);
    for (TruthEntry& e : frame.scene_truth()->entries)
        fill_entry(e, numbers);
    frame.scene_truth()->entries_left_out = 5;
    frame.publish_scene_truth();
}

/// Hash of what each chunk adds to a block, in the order of Chunk.
std::vector<std::uint64_t> hashes(const Frame& frame, const Binning& binning) {
    constexpr std::uint32_t entries = 4;
    constexpr std::int64_t origin_ns = 12345;
    std::vector<std::uint64_t> all;
    for (std::uint32_t c = 0; c < chunk_count; ++c) {
        const std::uint32_t selection = 1U << c;
        std::vector<std::uint8_t> out(chunk_bytes(selection, frame.info.height / binning.vertical, entries),
                                      0xA5);
        REQUIRE(write_chunks(out, selection, frame, {77, 1000, true, origin_ns, {4, 9}, binning, entries}) ==
                out.size());
        all.push_back(fnv1a({reinterpret_cast<const char*>(out.data()), out.size()}));
    }
    return all;
}

} // namespace

TEST_CASE("every byte of every chunk is that of the published layout", "[gige]") {
    FramePool pool(1, 64 * 12, 12, {false, 8});
    const FrameRef frame = pool.acquire();
    REQUIRE(frame);
    fill(*frame);
    CHECK(hashes(*frame, {}) ==
          std::vector<std::uint64_t>{
              0xe30f63828f777fb7, 0x40753d69369dfa63, 0xab96c8f98b6d3a4a, 0x649d5e6bdc1d9e21,
              0x954e2eb8638d6c71, 0xcc98b9812689b6ac, 0x9f32dadda4f598ca, 0x38dc6689b935ea2b,
              0x2cc96869c5fb39b9, 0xeaa478975a975ff5, 0x58e8c9870ea2cf06, 0xee5597b3ef4890de,
              0x50d323824ab56c8c, 0xbe10b206c5db2299, 0xb8411a7abe45ee02, 0xbe7064db70186e93,
              0x21550104fcd31edc, 0xd4c966a65f4274c8, 0xcf13febf1c8f690c});
    CHECK(hashes(*frame, {2, 4}) ==
          std::vector<std::uint64_t>{
              0xe30f63828f777fb7, 0x40753d69369dfa63, 0xab96c8f98b6d3a4a, 0x649d5e6bdc1d9e21,
              0x33f06ca733c04611, 0xdb5b14f228cf03f5, 0x25f25aec410b61e4, 0xbc27c50fcd0bc206,
              0x2cc96869c5fb39b9, 0xeaa478975a975ff5, 0x58e8c9870ea2cf06, 0xb65d7c7273231b58,
              0xc1d39bfb755590c1, 0xbe10b206c5db2299, 0xb8411a7abe45ee02, 0xbe7064db70186e93,
              0x21550104fcd31edc, 0xfff5c3d825374a88, 0xcf13febf1c8f690c});
}

} // namespace chunk_data_test
