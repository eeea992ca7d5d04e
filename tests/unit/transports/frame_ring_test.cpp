// SPDX-License-Identifier: Apache-2.0
// Frame ring: what other processes may do with its memory, and what they read there.
#include "core/error.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/catch.hpp"
#include "transports/watch/frame_ring.hpp"
#include "transports/watch/frame_ring_reader.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <thread>
#include <vector>

namespace frame_ring_test {

using namespace obscura;
using namespace obscura::transports;

namespace {

constexpr std::int32_t width = 9, height = 7;
constexpr std::size_t pixels = width * height;

struct RingBench {
    FramePool pool{2, pixels, height};
    FrameRing ring{pixels};
    const FrameRingReader reader{copy_of(ring.descriptor())};

    static FileDescriptor copy_of(int descriptor) { return FileDescriptor(::dup(descriptor)); }

    /// A frame all of whose pixels are its id.
    FrameRef frame(std::uint64_t id, std::int32_t rows = height) {
        const FrameRef frame = pool.acquire();
        REQUIRE(frame);
        frame->info.frame_id = id;
        frame->info.width = width, frame->info.height = height;
        std::fill(frame->pixels().begin(), frame->pixels().end(), static_cast<std::uint16_t>(id));
        frame->publish_rows(rows);
        return frame;
    }
};

bool all_equal(std::span<const std::uint16_t> values, std::uint64_t value) {
    return std::all_of(values.begin(), values.end(), [value](std::uint16_t dn) { return dn == value; });
}

} // namespace

TEST_CASE("a reader of the ring cannot change it", "[transports]") {
    RingBench bench;
    const FileDescriptor memory = RingBench::copy_of(bench.ring.descriptor());
    struct stat status {};
    REQUIRE(::fstat(memory.get(), &status) == 0);
    const auto bytes = static_cast<std::size_t>(status.st_size);
    const auto refused = [](bool refusal) { return refusal && errno == EPERM; };
    CHECK(refused(::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory.get(), 0) == MAP_FAILED));
    CHECK(refused(::pwrite(memory.get(), "x", 1, 0) < 0));
    CHECK(refused(::ftruncate(memory.get(), 0) < 0));
    CHECK(refused(::ftruncate(memory.get(), status.st_size + 4096) < 0));
    CHECK(refused(::fcntl(memory.get(), F_ADD_SEALS, F_SEAL_WRITE) < 0));
    void* const read_only = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, memory.get(), 0);
    REQUIRE(read_only != MAP_FAILED);
    CHECK(::mprotect(read_only, bytes, PROT_READ | PROT_WRITE) < 0);
    CHECK(errno == EACCES);
    ::munmap(read_only, bytes);
    const FileDescriptor again(::open(fmt::format("/proc/self/fd/{}", memory.get()).c_str(), O_RDWR));
    REQUIRE(again);
    CHECK(refused(::mmap(nullptr, bytes, PROT_WRITE, MAP_SHARED, again.get(), 0) == MAP_FAILED));
    // The owner still writes.
    CHECK(bench.ring.write(*bench.frame(3), 1) == 1);
    CHECK(all_equal(bench.reader.read().value().pixels, 3));
}

