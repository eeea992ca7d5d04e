// SPDX-License-Identifier: Apache-2.0
// Layout of the frame ring: the newest frames of a camera in memory that other processes may read.
#pragma once

#include "core/camera/frame.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace obscura::transports {

// Numbers stand in the byte order of the machine. A reader refuses another magic or version.
inline constexpr std::array<char, 8> frame_ring_magic{'O', 'B', 'S', 'C', 'R', 'I', 'N', 'G'};
inline constexpr std::uint32_t frame_ring_version = 1;

/// First bytes of the ring; constant but for `newest`.
struct FrameRingHead {
    std::array<char, 8> magic{};
    std::uint32_t version = 0, slots = 0;
    std::uint64_t slots_at = 0;   ///< bytes from the begin of the ring to its first slot
    std::uint64_t slot_bytes = 0; ///< from one slot to the next
    std::uint64_t pixels_at = 0;  ///< bytes from the begin of a slot to its pixels, 16-bit words
    std::uint64_t max_pixels = 0; ///< of a frame
    /// Serial number of the frame written last, from 1 on; 0: none. Frame s stands in slot s % slots.
    std::uint64_t newest = 0;
};

/// What FrameInfo says of the frame.
struct FrameRingHeader {
    std::uint64_t number = 0; ///< counts the frames that were looked at, also those left out, from 1
    std::uint64_t frame_id = 0, trigger_id = 0;
    std::int64_t edge_tai_ns = 0, mid_exposure_tai_ns = 0, exposure_ns = 0;
    double gain_db = 0;
    std::uint32_t width = 0, height = 0; ///< of the image
    std::uint32_t bits = 0;              ///< digital numbers are less than 2^bits
    std::uint32_t rows = 0;              ///< that are there; the others are 0
    std::uint32_t flags = 0;             ///< FrameFlag
    std::uint32_t windows = 0;           ///< that the image is composed of
    std::int32_t x = 0, y = 0;           ///< of the first window on the sensor
};

/// Position in metres and quaternion w, x, y, z from own axes to inertial ones.
struct FrameRingPose {
    std::array<double, 3> position_m{};
    std::array<double, 4> orientation{};
};

/// What GroundTruth says of the frame, at mid-exposure.
struct FrameRingTruth {
    struct Body {
        std::array<char, 32> name{}; ///< zero terminated
        FrameRingPose pose;
    };
    FrameRingPose camera;
    std::array<double, 3> sun_position_m{};
    std::array<double, 2> focal_length_px{}, principal_point_px{};
    std::uint64_t body_count = 0;
    std::array<Body, max_truth_bodies> bodies{};
};

/// Begin of a slot.
struct FrameRingSlot {
    /// 0 while the slot is written, then the serial number of its frame. Who reads looks at it before and
    /// after.
    std::uint64_t sequence = 0;
    FrameRingHeader header;
    FrameRingTruth truth;
};

static_assert(std::is_trivially_copyable_v<FrameRingSlot> && sizeof(FrameRingSlot) % 8 == 0);
static_assert(sizeof(FrameRingHead) == 56 && sizeof(FrameRingHeader) == 88 && sizeof(FrameRingTruth) == 1528);

} // namespace obscura::transports
