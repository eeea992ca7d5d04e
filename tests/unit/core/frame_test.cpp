// SPDX-License-Identifier: Apache-2.0
#include "core/camera/frame.hpp"
#include "core/philox.hpp"
#include "tests/support/catch.hpp"

#include <numeric>
#include <thread>
#include <vector>

namespace frame_test {

using namespace obscura;

TEST_CASE("a pool lends each frame once and takes it back") {
    FramePool pool(2, 64, 8);
    FrameRef a = pool.acquire();
    FrameRef b = pool.acquire();
    REQUIRE(a);
    REQUIRE(b);
    CHECK(a.get() != b.get());
    CHECK_FALSE(pool.acquire());
    CHECK(pool.in_use() == 2);
    FrameRef copy = a;
    a->flags = frame_late;
    a->saturated_windows = 1;
    a->info.width = 8;
    a->info.height = 1;
    a->publish_rows(1);
    a = FrameRef{};
    CHECK_FALSE(pool.acquire()); // the copy still holds it
    copy = FrameRef{};
    CHECK(pool.in_use() == 1);
    const FrameRef again = pool.acquire();
    REQUIRE(again);
    CHECK(again->rows_ready() == 0);
    CHECK(again->flags == 0);
    CHECK(again->saturated_windows == 0);
    CHECK(again->info.width == 0);
}

TEST_CASE("readers see the rows that were published, as they were written") {
    FramePool pool(1, 1000 * 100, 1000);
    const FrameRef frame = pool.acquire();
    frame->info.width = 100;
    frame->info.height = 1000;
    std::uint64_t sum = 0;
    std::thread reader([&, shared = frame] {
        for (std::int32_t y = 0; y < 1000; ++y) {
            REQUIRE(shared->wait_rows(y + 1) > y);
            for (const std::uint16_t pixel : std::as_const(*shared).row(y))
                sum += pixel;
        }
    });
    std::uint64_t expected = 0;
    for (std::int32_t y = 0; y < 1000; y += 8) {
        for (std::int32_t k = y; k < y + 8; ++k)
            for (std::uint16_t& pixel : frame->row(k))
                expected += pixel = static_cast<std::uint16_t>(k);
        frame->publish_rows(y + 8);
    }
    reader.join();
    CHECK(sum == expected);
    CHECK(frame->complete());
}

TEST_CASE("an abandoned frame lets its readers go and says it is partial") {
    FramePool pool(1, 100, 10);
    const FrameRef frame = pool.acquire();
    frame->info.width = 10;
    frame->info.height = 10;
    std::thread reader([&, shared = frame] { CHECK(shared->wait_rows(10) == 4); });
    frame->publish_rows(4);
    frame->abandon();
    reader.join();
    CHECK(frame->abandoned());
    CHECK_FALSE(frame->complete());
    CHECK((frame->flags & frame_partial) != 0);
}

TEST_CASE("many threads borrow from one pool without sharing a frame") {
    FramePool pool(4, 16, 4);
    std::vector<std::thread> threads;
    for (std::uint16_t t = 1; t <= 4; ++t)
        threads.emplace_back([&, t] {
            for (int i = 0; i < 5000; ++i) {
                const FrameRef frame = pool.acquire();
                if (!frame) continue;
                frame->info.width = frame->info.height = 4;
                for (std::uint16_t& p : frame->pixels())
                    p = t;
                for (const std::uint16_t p : frame->pixels())
                    if (p != t) std::abort();
            }
        });
    for (std::thread& thread : threads)
        thread.join();
    CHECK(pool.in_use() == 0);
}

TEST_CASE("pixels are packed as PFNC says") {
    const std::vector<std::uint16_t> twelve{0xabc, 0x123, 0xfff, 0x001};
    std::vector<std::uint8_t> out(16);

    CHECK(packed_bytes(PixelFormat::mono12p, 4) == 6);
    CHECK(packed_bytes(PixelFormat::mono12p, 3) == 5); // the last byte is half full
    CHECK(packed_bytes(PixelFormat::mono10p, 5) == 7);
    pack_pixels(PixelFormat::mono12p, 12, twelve, out);
    // LSB first: byte 0 = p0[7:0], byte 1 = p1[3:0] p0[11:8], byte 2 = p1[11:4].
    CHECK(std::vector(out.begin(), out.begin() + 6) ==
          std::vector<std::uint8_t>{0xbc, 0x3a, 0x12, 0xff, 0x1f, 0x00});

    pack_pixels(PixelFormat::mono16, 12, twelve, out);
    CHECK(out[0] == 0xbc);
    CHECK(out[1] == 0x0a);

    pack_pixels(PixelFormat::mono8, 12, twelve, out);
    CHECK(out[0] == 0xab);
    CHECK(out[2] == 0xff);

    pack_pixels(PixelFormat::mono10, 12, twelve, out);
    CHECK((out[0] | out[1] << 8) == 0xabc >> 2);
}

TEST_CASE("ten-bit packing is undone by a bit-by-bit reader") {
    std::vector<std::uint16_t> pixels(64);
    for (std::uint32_t i = 0; i < pixels.size(); ++i)
        pixels[i] = static_cast<std::uint16_t>(philox4x32({i, 0, 0, 0}, {0, 0})[0] & 0x3ff);
    std::vector<std::uint8_t> out(packed_bytes(PixelFormat::mono10p, 64));
    CHECK(out.size() == 80);
    pack_pixels(PixelFormat::mono10p, 10, pixels, out);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        unsigned value = 0;
        for (std::size_t b = 0; b < 10; ++b) {
            const std::size_t bit = i * 10 + b;
            value |= static_cast<unsigned>(out[bit / 8] >> (bit % 8) & 1) << b;
        }
        CHECK(value == pixels[i]);
    }
}

} // namespace frame_test
