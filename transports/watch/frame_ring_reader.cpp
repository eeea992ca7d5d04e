// SPDX-License-Identifier: Apache-2.0
#include "transports/watch/frame_ring_reader.hpp"

#include "core/error.hpp"
#include "transports/watch/shared_words.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <atomic>
#include <cerrno>
#include <cstring>

namespace obscura::transports {
namespace {

/// A writer that overtakes a reader so often has frames faster than they can be looked at.
constexpr int max_tries = 8;
constexpr std::uint64_t max_bytes = std::uint64_t{1} << 40;

[[noreturn]] void refuse_ring(const std::string& why) {
    throw InputError(fmt::format("frame ring: {}", why));
}

std::uint64_t sequence_of(const std::byte* slot) noexcept {
    return __atomic_load_n(reinterpret_cast<const std::uint64_t*>(slot + offsetof(FrameRingSlot, sequence)),
                           __ATOMIC_ACQUIRE);
}

} // namespace

FrameRingReader::FrameRingReader(const FileDescriptor& ring) {
    // Sealed against shrinking, its pages stay there while they are read.
    constexpr int wanted = F_SEAL_SHRINK | F_SEAL_FUTURE_WRITE;
    const int seals = ::fcntl(ring.get(), F_GET_SEALS);
    if (seals < 0 || (seals & wanted) != wanted) refuse_ring("the memory is not sealed");
    struct stat status {};
    if (::fstat(ring.get(), &status) != 0) refuse_ring(std::strerror(errno));
    bytes_ = static_cast<std::size_t>(status.st_size);
    if (bytes_ < sizeof head_) refuse_ring("too small");
    void* const mapped = ::mmap(nullptr, bytes_, PROT_READ, MAP_SHARED, ring.get(), 0);
    if (mapped == MAP_FAILED) refuse_ring(std::strerror(errno));
    mapped_ = static_cast<const std::byte*>(mapped);
    read_words(&head_, mapped_, sizeof head_);
    const FrameRingHead& h = head_;
    const bool known = h.magic == frame_ring_magic && h.version == frame_ring_version;
    const bool fits = h.slots > 0 && h.slots < 1024 && h.slots_at >= sizeof h && h.slots_at % 8 == 0 &&
                      h.slots_at < bytes_ && h.slot_bytes % 8 == 0 && h.slot_bytes < max_bytes &&
                      h.pixels_at >= sizeof(FrameRingSlot) && h.pixels_at % 8 == 0 &&
                      h.max_pixels < max_bytes && h.pixels_at <= h.slot_bytes &&
                      2 * h.max_pixels <= h.slot_bytes - h.pixels_at &&
                      h.slots * h.slot_bytes <= bytes_ - h.slots_at;
    if (known && fits) return;
    ::munmap(const_cast<std::byte*>(mapped_), bytes_);
    refuse_ring(known ? "its layout does not fit its size"
                      : fmt::format("not of version {}: daemon and reader are of different releases",
                                    frame_ring_version));
}

FrameRingReader::~FrameRingReader() {
    ::munmap(const_cast<std::byte*>(mapped_), bytes_);
}

const std::byte* FrameRingReader::slot(std::uint64_t serial) const noexcept {
    return mapped_ + head_.slots_at + serial % head_.slots * head_.slot_bytes;
}

std::uint64_t FrameRingReader::newest() const noexcept {
    return __atomic_load_n(reinterpret_cast<const std::uint64_t*>(mapped_ + offsetof(FrameRingHead, newest)),
                           __ATOMIC_ACQUIRE);
}

std::optional<RingFrame> FrameRingReader::read() const noexcept {
    for (int i = 0; i < max_tries; ++i) {
        const std::uint64_t serial = newest();
        if (serial == 0) return std::nullopt;
        if (const auto frame = read(serial)) return frame;
    }
    return std::nullopt;
}

std::optional<RingFrame> FrameRingReader::read(std::uint64_t serial) const noexcept {
    RingFrame frame;
    frame.serial = serial;
    const std::byte* const from = slot(serial);
    if (serial == 0 || sequence_of(from) != serial) return std::nullopt;
    read_words(&frame.header, from + offsetof(FrameRingSlot, header), sizeof frame.header);
    read_words(&frame.truth, from + offsetof(FrameRingSlot, truth), sizeof frame.truth);
    if (!intact(frame)) return std::nullopt;
    const std::uint64_t pixels = std::uint64_t{frame.header.width} * frame.header.height;
    if (pixels > head_.max_pixels || frame.truth.body_count > frame.truth.bodies.size()) return std::nullopt;
    frame.pixels = {reinterpret_cast<const std::uint16_t*>(from + head_.pixels_at),
                    static_cast<std::size_t>(pixels)};
    return frame;
}

bool FrameRingReader::intact(const RingFrame& frame) const noexcept {
    std::atomic_thread_fence(std::memory_order_acquire);
    return sequence_of(slot(frame.serial)) == frame.serial;
}

bool FrameRingReader::copy(const RingFrame& frame, std::span<std::uint16_t> out) const noexcept {
    read_words(out.data(), reinterpret_cast<const std::byte*>(frame.pixels.data()),
               frame.pixels.size_bytes());
    return intact(frame);
}

} // namespace obscura::transports
