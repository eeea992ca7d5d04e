// SPDX-License-Identifier: Apache-2.0
// Chunk ids and layouts: the data appended to the pixels of a frame.
#pragma once

#include <cstddef>
#include <cstdint>

namespace obscura::transports::gige {

/// The chunks, in the order of ChunkSelector and of the payload; the value is the bit in a selection and the
/// low part of the chunk id (chunk_id()); the image itself is chunk_id_base. All numbers are big endian,
/// instants are device time in ns.
enum class Chunk : std::uint8_t {
    timestamp,     ///< u64: time of the trigger edge
    exposure_time, ///< f64, us, as requested
    gain,          ///< f64, dB
    frame_id,      ///< u64
    width,         ///< u32
    height,        ///< u32
    offset_x,      ///< u32
    offset_y,      ///< u32
    pixel_format,  ///< u32, PFNC
    trigger_id,    ///< u64
    /// u32: core's FrameFlag; bits 8 and 9: state of the trigger's clock (core/camera/frame_flags.hpp)
    frame_flags,
    /// u32 count, u32 0, then 32 x {u32 x, y, width, height, image_y, flags; u64 exposure in ns: requested,
    /// least and most obtained over its rows}
    regions,
    row_times, ///< u32 count, u32 0, then per row {u64 reset, u64 read}
    /// u64 mid-exposure; f64[3] camera position, f64[4] attitude (scalar first, camera to inertial), f64[3]
    /// Sun position (metres, inertial), u64 seed, u32 bodies, u32 run word; then 16 x {char name[32], f64[3]
    /// position, f64[4] attitude}; f64[2] focal length over the pitches, px; f64[2] principal point on the
    /// sensor, px; f64[2] pitches of the sensor's pixels, um
    ground_truth,
    line_status_all,      ///< u32: levels of the inputs at the trigger edge
    sequencer_set_active, ///< u32
    /// u32 count, then 32 x u32: region number of each window in the image
    region_id,
    /// u32 count, u32 further entries that found no room, then truth_entry_bytes for each of the entries that
    /// the camera sends at most: u32 kind, visibility, flags (1 lit, 2 saturated), window; i32 object, item;
    /// char name[32]; f64 x, y, px of the image; u64 time, u64 exposure in ns; f64 range in m, visible share,
    /// V magnitude, irradiance in W/m2, signal and peak in electrons, SNR; f64 x, y, px, of the PSF in the
    /// position. Kind: TruthKind, visibility: TruthVisibility (core/camera/scene_truth.hpp); NaN: not known
    truth_table,
    /// FrameQuality (core/camera/frame_quality.hpp): u32 worst level, reasons, groups, rows of a group,
    /// bounces, bounces asked for, rows degraded, tiles missing; f64 error rms, error of the worst group,
    /// share without an estimate, samples: mean, median, least, share on cells wider than asked for, worst
    /// factor of those; i64 budget, spent, margin in us; f64[10] share of the rows by level; u8[256] level of
    /// each group; u32 instants, rows reprojected, rows repeated, 0; f64 error goal, error over detector
    /// noise
    frame_quality,
};
constexpr std::size_t chunk_count = 19;
constexpr std::size_t truth_entry_bytes = 160;
constexpr std::size_t frame_quality_bytes = 488;
constexpr std::uint32_t chunk_id_base = 0x4F420000;
constexpr std::size_t chunk_tag_bytes = 8;

constexpr std::uint32_t chunk_bit(Chunk c) noexcept {
    return 1U << static_cast<unsigned>(c);
}

constexpr std::uint32_t chunk_id(Chunk c) noexcept {
    return chunk_id_base + 1 + static_cast<std::uint32_t>(c);
}

} // namespace obscura::transports::gige
