// When the first and the last byte of a frame left, for each kind of way out.
#pragma once

#include "core/time.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace obscura {

/// Ways out of a camera, at most one of each kind.
enum class Outlet : std::uint8_t { gige, v4l2, stimulator, file };
constexpr std::size_t outlet_count = 4;

/// Written by the transports' threads, one for each outlet, read by any; no member waits or allocates.
class ByteStamps {
public:
    /// Bytes of the frame have been handed to the kernel (scheduling clock): the first of them, if none had.
    void note(Outlet outlet, Time now) noexcept {
        Stamps& s = at(outlet);
        if (s.first.load(std::memory_order_relaxed) == 0) s.first.store(now.ns, std::memory_order_relaxed);
        s.last.store(now.ns, std::memory_order_relaxed);
    }
    /// 0: nothing has left.
    [[nodiscard]] Time first(Outlet outlet) const noexcept {
        return Time{at(outlet).first.load(std::memory_order_relaxed)};
    }
    [[nodiscard]] Time last(Outlet outlet) const noexcept {
        return Time{at(outlet).last.load(std::memory_order_relaxed)};
    }
    void clear() noexcept {
        for (Stamps& s : stamps_) {
            s.first.store(0, std::memory_order_relaxed);
            s.last.store(0, std::memory_order_relaxed);
        }
    }

private:
    struct Stamps {
        std::atomic<std::int64_t> first{0}, last{0};
    };
    Stamps& at(Outlet outlet) noexcept { return stamps_[static_cast<std::size_t>(outlet)]; }
    [[nodiscard]] const Stamps& at(Outlet outlet) const noexcept {
        return stamps_[static_cast<std::size_t>(outlet)];
    }
    std::array<Stamps, outlet_count> stamps_;
};

} // namespace obscura
