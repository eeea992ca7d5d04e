// SPDX-License-Identifier: Apache-2.0
#include "transports/v4l2/v4l2_node.hpp"

#include "core/error.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace obscura::transports {

namespace {

struct FormatCode {
    std::uint32_t code;
    PixelFormat pixels;
};

FormatCode code_of(V4l2Format format) {
    switch (format) {
    case V4l2Format::grey:
        return {V4L2_PIX_FMT_GREY, PixelFormat::mono8};
    case V4l2Format::y10:
        return {V4L2_PIX_FMT_Y10, PixelFormat::mono10};
    case V4l2Format::y12:
        return {V4L2_PIX_FMT_Y12, PixelFormat::mono12};
    case V4l2Format::y14:
        return {V4L2_PIX_FMT_Y14, PixelFormat::mono14};
    case V4l2Format::y16:
        break;
    }
    return {V4L2_PIX_FMT_Y16, PixelFormat::mono16};
}

/// FourCC text of a pixel format. The code comes from the driver and is untrusted: unprintable bytes are
/// replaced.
std::string format_text(std::uint32_t code) {
    std::string text;
    for (int i = 0; i < 4; ++i) {
        const auto c = static_cast<char>(code >> (8 * i));
        text += c >= ' ' && c <= '~' ? c : '?';
    }
    return text.substr(0, text.find_last_not_of(' ') + 1);
}

std::string driver_text(const std::uint8_t* text, std::size_t size) {
    std::string result;
    for (std::size_t i = 0; i < size && text[i] != 0; ++i)
        result += text[i] >= ' ' && text[i] <= '~' ? static_cast<char>(text[i]) : '?';
    return result;
}

v4l2_buffer mapped_buffer(std::uint32_t index = 0) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    return buffer;
}

/// Upper limit of an image's side: beyond any sensor or driver, and far from overflow of sizes.
constexpr std::uint32_t max_side_px = 1u << 16;

} // namespace

V4l2Node::V4l2Node(V4l2Calls& calls, const V4l2Settings& settings, V4l2Image image, double frame_rate_hz)
    : calls_(calls),
      settings_(settings),
      frame_rate_hz_(frame_rate_hz),
      image_(image),
      pixel_format_(code_of(settings.format).pixels) {
    try {
        open();
        if (image_.width == 0) return;
        if (settings_.io != V4l2Io::write && can_stream_) {
            agree_on_format();
            map_buffers(static_cast<unsigned>(std::clamp(settings_.buffers, 2, VIDEO_MAX_FRAME)));
            if (find_out_queue() || settings_.io == V4l2Io::mmap || !can_write_) {
                // Start the stream now, so that consumers can start before the first image; drivers that need
                // an image first are started again after it.
                int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
                streaming_ = call(VIDIOC_STREAMON, &type) >= 0;
                return;
            }
            // Reopen: the simplest way to free the buffers in every version of the driver.
            close();
            open();
        }
        agree_on_format();
        image_store_.assign(image_bytes(), 0);
        // Loopback drivers up to 0.12 need STREAMON, newer and strict ones refuse it; write() works either
        // way.
        int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
        call(VIDIOC_STREAMON, &type);
    } catch (...) {
        close();
        throw;
    }
}

V4l2Node::~V4l2Node() {
    close();
}

void V4l2Node::refuse(const std::string& why) const {
    throw HardwareError(fmt::format("v4l2: {}: {}", settings_.device, why));
}

int V4l2Node::call(unsigned long request, void* argument) noexcept {
    return calls_.ioctl(fd_, request, argument);
}

void V4l2Node::open() {
    fd_ = calls_.open(settings_.device.c_str());
    switch (fd_ < 0 ? -fd_ : 0) {
    case 0:
        break;
    case ENOENT:
    case ENODEV:
    case ENXIO:
        refuse("is not there");
    case EACCES:
    case EPERM:
        refuse("may not be opened for reading and writing (is the user in the group of the node?)");
    case EBUSY:
        refuse("is in use by another program");
    default:
        refuse(fmt::format("cannot be opened: {}", std::strerror(-fd_)));
    }
    check_capabilities();
}

