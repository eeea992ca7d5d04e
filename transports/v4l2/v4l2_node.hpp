// SPDX-License-Identifier: Apache-2.0
// Opened V4L2 output node: format negotiation, mapped buffers, output of single images.
#pragma once

#include "core/camera/frame.hpp"
#include "transports/v4l2/settings.hpp"
#include "transports/v4l2/v4l2_calls.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace obscura::transports {

/// Size and depth of the image that a node was opened for.
struct V4l2Image {
    std::int32_t width = 0, height = 0;
    int bits_per_pixel = 16;

    bool operator==(const V4l2Image&) const = default;
};

/// Result of an output call.
enum class V4l2Result : std::uint8_t {
    ok,
    busy, ///< the driver has no free buffer; a later image may succeed
    lost, ///< the node is unusable (see problem()); open a new one
    /// The driver returned a buffer that it may still be showing; open a new node with write().
    out_of_order
};

/// Rules learnt from v4l2loopback 0.12.7, 0.13.2 and 0.15.0 and from vivid (tests/kernel):
/// - S_FMT answers 0 with another format when the node's format is held by another program, and with a stride
///   that is too small for formats whose depth it counts in bits. So everything in the answer is checked.
/// - `bytesused` is stride x height, never `sizeimage`, which is rounded up to pages: consumers drop images
///   that are longer than expected.
/// - DQBUF of loopback drivers before 0.15 returns the buffer queued last, which consumers are reading. They
///   can be told apart without showing an image: with nothing queued they give the same buffer twice, newer
///   ones two different ones, strict drivers none.
/// - Newer loopback drivers assume that the buffer dequeued last holds the last image if a consumer starts at
///   that moment. So their buffers are never dequeued: these drivers have no queue anyway.
/// - A time stamp once given with a buffer must always be given.
///
/// Thread-bound. Owns the descriptor and the mappings.
class V4l2Node {
public:
    /// Opens the node and negotiates the format. Without an image (width 0) only the capabilities are
    /// checked. `frame_rate_hz` is announced to the driver unless it is 0. Throws HardwareError with a
    /// one-line message.
    V4l2Node(V4l2Calls& calls, const V4l2Settings& settings, V4l2Image image, double frame_rate_hz = 0);
    ~V4l2Node();
    V4l2Node(const V4l2Node&) = delete;
    V4l2Node& operator=(const V4l2Node&) = delete;

    [[nodiscard]] const V4l2Image& image() const noexcept { return image_; }
    [[nodiscard]] bool writes() const noexcept { return mappings_.empty(); }
    [[nodiscard]] std::size_t image_bytes() const noexcept { return stride_ * rows_; }
    /// One line for the log: driver, format, depth, I/O method, origin of time stamps.
    [[nodiscard]] std::string describe() const;
    /// Limitation of the driver that users should know; empty: none.
    [[nodiscard]] const std::string& warning() const noexcept { return warning_; }

    /// Acquires a buffer for the next image within `timeout_ns`. The buffer stays acquired until send(), also
    /// if the image is abandoned.
    V4l2Result acquire(std::int64_t timeout_ns) noexcept;
    /// Packs rows [first, last) of `frame`, which must be final, into the acquired buffer.
    void fill(const Frame& frame, std::int32_t first, std::int32_t last) noexcept;
    /// Passes the full image to the driver, with the time stamp `edge` if the driver accepts one. In write()
    /// mode it waits like acquire().
    V4l2Result send(std::uint64_t frame_id, Time edge, std::int64_t timeout_ns) noexcept;
    /// True while the node exists.
    [[nodiscard]] bool alive() noexcept;
    /// Cause of the last result `lost`, one line.
    [[nodiscard]] std::string problem() const;

private:
    struct Mapping {
        std::uint8_t* data = nullptr;
        std::size_t size = 0;
    };
    enum class Queue : std::uint8_t {
        in_order,   ///< a queue: the driver returns buffers when it has shown them
        round_robin ///< no queue: buffers are used in turn and never dequeued
    };

    void open();
    void check_capabilities();
    void agree_on_format();
    void map_buffers(unsigned count);
    void unmap_buffers() noexcept;
    /// Determines the queue type and sets `queue_`. Returns false if mmap is not safe.
    bool find_out_queue();
    void close() noexcept;
    [[noreturn]] void refuse(const std::string& why) const;
    int call(unsigned long request, void* argument) noexcept;
    V4l2Result lose(const char* doing, int error) noexcept;
    std::uint8_t* place() noexcept;

    V4l2Calls& calls_;
    const V4l2Settings settings_;
    const double frame_rate_hz_;
    const V4l2Image image_;
    const PixelFormat pixel_format_;
    int fd_ = -1;
    std::string card_, warning_;
    bool can_stream_ = false, can_write_ = false;
    std::size_t stride_ = 0, rows_ = 0;
    /// Image under construction, in write() mode and for drivers whose consumers may read a buffer at any
    /// time.
    std::vector<std::uint8_t> image_store_;
    std::vector<Mapping> mappings_;
    std::vector<std::uint32_t> free_; ///< buffers not queued; the last is used next
    Queue queue_ = Queue::in_order;
    int acquired_ = -1; ///< buffer acquired for the next image; -1: none
    std::uint32_t last_queued_ = 0, in_flight_ = 0, turn_ = 0;
    bool streaming_ = false;
    const char* failed_doing_ = "";
    int failed_error_ = 0;
};

} // namespace obscura::transports
