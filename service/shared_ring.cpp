// SPDX-License-Identifier: Apache-2.0
#include "service/shared_ring.hpp"

#include "core/error.hpp"
#include "service/message.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <span>

namespace obscura::service {
namespace {

constexpr std::size_t page_bytes = 4096;

struct SlotHead {
    std::uint64_t sequence;
    std::uint32_t id, zero;
    std::uint64_t bytes;
};
static_assert(sizeof(SlotHead) <= SharedRing::head_bytes);

} // namespace

SharedRing::SharedRing(std::size_t slots, std::size_t slot_bytes)
    : file_(::memfd_create("obscura", MFD_CLOEXEC | MFD_ALLOW_SEALING)),
      slots_(slots),
      slot_bytes_(slot_bytes),
      stride_((head_bytes + slot_bytes + page_bytes - 1) / page_bytes * page_bytes) {
    const std::size_t bytes = slots_ * stride_;
    void* memory = MAP_FAILED;
    if (file_ && ::ftruncate(file_.get(), static_cast<off_t>(bytes)) == 0)
        memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_.get(), 0);
    if (memory == MAP_FAILED) throw HardwareError(fmt::format("shared memory: {}", std::strerror(errno)));
    memory_ = static_cast<std::byte*>(memory);
    // This mapping stays writable, further ones are not.
    if (::fcntl(file_.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL) !=
        0) {
        const int error = errno;
        ::munmap(memory_, bytes);
        throw HardwareError(fmt::format("shared memory: {}", std::strerror(error)));
    }
}

SharedRing::~SharedRing() {
    ::munmap(memory_, slots_ * stride_);
}

std::optional<SharedRing::Place> SharedRing::write(std::uint32_t id, const std::vector<Array>& arrays) {
    std::size_t bytes = 0;
    for (const Array& array : arrays)
        bytes += padding(bytes) + bytes_of(array).size();
    if (bytes > slot_bytes_) return {};
    const std::size_t slot = written_ % slots_;
    std::byte* const start = memory_ + slot * stride_;
    auto& head = *reinterpret_cast<SlotHead*>(start);
    std::atomic_ref<std::uint64_t> sequence(head.sequence);
    // Nothing of what follows is seen before it.
    sequence.exchange(2 * written_ + 1, std::memory_order_acq_rel);
    head.id = id;
    head.bytes = bytes;
    std::size_t offset = 0;
    for (const Array& array : arrays) {
        const std::span<const std::byte> values = bytes_of(array);
        offset += padding(offset);
        std::copy(values.begin(), values.end(), start + head_bytes + offset);
        offset += values.size();
    }
    const std::uint64_t whole = 2 * ++written_;
    sequence.store(whole, std::memory_order_release);
    return Place{slot, whole};
}

} // namespace obscura::service
