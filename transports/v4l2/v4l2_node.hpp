// One opened V4L2 output node: format agreed on, buffers mapped, images going out one by one.
#pragma once

#include "core/frame.hpp"
#include "transports/v4l2/settings.hpp"
#include "transports/v4l2/v4l2_calls.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace obscura::transports {

/// The image that a node was opened for.
struct V4l2Image {
    std::int32_t width = 0, height = 0;
    int bits_per_pixel = 16;

    bool operator==(const V4l2Image&) const = default;
};

/// What became of an image.
enum class V4l2Result : std::uint8_t {
    ok,
    busy,        ///< the driver has no buffer free; a later image may go out
    lost,        ///< the node is of no use any more (`problem()` says why); open another
    out_of_order ///< the driver gave back a buffer that it may still be showing; open again with write()
};

/// Rules learnt from v4l2loopback 0.12.7, 0.13.2 and 0.15.0 and from vivid (tests/kernel):
/// - S_FMT answers 0 with another format when the node's format is held by another program, and with a stride
///   that is too small for formats whose depth it counts in bits. So everything in the answer is checked.
/// - `bytesused` is stride x height, never `sizeimage`, which is rounded up to pages: consumers drop images
///   that are longer than expected.
/// - DQBUF of loopback drivers before 0.15 returns the buffer queued last, which consumers are reading. They
///   can be told apart without showing an image: with nothing queued they give the same buffer twice, newer
///   ones two different ones, strict drivers none.
/// - Newer loopback drivers take the buffer that was asked back last for the one that holds the last image,
/// when
///   a consumer sets itself up in that moment. So theirs are never asked back: they have no queue anyway.
/// - A time stamp once given with a buffer must always be given.
///
/// One thread. Owns the descriptor and the mappings.
class V4l2Node {
public:
    /// Opens and agrees on everything. Without an image (width 0) the node is only looked at. `frame_rate_hz`
    /// is announced to the driver unless it is 0. Throws HardwareError with one line.
    V4l2Node(V4l2Calls& calls, const V4l2Settings& settings, V4l2Image image, double frame_rate_hz = 0);
    ~V4l2Node();
    V4l2Node(const V4l2Node&) = delete;
    V4l2Node& operator=(const V4l2Node&) = delete;

    [[nodiscard]] const V4l2Image& image() const noexcept { return image_; }
    [[nodiscard]] bool writes() const noexcept { return mappings_.empty(); }
    [[nodiscard]] std::size_t image_bytes() const noexcept { return stride_ * rows_; }
    /// One line for people: driver, format, depth, way of transfer, whose time stamps.
    [[nodiscard]] std::string describe() const;
    /// What people should know although it works; empty when nothing.
    [[nodiscard]] const std::string& warning() const noexcept { return warning_; }

    /// Gets a place for the next image, waiting for one at most `timeout_ns`. Until send() the place stays
    /// ours, whatever becomes of the image.
    V4l2Result acquire(std::int64_t timeout_ns) noexcept;
    /// Puts rows [first, last) of `frame` into the place acquired. They must be final.
    void fill(const Frame& frame, std::int32_t first, std::int32_t last) noexcept;
    /// Hands the image over, whole, with the time stamp `edge` where the driver takes one. In write() mode it
    /// waits like acquire().
    V4l2Result send(std::uint64_t frame_id, Time edge, std::int64_t timeout_ns) noexcept;
    /// Whether the node still exists.
    [[nodiscard]] bool alive() noexcept;
    /// Why the last result was `lost`.
    [[nodiscard]] std::string problem() const;

private:
    struct Mapping {
        std::uint8_t* data = nullptr;
        std::size_t size = 0;
    };
    enum class Queue : std::uint8_t {
        in_order,   ///< a queue: buffers come back when the driver is done with them
        round_robin ///< no queue: buffers are used in turn and never asked back
    };

    void open();
    void check_capabilities();
    void agree_on_format();
    void map_buffers(unsigned count);
    void unmap_buffers() noexcept;
    /// Whether mmap is safe; sets `queue_`.
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
    /// The image while it is made, in write() mode and where consumers can read a buffer at any time.
    std::vector<std::uint8_t> image_store_;
    std::vector<Mapping> mappings_;
    std::vector<std::uint32_t> free_; ///< buffers not yet queued; the back is next
    Queue queue_ = Queue::in_order;
    int acquired_ = -1; ///< buffer that is being filled
    std::uint32_t last_queued_ = 0, in_flight_ = 0, turn_ = 0;
    bool streaming_ = false;
    const char* failed_doing_ = "";
    int failed_error_ = 0;
};

} // namespace obscura::transports