void V4l2Node::check_capabilities() {
    v4l2_capability capability{};
    const int result = calls_.is_character_device(fd_) ? call(VIDIOC_QUERYCAP, &capability) : -ENOTTY;
    if (result == -ENODEV) refuse("is not there");
    if (result < 0) refuse("is not a V4L2 node");
    const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                    : capability.capabilities;
    card_ = fmt::format("{} \"{}\"", driver_text(capability.driver, sizeof(capability.driver)),
                        driver_text(capability.card, sizeof(capability.card)));
    if ((can & V4L2_CAP_VIDEO_OUTPUT) == 0)
        refuse(fmt::format("{} is no video output{} (a v4l2loopback or another output node is needed)", card_,
                           (can & V4L2_CAP_VIDEO_OUTPUT_MPLANE) != 0 ? " with one plane"
                           : (can & V4L2_CAP_VIDEO_CAPTURE) != 0     ? " but a capture node"
                                                                     : ""));
    can_stream_ = (can & V4L2_CAP_STREAMING) != 0;
    can_write_ = (can & V4L2_CAP_READWRITE) != 0;
    if (!can_stream_ && !can_write_) refuse(fmt::format("{} takes neither write() nor buffers", card_));
    if (settings_.io == V4l2Io::mmap && !can_stream_)
        refuse(fmt::format("{} has no mmap, only write()", card_));
    if (settings_.io == V4l2Io::write && !can_write_)
        refuse(fmt::format("{} has no write(), only mmap", card_));
}

void V4l2Node::agree_on_format() {
    const FormatCode wanted = code_of(settings_.format);
    const auto width = static_cast<std::uint32_t>(image_.width);
    const auto height = static_cast<std::uint32_t>(image_.height);
    if (width > max_side_px || height == 0 || height > max_side_px)
        refuse(fmt::format("cannot show {}x{} pixels", image_.width, image_.height));
    if (settings_.frame_counter && width < 4) refuse("a frame counter needs images 4 pixels wide");
    const auto row_bytes = static_cast<std::uint32_t>(packed_row_bytes(wanted.pixels, image_.width));

    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    v4l2_pix_format& pixels = format.fmt.pix;
    pixels.width = width;
    pixels.height = height;
    pixels.pixelformat = wanted.code;
    pixels.field = V4L2_FIELD_NONE;
    pixels.bytesperline = row_bytes;
    pixels.sizeimage = row_bytes * height;
    pixels.colorspace = V4L2_COLORSPACE_RAW;
    const std::string asked = fmt::format("{} {}x{}", name_of(settings_.format), width, height);
    switch (const int result = call(VIDIOC_S_FMT, &format); result < 0 ? -result : 0) {
    case 0:
        break;
    case EBUSY:
        refuse(fmt::format("another program uses it and holds its format; {} is needed", asked));
    case ENODEV:
        refuse("is not there");
    default:
        refuse(fmt::format("{} refused: {}", asked, std::strerror(-result)));
    }
    if (pixels.pixelformat != wanted.code || pixels.width != width || pixels.height != height)
        refuse(fmt::format("the driver made {} {}x{} of {} (does another program hold the format?)",
                           format_text(pixels.pixelformat), pixels.width, pixels.height, asked));
    if (pixels.field != V4L2_FIELD_NONE && pixels.field != V4L2_FIELD_ANY)
        refuse(fmt::format("the driver made {} interlaced (field {})", asked, pixels.field));
    if (pixels.bytesperline < row_bytes)
        refuse(fmt::format("the driver counts {} bytes a row for {}, {} are needed", pixels.bytesperline,
                           asked, row_bytes));
    if (std::uint64_t{pixels.bytesperline} * height > pixels.sizeimage)
        refuse(fmt::format("the driver counts {} bytes an image for {}, {} are needed", pixels.sizeimage,
                           asked, std::uint64_t{pixels.bytesperline} * height));
    stride_ = pixels.bytesperline;
    rows_ = height;

    if (frame_rate_hz_ > 0) {
        // The frame rate is a hint for consumers only; many drivers do not support it.
        v4l2_streamparm rate{};
        rate.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
        rate.parm.output.timeperframe = {
            1000, static_cast<std::uint32_t>(std::clamp(std::round(frame_rate_hz_ * 1000), 1.0, 4e9))};
        call(VIDIOC_S_PARM, &rate);
    }
}

