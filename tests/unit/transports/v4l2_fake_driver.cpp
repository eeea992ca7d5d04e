// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/transports/v4l2_fake_driver.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace obscura::test {

namespace {

std::uint32_t rounded_up(std::uint32_t value, std::uint32_t step) {
    return (value + step - 1) / step * step;
}

std::string name_of(unsigned long request) {
    switch (request) {
    case VIDIOC_QUERYCAP:
        return "QUERYCAP";
    case VIDIOC_S_FMT:
        return "S_FMT";
    case VIDIOC_S_PARM:
        return "S_PARM";
    case VIDIOC_REQBUFS:
        return "REQBUFS";
    case VIDIOC_QUERYBUF:
        return "QUERYBUF";
    case VIDIOC_QBUF:
        return "QBUF";
    case VIDIOC_DQBUF:
        return "DQBUF";
    case VIDIOC_STREAMON:
        return "STREAMON";
    case VIDIOC_STREAMOFF:
        return "STREAMOFF";
    default:
        return "unknown ioctl";
    }
}

} // namespace

void FakeV4l2Driver::remove() {
    const std::lock_guard lock(mutex_);
    present_ = false;
    for (auto& [fd, stands] : descriptors_)
        stands = false;
    streaming_ = false;
}

void FakeV4l2Driver::give_back() {
    const std::lock_guard lock(mutex_);
    present_ = true;
    for (Buffer& buffer : buffers_)
        graveyard_.push_back(std::move(buffer.memory));
    buffers_.clear();
    order_.clear();
}

std::vector<FakeV4l2Driver::Image> FakeV4l2Driver::images() const {
    const std::lock_guard lock(mutex_);
    return images_;
}
std::size_t FakeV4l2Driver::image_count() const {
    const std::lock_guard lock(mutex_);
    return images_.size();
}
std::vector<std::string> FakeV4l2Driver::complaints() const {
    const std::lock_guard lock(mutex_);
    return complaints_;
}
int FakeV4l2Driver::open_descriptors() const {
    const std::lock_guard lock(mutex_);
    return static_cast<int>(descriptors_.size());
}
int FakeV4l2Driver::open_mappings() const {
    const std::lock_guard lock(mutex_);
    return mappings_;
}
int FakeV4l2Driver::calls(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    const auto found = calls_.find(name);
    return found == calls_.end() ? 0 : found->second;
}
std::pair<std::uint32_t, std::uint32_t> FakeV4l2Driver::frame_interval() const {
    const std::lock_guard lock(mutex_);
    return interval_;
}

int FakeV4l2Driver::enter(const std::string& call, int fd) {
    ++calls_[call];
    if (fd >= 0) {
        const auto found = descriptors_.find(fd);
        if (found == descriptors_.end()) {
            complaints_.push_back(call + " on a closed descriptor");
            return -EBADF;
        }
        if (!found->second) return -ENODEV;
    }
    return fault ? std::min(fault(call), 0) : 0;
}

int FakeV4l2Driver::open(const char* name) {
    const std::lock_guard lock(mutex_);
    if (const int error = enter("open", -1); error < 0) return error;
    if (name != path || !present_) return -ENOENT;
    descriptors_[next_fd_] = true;
    return next_fd_++;
}

int FakeV4l2Driver::close(int fd) {
    const std::lock_guard lock(mutex_);
    if (descriptors_.erase(fd) == 0) complaints_.emplace_back("close of a closed descriptor");
    for (Buffer& buffer : buffers_)
        graveyard_.push_back(std::move(buffer.memory));
    buffers_.clear();
    order_.clear();
    streaming_ = false;
    return 0;
}

bool FakeV4l2Driver::is_character_device(int) {
    return character_device;
}

