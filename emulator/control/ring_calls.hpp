// SPDX-License-Identifier: Apache-2.0
// Calls `ring` and `watch`: the memory of a camera's newest frames for other processes of this machine.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "emulator/control/camera_calls.hpp"

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace obscura::emulator {

/// Transport that copies the frames of each camera, null where there is none.
using WatchedCameras = std::vector<transports::WatchTransport*>;
/// Files of one reader of a camera's frame ring: its memory, and an eventfd that each frame signals.
using RingFiles = std::array<FileDescriptor, 2>;

/// A new reader's files of the ring. Throws HardwareError. Of one thread at a time.
[[nodiscard]] RingFiles hand_over_ring(transports::WatchTransport& watch);

/// The rows. `files` calls hand_over_ring() for one of `cameras`, on the thread that is for that; it throws
/// Failure or HardwareError. What `cameras` point to outlives the rows.
[[nodiscard]] service::Calls ring_calls(const WatchedCameras& cameras,
                                        std::function<RingFiles(std::size_t camera)> files);

} // namespace obscura::emulator
