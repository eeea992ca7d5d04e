// SPDX-License-Identifier: Apache-2.0
// Calls `ring` and `watch`: the memory of a camera's newest frames for other processes of this machine.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "emulator/control/camera_calls.hpp"

#include <array>
#include <cstddef>
#include <functional>

namespace obscura::emulator {

/// Files of one reader of a camera's frame ring: its memory, and an eventfd that each frame signals.
using RingFiles = std::array<FileDescriptor, 2>;

/// A new reader's files of the ring. Throws HardwareError. Of one thread at a time.
[[nodiscard]] RingFiles hand_over_ring(const ControlledCamera& camera);

/// The rows. `files` calls hand_over_ring() for a camera that has a ring, on the thread that is for that; it
/// throws Failure or HardwareError. `cameras` outlives them.
[[nodiscard]] service::Calls ring_calls(const CameraCalls::Cameras& cameras,
                                        std::function<RingFiles(std::size_t camera)> files);

} // namespace obscura::emulator