int FakeV4l2Driver::ioctl(int fd, unsigned long request, void* argument) {
    const std::lock_guard lock(mutex_);
    if (const int error = enter(name_of(request), fd); error < 0) return error;
    switch (request) {
    case VIDIOC_QUERYCAP: {
        auto& capability = *static_cast<v4l2_capability*>(argument);
        std::memcpy(capability.driver, "fake", 5);
        std::memcpy(capability.card, "Fake\nnode", 10); // with a character that must not reach a log
        capability.device_caps = capabilities != 0
                                     ? capabilities
                                     : V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING | V4L2_CAP_READWRITE;
        capability.capabilities = V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | capability.device_caps;
        return 0;
    }
    case VIDIOC_S_FMT: {
        auto& pixels = static_cast<v4l2_format*>(argument)->fmt.pix;
        if (!buffers_.empty()) return -EBUSY;
        pixels.bytesperline += stride_extra;
        pixels.sizeimage = rounded_up(pixels.bytesperline * pixels.height, buffer_page);
        if (change_format)
            change_format(pixels.pixelformat, pixels.width, pixels.height, pixels.bytesperline,
                          pixels.sizeimage, pixels.field);
        stride_ = pixels.bytesperline;
        height_ = pixels.height;
        size_ = pixels.sizeimage;
        return 0;
    }
    case VIDIOC_S_PARM: {
        const auto& time = static_cast<v4l2_streamparm*>(argument)->parm.output.timeperframe;
        interval_ = {time.numerator, time.denominator};
        return 0;
    }
    case VIDIOC_REQBUFS: {
        auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
        wanted.count = std::min(wanted.count, buffers_most);
        for (Buffer& buffer : buffers_)
            graveyard_.push_back(std::move(buffer.memory));
        buffers_.assign(wanted.count, {});
        order_.clear();
        for (std::uint32_t i = 0; i < wanted.count; ++i) {
            buffers_[i].memory.assign(size_, 0xEE);
            if (kind != Kind::strict) order_.push_back(i);
        }
        return 0;
    }
    case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        if (buffer.index >= buffers_.size()) return -EINVAL;
        buffer.length = size_;
        buffer.m.offset = buffer.index;
        return 0;
    }
    case VIDIOC_QBUF:
        return queue(argument);
    case VIDIOC_DQBUF:
        return dequeue(argument);
    case VIDIOC_STREAMON:
        if (buffers_.empty()) return -EINVAL;
        streaming_ = true;
        return 0;
    case VIDIOC_STREAMOFF:
        streaming_ = false;
        return 0;
    default:
        complaints_.emplace_back("an ioctl that no one needs");
        return -ENOTTY;
    }
}

int FakeV4l2Driver::queue(void* argument) {
    auto& request = *static_cast<v4l2_buffer*>(argument);
    if (request.index >= buffers_.size()) return -EINVAL;
    Buffer& buffer = buffers_[request.index];
    if (kind == Kind::strict && buffer.queued) {
        complaints_.emplace_back("QBUF of a buffer that is queued");
        return -EINVAL;
    }
    if (!buffer.mapped) complaints_.emplace_back("QBUF of a buffer that was never mapped");
    if (request.bytesused != stride_ * height_)
        complaints_.push_back("bytesused is " + std::to_string(request.bytesused));
    images_.push_back({{buffer.memory.begin(), buffer.memory.begin() + stride_ * height_},
                       std::int64_t{request.timestamp.tv_sec} * 1'000'000 + request.timestamp.tv_usec,
                       request.index,
                       request.flags});
    buffer.queued = true;
    buffer.shown = consumes;
    std::erase(order_, request.index);
    order_.push_back(request.index);
    return 0;
}

int FakeV4l2Driver::dequeue(void* argument) {
    auto& request = *static_cast<v4l2_buffer*>(argument);
    if (buffers_.empty() || (kind == Kind::strict && !streaming_)) return -EINVAL;
    if (order_.empty()) return -EAGAIN;
    if (kind == Kind::older_loopback) {
        request.index = order_.back();
        buffers_[request.index].queued = false;
        return 0;
    }
    const std::uint32_t index = order_.front();
    if (kind == Kind::strict && !buffers_[index].shown) return -EAGAIN;
    order_.pop_front();
    if (kind != Kind::strict) order_.push_back(index);
    buffers_[index].queued = false;
    request.index = give_back_index < 0 ? index : static_cast<std::uint32_t>(give_back_index);
    return 0;
}

ssize_t FakeV4l2Driver::write(int fd, const void* data, std::size_t size) {
    const std::lock_guard lock(mutex_);
    if (const int error = enter("write", fd); error < 0) return error;
    if (size != std::size_t{stride_} * height_)
        complaints_.push_back("write of " + std::to_string(size) + " bytes");
    if (size > write_most) return static_cast<ssize_t>(write_most);
    const auto* bytes = static_cast<const std::uint8_t*>(data);
    images_.push_back({{bytes, bytes + size}, -1, 0, 0});
    return static_cast<ssize_t>(size);
}

void* FakeV4l2Driver::map(int fd, std::int64_t offset, std::size_t size, int& error) {
    const std::lock_guard lock(mutex_);
    if (const int result = enter("mmap", fd); result < 0) {
        error = -result;
        return nullptr;
    }
    if (offset < 0 || static_cast<std::size_t>(offset) >= buffers_.size() || size > size_) {
        error = EINVAL;
        return nullptr;
    }
    ++mappings_;
    Buffer& buffer = buffers_[static_cast<std::size_t>(offset)];
    buffer.mapped = true;
    return buffer.memory.data();
}

void FakeV4l2Driver::unmap(void*, std::size_t) {
    const std::lock_guard lock(mutex_);
    --mappings_;
}

int FakeV4l2Driver::wait_writable(int fd, std::int64_t) {
    const std::lock_guard lock(mutex_);
    if (const int error = enter("poll", fd); error < 0) return error;
    return !order_.empty() && buffers_[order_.front()].shown ? 1 : 0;
}

} // namespace obscura::test