void V4l2Node::map_buffers(unsigned count) {
    v4l2_requestbuffers request{};
    request.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    request.memory = V4L2_MEMORY_MMAP;
    request.count = count;
    if (const int result = call(VIDIOC_REQBUFS, &request); result == -EBUSY)
        refuse("another program streams to it");
    else if (result < 0)
        refuse(fmt::format("no buffers available: {}", std::strerror(-result)));
    if (request.count == 0) refuse("no buffers available");
    for (std::uint32_t i = 0; i < std::min<std::uint32_t>(request.count, VIDEO_MAX_FRAME); ++i) {
        v4l2_buffer buffer = mapped_buffer(i);
        if (const int result = call(VIDIOC_QUERYBUF, &buffer); result < 0)
            refuse(fmt::format("buffer {} cannot be asked for: {}", i, std::strerror(-result)));
        if (buffer.length < image_bytes())
            refuse(fmt::format("buffer {} holds {} bytes, {} are needed", i, buffer.length, image_bytes()));
        int error = 0;
        void* data = calls_.map(fd_, buffer.m.offset, buffer.length, error);
        if (data == nullptr) refuse(fmt::format("buffer {} cannot be mapped: {}", i, std::strerror(error)));
        mappings_.push_back({static_cast<std::uint8_t*>(data), buffer.length});
        free_.insert(free_.begin(), i);
    }
    if (mappings_.size() < 4)
        warning_ = fmt::format(
            "v4l2: {}: only {} buffers, so a slow consumer may see an image change while it reads (v4l2loopback: load it with max_buffers=8)",
            settings_.device, mappings_.size());
}

bool V4l2Node::find_out_queue() {
    v4l2_buffer first = mapped_buffer(), second = mapped_buffer();
    queue_ = Queue::in_order;
    if (call(VIDIOC_DQBUF, &first) < 0) return true;
    queue_ = Queue::round_robin;
    image_store_.assign(image_bytes(), 0);
    return call(VIDIOC_DQBUF, &second) < 0 || first.index != second.index;
}

void V4l2Node::unmap_buffers() noexcept {
    for (const Mapping& mapping : mappings_)
        calls_.unmap(mapping.data, mapping.size);
    mappings_.clear();
    free_.clear();
}

void V4l2Node::close() noexcept {
    if (fd_ < 0) return;
    if (streaming_) {
        int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
        call(VIDIOC_STREAMOFF, &type);
        streaming_ = false;
    }
    unmap_buffers();
    calls_.close(fd_);
    fd_ = -1;
}

V4l2Result V4l2Node::lose(const char* doing, int error) noexcept {
    failed_doing_ = doing;
    failed_error_ = error;
    return V4l2Result::lost;
}

std::string V4l2Node::problem() const {
    if (failed_error_ == ENODEV) return fmt::format("v4l2: {}: is gone", settings_.device);
    return fmt::format("v4l2: {}: {}: {}", settings_.device, failed_doing_,
                       failed_error_ != 0 ? std::strerror(failed_error_) : "the driver took only a part");
}

bool V4l2Node::alive() noexcept {
    v4l2_capability capability{};
    const int result = call(VIDIOC_QUERYCAP, &capability);
    if (result < 0) lose("asking whether it is there", -result);
    return result >= 0;
}

std::uint8_t* V4l2Node::place() noexcept {
    return writes() || queue_ == Queue::round_robin ? image_store_.data()
                                                    : mappings_[static_cast<std::size_t>(acquired_)].data;
}