TEST_CASE("memory that is no ring is refused with the reason", "[transports]") {
    const auto why = [](const FileDescriptor& memory) {
        try {
            FrameRingReader reader(memory);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    constexpr int seals = F_SEAL_SHRINK | F_SEAL_FUTURE_WRITE;
    const auto sealed = [](const FrameRingHead& head, off_t bytes) {
        FileDescriptor memory(::memfd_create("test", MFD_CLOEXEC | MFD_ALLOW_SEALING));
        REQUIRE(::pwrite(memory.get(), &head, sizeof head, 0) == sizeof head);
        REQUIRE(::ftruncate(memory.get(), bytes) == 0);
        REQUIRE(::fcntl(memory.get(), F_ADD_SEALS, seals) == 0);
        return memory;
    };
    FrameRingHead good;
    good.magic = frame_ring_magic;
    good.version = frame_ring_version;
    good.slots = 2, good.slots_at = 4096, good.slot_bytes = 8192, good.pixels_at = 4096,
    good.max_pixels = 2048;
    CHECK(why(sealed(good, 4096 + 2 * 8192)).empty());
    CHECK(why(FileDescriptor(::open("/dev/null", O_RDONLY))) == "frame ring: the memory is not sealed");
    CHECK(why(FileDescriptor(::memfd_create("test", MFD_ALLOW_SEALING))) ==
          "frame ring: the memory is not sealed");
    CHECK(why(sealed(good, 8)) == "frame ring: too small");
    const std::string misfit = "frame ring: its layout does not fit its size";
    CHECK(why(sealed(good, 4096 + 2 * 8192 - 1)) == misfit);
    for (const auto& change : std::vector<void (*)(FrameRingHead&)>{
             [](FrameRingHead& h) { h.slots = 0; }, [](FrameRingHead& h) { h.slots = 3; },
             [](FrameRingHead& h) { h.slots_at = 0; }, [](FrameRingHead& h) { h.slots_at = UINT64_MAX - 7; },
             [](FrameRingHead& h) { h.slot_bytes = UINT64_MAX - 7; },
             [](FrameRingHead& h) { h.pixels_at = 8; }, [](FrameRingHead& h) { h.pixels_at = 8200; },
             [](FrameRingHead& h) { h.max_pixels = 2049; },
             [](FrameRingHead& h) { h.max_pixels = std::uint64_t{1} << 63; }}) {
        FrameRingHead bad = good;
        change(bad);
        CHECK(why(sealed(bad, 4096 + 2 * 8192)) == misfit);
    }
    FrameRingHead other = good;
    other.version = 7;
    CHECK(why(sealed(other, 4096 + 2 * 8192)).find("of different releases") != std::string::npos);
}

TEST_CASE("a frame of the ring has what the frame has", "[transports]") {
    RingBench bench;
    CHECK_FALSE(bench.reader.read());
    const FrameRef frame = bench.frame(7, 5);
    FrameInfo& info = frame->info;
    info.trigger_id = 70;
    info.trigger_edge = Time{1000}, info.tai_offset_ns = 37;
    info.truth.mid_exposure = Time{3000};
    info.exposure_ns = 500, info.gain_db = 3.5, info.bits_per_pixel = 12;
    info.windows[0].sensor = {16, 32, width, height};
    info.truth.camera = {{1, 2, 3}, {0.5, 0.5, -0.5, 0.5}};
    info.truth.sun_position_m = {4, 5, 6};
    info.truth.intrinsics = {{800, 900}, {31.5, 23.5}, {1e-5, 1e-5}};
    info.truth.body_count = 1;
    std::strcpy(info.truth.bodies[0].name.data(), "Moon");
    info.truth.bodies[0].pose = {{7, 8, 9}, {1, 0, 0, 0}};
    frame->abandon();
    REQUIRE(bench.ring.write(*frame, 12) == 1);
    const RingFrame seen = bench.reader.read().value();
    CHECK(seen.serial == 1);
    const FrameRingHeader& h = seen.header;
    CHECK(h.number == 12);
    CHECK(h.frame_id == 7);
    CHECK(h.trigger_id == 70);
    CHECK(h.edge_tai_ns == 1037);
    CHECK(h.mid_exposure_tai_ns == 3037);
    CHECK(h.exposure_ns == 500);
    CHECK(h.gain_db == 3.5);
    CHECK((h.width == width && h.height == height && h.bits == 12 && h.rows == 5));
    CHECK((h.flags & frame_partial) != 0);
    CHECK((h.windows == 1 && h.x == 16 && h.y == 32));
    CHECK(seen.truth.camera.position_m == std::array{1.0, 2.0, 3.0});
    CHECK(seen.truth.camera.orientation == std::array{0.5, 0.5, -0.5, 0.5});
    CHECK(seen.truth.sun_position_m == std::array{4.0, 5.0, 6.0});
    CHECK(seen.truth.focal_length_px == std::array{800.0, 900.0});
    CHECK(seen.truth.principal_point_px == std::array{31.5, 23.5});
    REQUIRE(seen.truth.body_count == 1);
    CHECK(std::string(seen.truth.bodies[0].name.data()) == "Moon");
    CHECK(seen.truth.bodies[0].pose.position_m == std::array{7.0, 8.0, 9.0});
    std::vector<std::uint16_t> copy(seen.pixels.size());
    CHECK(bench.reader.copy(seen, copy));
    CHECK(all_equal(std::span(copy).first(5 * width), 7));
    CHECK(all_equal(std::span(copy).subspan(5 * width), 0)); // rows that it does not have
    info.width = width + 1;                                  // larger than all that were announced
    info.height = height;
    FramePool large(1, pixels + height, height);
    const FrameRef too_large = large.acquire();
    too_large->info.width = width + 1, too_large->info.height = height;
    CHECK(bench.ring.write(*too_large, 13) == 0);
    CHECK(bench.reader.newest() == 1);
}

TEST_CASE("rows that a frame does not have are 0, not those of a frame before", "[transports]") {
    RingBench bench;
    for (std::uint64_t id = 1; id <= FrameRing::slots; ++id)
        bench.ring.write(*bench.frame(id), id);
    const FrameRef cut = bench.frame(9, 5);
    cut->abandon();
    bench.ring.write(*cut, 9);
    const RingFrame seen = bench.reader.read().value();
    CHECK(seen.header.rows == 5);
    CHECK(all_equal(seen.pixels.first(5 * width), 9));
    CHECK(all_equal(seen.pixels.subspan(5 * width), 0));
}

TEST_CASE("a reader knows when what it reads has been overwritten", "[transports]") {
    RingBench bench;
    bench.ring.write(*bench.frame(1), 1);
    const RingFrame first = bench.reader.read().value();
    for (std::uint64_t id = 2; id <= FrameRing::slots; ++id)
        bench.ring.write(*bench.frame(id), id);
    CHECK(bench.reader.intact(first)); // slots - 1 frames later
    CHECK(all_equal(first.pixels, 1));
    bench.ring.write(*bench.frame(9), 9);
    CHECK_FALSE(bench.reader.intact(first));
    std::vector<std::uint16_t> copy(pixels);
    CHECK_FALSE(bench.reader.copy(first, copy));
    CHECK(bench.reader.read().value().header.frame_id == 9);
}

TEST_CASE("no copy that a reader takes for whole is torn", "[transports]") {
    constexpr std::int32_t side = 256; // copied for long enough to be overwritten meanwhile
    FramePool pool(1, side * side, side);
    FrameRing ring(side * side);
    const FrameRingReader reader(RingBench::copy_of(ring.descriptor()));
    std::atomic<bool> done{false};
    std::uint64_t whole = 0, torn = 0;
    std::thread reading([&] {
        std::vector<std::uint16_t> copy(side * side);
        while (!done || whole == 0) {
            // In turn the newest frame and the oldest, whose slot is written next.
            const std::uint64_t newest = reader.newest();
            for (const std::uint64_t serial : {newest, newest - std::min(newest, FrameRing::slots - 1)}) {
                const auto frame = reader.read(serial);
                if (!frame || !reader.copy(*frame, copy)) continue;
                ++whole;
                if (!all_equal(copy, frame->header.frame_id) || frame->serial != frame->header.frame_id)
                    ++torn;
            }
        }
    });
    const FrameRef frame = pool.acquire();
    REQUIRE(frame);
    frame->info.width = frame->info.height = side;
    frame->publish_rows(side);
    for (std::uint64_t id = 1; id <= 5000; ++id) {
        frame->info.frame_id = id;
        std::fill(frame->pixels().begin(), frame->pixels().end(), static_cast<std::uint16_t>(id));
        ring.write(*frame, id);
    }
    done = true;
    reading.join();
    CHECK(whole > 0);
    CHECK(torn == 0);
}

TEST_CASE("a reader that is stopped or killed holds up nothing", "[transports]") {
    RingBench bench;
    const FileDescriptor told = RingBench::copy_of(bench.ring.hand_over());
    const pid_t child = ::fork();
    if (child == 0) {
        for (;;) {
            std::uint16_t sum = 0;
            if (const auto frame = bench.reader.read())
                for (const std::uint16_t dn : frame->pixels)
                    sum = static_cast<std::uint16_t>(sum + dn);
            if (sum == 1) ::getpid();
        }
    }
    REQUIRE(child > 0);
    std::uint64_t id = 0;
    for (const int signal : {SIGSTOP, SIGCONT, SIGKILL}) {
        for (int i = 0; i < 100; ++i) {
            ++id;
            REQUIRE(bench.ring.write(*bench.frame(id), id) == id);
        }
        REQUIRE(::kill(child, signal) == 0);
    }
    REQUIRE(::waitpid(child, nullptr, 0) == child);
    ++id;
    REQUIRE(bench.ring.write(*bench.frame(id), id) == id);
    CHECK(all_equal(bench.reader.read().value().pixels, id));
    std::uint64_t news = 0;
    REQUIRE(::read(told.get(), &news, sizeof news) == sizeof news);
    CHECK(news == id); // all that were written while it was not read
}

TEST_CASE("each reader is told of frames by an event of its own", "[transports]") {
    RingBench bench;
    std::vector<FileDescriptor> readers;
    for (std::size_t i = 0; i <= FrameRing::max_reported; ++i)
        readers.push_back(RingBench::copy_of(bench.ring.hand_over()));
    bench.ring.write(*bench.frame(1), 1);
    const auto readable = [](const FileDescriptor& event) {
        pollfd polled{event.get(), POLLIN, 0};
        return ::poll(&polled, 1, 0) == 1;
    };
    CHECK_FALSE(readable(readers.front())); // a later one took its place
    CHECK(std::all_of(readers.begin() + 1, readers.end(), readable));
    // A reader may write to it, too: that costs the others nothing.
    constexpr std::uint64_t full = UINT64_MAX - 1;
    std::uint64_t news = 0;
    REQUIRE(::read(readers[1].get(), &news, sizeof news) == sizeof news);
    REQUIRE(::write(readers[1].get(), &full, sizeof full) == sizeof full);
    CHECK(bench.ring.write(*bench.frame(2), 2) == 2);
}

TEST_CASE("writing to the ring takes no memory from the heap", "[transports]") {
    if (!test::allocations_are_counted()) return; // the heap is the sanitizer's
    RingBench bench;
    [[maybe_unused]] const int told = bench.ring.hand_over();
    const FrameRef frame = bench.frame(1);
    test::reset_allocation_counts();
    for (std::uint64_t number = 1; number <= 10; ++number)
        if (bench.ring.write(*frame, number) != number) FAIL("not written");
    CHECK(test::allocation_counts().all == 0);
}

} // namespace frame_ring_test
