// SPDX-License-Identifier: Apache-2.0
// Frames that viewers have seen, whole, so that the very frame on a screen can be saved.
#pragma once

#include "transports/watch/frame_ring_reader.hpp"
#include "web/live/live_message.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace obscura::web {

/// A frame of a daemon.
struct KeptFrame {
    CameraId camera;
    std::uint64_t number = 0;    ///< of its daemon, as the call `frame` counts
    nlohmann::ordered_json head; ///< fields of the answer to the call `frame`
    std::size_t width = 0, height = 0;
    std::vector<std::uint16_t> pixels; ///< width x height, row-major

    [[nodiscard]] std::size_t bytes() const { return sizeof(std::uint16_t) * pixels.size(); }
};

/// A copy of a frame of the ring; it may have been overwritten meanwhile, see FrameRingReader::intact().
[[nodiscard]] std::shared_ptr<const KeptFrame> kept_frame(const CameraId& camera,
                                                          const transports::RingFrame& frame);

/// The newest frames of all cameras together, up to a number of bytes. Where these do not reach, the frames
/// go first that stand on no screen, oldest first. Thread-safe.
class KeptFrames {
public:
    static constexpr std::size_t max_bytes = std::size_t{32} << 20;

    explicit KeptFrames(std::size_t bytes = max_bytes) : most_(bytes) {}

    /// Does nothing with a frame that is there already, or is larger than all may be.
    void keep(std::shared_ptr<const KeptFrame> frame);
    /// Drops the frames of that process.
    void forget(std::int64_t pid);
    /// Null: not kept, or no more.
    [[nodiscard]] std::shared_ptr<const KeptFrame> find(const CameraId& camera, std::uint64_t number) const;

    using ViewerId = std::uint64_t;
    /// The viewer has been sent a view of that frame. It and the one before stand on its screen.
    void shown(ViewerId viewer, const CameraId& camera, std::uint64_t number);
    void left(ViewerId viewer);

private:
    struct Id {
        CameraId camera;
        std::uint64_t number = 0;
        bool operator==(const Id&) const = default;
    };
    using Frames = std::deque<std::shared_ptr<const KeptFrame>>;
    [[nodiscard]] Frames::const_iterator place(const Id& id) const;
    [[nodiscard]] bool is_shown(const Id& id) const;

    const std::size_t most_;
    mutable std::mutex mutex_; ///< of what follows
    Frames frames_;            ///< oldest first
    std::size_t bytes_ = 0;
    std::map<ViewerId, std::array<Id, 2>> shown_; ///< the later one first
};

} // namespace obscura::web