V4l2Result V4l2Node::acquire(std::int64_t timeout_ns) noexcept {
    if (writes() || acquired_ >= 0) return V4l2Result::ok;
    if (queue_ == Queue::round_robin) {
        acquired_ = static_cast<int>(turn_++ % mappings_.size());
        return V4l2Result::ok;
    }
    if (!free_.empty()) {
        acquired_ = static_cast<int>(free_.back());
        free_.pop_back();
        return V4l2Result::ok;
    }
    for (bool waited = false;; waited = true) {
        v4l2_buffer buffer = mapped_buffer();
        const int result = call(VIDIOC_DQBUF, &buffer);
        if (result >= 0) {
            if (buffer.index >= mappings_.size()) return lose("getting a buffer back", EIO);
            if (in_flight_ > 1 && buffer.index == last_queued_) return V4l2Result::out_of_order;
            --in_flight_;
            acquired_ = static_cast<int>(buffer.index);
            return V4l2Result::ok;
        }
        if (result != -EAGAIN) return lose("getting a buffer back", -result);
        if (waited) return V4l2Result::busy;
        const int ready = calls_.wait_writable(fd_, timeout_ns);
        if (ready < 0) return lose("waiting for a buffer", -ready);
        if (ready == 0) return V4l2Result::busy;
    }
}

void V4l2Node::fill(const Frame& frame, std::int32_t first, std::int32_t last) noexcept {
    assert(frame.info.width == image_.width && frame.info.height == image_.height);
    const std::size_t row_bytes = packed_row_bytes(pixel_format_, image_.width);
    for (std::int32_t y = first; y < last; ++y) {
        std::uint8_t* row = place() + static_cast<std::size_t>(y) * stride_;
        pack_pixels(pixel_format_, frame.info.bits_per_pixel, frame.row(y), {row, row_bytes});
        std::memset(row + row_bytes, 0, stride_ - row_bytes);
    }
}

V4l2Result V4l2Node::send(std::uint64_t frame_id, Time edge, std::int64_t timeout_ns) noexcept {
    if (settings_.frame_counter) {
        const std::size_t step = pixel_format_ == PixelFormat::mono8 ? 1 : 2;
        for (std::size_t i = 0; i < 4; ++i) {
            place()[i * step] = static_cast<std::uint8_t>(frame_id >> (8 * i));
            if (step == 2) place()[i * step + 1] = 0;
        }
    }
    if (writes()) {
        for (bool waited = false;; waited = true) {
            const ssize_t taken = calls_.write(fd_, image_store_.data(), image_store_.size());
            if (taken == static_cast<ssize_t>(image_store_.size())) return V4l2Result::ok;
            if (taken >= 0) return lose("writing an image", 0);
            if (taken != -EAGAIN) return lose("writing an image", static_cast<int>(-taken));
            if (waited) return V4l2Result::busy;
            const int ready = calls_.wait_writable(fd_, timeout_ns);
            if (ready < 0) return lose("waiting to write", -ready);
            if (ready == 0) return V4l2Result::busy;
        }
    }
    const auto index = static_cast<std::uint32_t>(acquired_);
    if (queue_ == Queue::round_robin) std::memcpy(mappings_[index].data, image_store_.data(), image_bytes());
    v4l2_buffer buffer = mapped_buffer(index);
    buffer.bytesused = static_cast<std::uint32_t>(image_bytes());
    buffer.field = V4L2_FIELD_NONE;
    buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
    buffer.timestamp.tv_sec = edge.ns / ns_per_s;
    buffer.timestamp.tv_usec = edge.ns % ns_per_s / ns_per_us;
    if (const int result = call(VIDIOC_QBUF, &buffer); result < 0) return lose("queueing an image", -result);
    acquired_ = -1;
    last_queued_ = index;
    ++in_flight_;
    if (!streaming_) {
        int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
        if (const int result = call(VIDIOC_STREAMON, &type); result < 0)
            return lose("starting the stream", -result);
        streaming_ = true;
    }
    return V4l2Result::ok;
}

std::string V4l2Node::describe() const {
    if (image_.width == 0)
        return fmt::format("v4l2: {}: {}, waiting for the first frame", settings_.device, card_);
    const char* stamps =
        writes() ? "time stamps are the driver's at write()" : "time stamps are the trigger edges";
    return fmt::format("v4l2: {}: {}, {} {}x{}, {}-bit data{}, {}; {}", settings_.device, card_,
                       name_of(settings_.format), image_.width, image_.height, image_.bits_per_pixel,
                       settings_.format == V4l2Format::grey ? " shown by its high 8 bits"
                                                            : " aligned to the low bit",
                       writes() ? "write()" : fmt::format("mmap with {} buffers", mappings_.size()), stamps);
}

} // namespace obscura::transports
