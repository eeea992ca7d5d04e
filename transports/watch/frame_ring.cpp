// SPDX-License-Identifier: Apache-2.0
#include "transports/watch/frame_ring.hpp"

#include "core/error.hpp"
#include "transports/watch/shared_words.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>

namespace obscura::transports {
namespace {

constexpr std::size_t page_bytes = 4096;

constexpr std::size_t up_to_pages(std::size_t bytes) {
    return (bytes + page_bytes - 1) / page_bytes * page_bytes;
}

constexpr std::size_t pixels_at = up_to_pages(sizeof(FrameRingSlot));

[[noreturn]] void refuse(const char* what) {
    throw HardwareError(fmt::format("frame ring: {}: {}", what, std::strerror(errno)));
}

FileDescriptor new_event() {
    FileDescriptor event(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    if (!event) refuse("eventfd");
    return event;
}

FrameRingPose ring_pose(const Pose& pose) {
    const Quat& q = pose.orientation;
    return {{pose.position_m.x, pose.position_m.y, pose.position_m.z}, {q.w, q.x, q.y, q.z}};
}

FrameRingHeader header_of(const Frame& frame, std::uint64_t number) {
    const FrameInfo& info = frame.info;
    FrameRingHeader header;
    header.number = number;
    header.frame_id = info.frame_id;
    header.trigger_id = info.trigger_id;
    header.edge_tai_ns = info.trigger_edge.ns + info.tai_offset_ns;
    header.mid_exposure_tai_ns = info.truth.mid_exposure.ns + info.tai_offset_ns;
    header.exposure_ns = info.exposure_ns;
    header.gain_db = info.gain_db;
    header.width = static_cast<std::uint32_t>(info.width);
    header.height = static_cast<std::uint32_t>(info.height);
    header.bits = static_cast<std::uint32_t>(info.bits_per_pixel);
    header.rows = static_cast<std::uint32_t>(frame.rows_ready());
    header.flags = frame.flags.load(std::memory_order_relaxed);
    header.windows = info.window_count;
    header.x = info.windows[0].sensor.x;
    header.y = info.windows[0].sensor.y;
    return header;
}

FrameRingTruth truth_of(const GroundTruth& truth) {
    FrameRingTruth out;
    out.camera = ring_pose(truth.camera);
    out.sun_position_m = {truth.sun_position_m.x, truth.sun_position_m.y, truth.sun_position_m.z};
    out.focal_length_px = truth.intrinsics.focal_length_px;
    out.principal_point_px = truth.intrinsics.principal_point_px;
    out.body_count = std::min<std::uint64_t>(truth.body_count, out.bodies.size());
    for (std::size_t i = 0; i < out.body_count; ++i)
        out.bodies[i] = {truth.bodies[i].name, ring_pose(truth.bodies[i].pose)};
    return out;
}

} // namespace

FrameRing::FrameRing(std::size_t max_pixels)
    : memory_(::memfd_create("obscura-frames", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
    if (!memory_) refuse("memfd_create");
    const std::size_t slot_bytes = up_to_pages(pixels_at + 2 * max_pixels);
    bytes_ = page_bytes + slots * slot_bytes;
    if (::ftruncate(memory_.get(), static_cast<off_t>(bytes_)) != 0) refuse("ftruncate");
    // The first touch of each page takes long, and comes now.
    void* const mapped =
        ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, memory_.get(), 0);
    if (mapped == MAP_FAILED) refuse("mmap");
    mapped_ = static_cast<std::byte*>(mapped);
    FrameRingHead* const begin = new (mapped_) FrameRingHead;
    begin->magic = frame_ring_magic;
    begin->version = frame_ring_version;
    begin->slots = slots;
    begin->slots_at = page_bytes;
    begin->slot_bytes = slot_bytes;
    begin->pixels_at = pixels_at;
    begin->max_pixels = max_pixels;
    constexpr int seals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;
    if (::fcntl(memory_.get(), F_ADD_SEALS, seals) != 0) {
        ::munmap(mapped_, bytes_);
        refuse("F_ADD_SEALS");
    }
}

FrameRing::~FrameRing() {
    ::munmap(mapped_, bytes_);
}

int FrameRing::hand_over() {
    FileDescriptor& place = told_[next_told_];
    FileDescriptor event = new_event();
    if (!place)
        place = std::move(event);
    else if (::dup3(event.get(), place.get(), O_CLOEXEC) < 0)
        refuse("dup3");
    next_told_ = (next_told_ + 1) % max_reported;
    const std::size_t count = told_count_.load(std::memory_order_relaxed);
    if (count < max_reported) told_count_.store(count + 1, std::memory_order_release);
    return place.get();
}

FrameRingHead& FrameRing::head() const noexcept {
    return *std::launder(reinterpret_cast<FrameRingHead*>(mapped_));
}

std::uint64_t FrameRing::write(const Frame& frame, std::uint64_t number) noexcept {
    const std::span<const std::uint16_t> pixels = frame.pixels();
    if (pixels.size() > head().max_pixels) return 0;
    const std::uint64_t serial = ++serial_;
    std::byte* const slot = mapped_ + head().slots_at + serial % slots * head().slot_bytes;
    const FrameRingHeader header = header_of(frame, number);
    const FrameRingTruth truth = truth_of(frame.info.truth);

    auto* const sequence = reinterpret_cast<std::uint64_t*>(slot + offsetof(FrameRingSlot, sequence));
    __atomic_store_n(sequence, std::uint64_t{0}, __ATOMIC_RELAXED);
    std::atomic_thread_fence(std::memory_order_release);
    write_words(slot + offsetof(FrameRingSlot, header), &header, sizeof header);
    write_words(slot + offsetof(FrameRingSlot, truth), &truth, sizeof truth);
    const std::size_t there = 2 * std::size_t{header.rows} * header.width;
    write_words(slot + pixels_at, pixels.data(), there);
    clear_words(slot + pixels_at, there, pixels.size_bytes());
    __atomic_store_n(sequence, serial, __ATOMIC_RELEASE);
    __atomic_store_n(&head().newest, serial, __ATOMIC_RELEASE);

    constexpr std::uint64_t one = 1;
    // An eventfd without a reader is full after 2^64 frames, and then refuses.
    for (std::size_t i = 0, count = told_count_.load(std::memory_order_acquire); i < count; ++i)
        if (::write(told_[i].get(), &one, sizeof one) < 0) continue;
    return serial;
}

} // namespace obscura::transports
