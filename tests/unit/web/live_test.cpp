// SPDX-License-Identifier: Apache-2.0
// Live pictures without the socket: views and histograms against brute force, messages, the budget, credit.
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "web/live/kept_frames.hpp"
#include "web/live/live_budget.hpp"
#include "web/live/live_message.hpp"
#include "web/live/live_pictures.hpp"
#include "web/live/view.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace live_test {

using namespace obscura;
using namespace obscura::web;

namespace {

struct Image {
    std::uint32_t width, height;
    std::vector<std::uint16_t> pixels;

    Image(std::uint32_t w, std::uint32_t h, unsigned bits, unsigned seed) : width(w), height(h) {
        std::mt19937 dice(seed);
        for (std::uint32_t i = 0; i < w * h; ++i)
            pixels.push_back(static_cast<std::uint16_t>(dice() & ((1U << bits) - 1)));
    }
};

/// Pixel by pixel, as the documentation has it.
std::vector<std::uint16_t> by_brute_force(const Image& image, const View& view) {
    std::vector<std::uint16_t> out;
    for (std::uint32_t by = 0; by < view.height; by += view.bin)
        for (std::uint32_t bx = 0; bx < view.width; bx += view.bin) {
            std::uint32_t largest = 0, sum = 0, count = 0;
            for (std::uint32_t y = by; y < std::min(by + view.bin, view.height); ++y)
                for (std::uint32_t x = bx; x < std::min(bx + view.bin, view.width); ++x) {
                    const std::uint32_t dn = image.pixels[(view.y + y) * image.width + view.x + x];
                    largest = std::max(largest, dn);
                    sum += dn;
                    ++count;
                }
            const double mean = std::floor(static_cast<double>(sum) / count + 0.5);
            out.push_back(static_cast<std::uint16_t>(view.reduce == Reduce::max ? largest : mean));
        }
    return out;
}

std::string refusal_of(const std::string& message) {
    try {
        (void)viewer_message_of(message);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

double bytes_of(const Share& share) {
    return static_cast<double>(picture_header_bytes + share.view.bytes()) * share.hz;
}

} // namespace

TEST_CASE("a view is what each of its bins gives by itself", "[web]") {
    std::mt19937 dice(5);
    const auto up_to = [&dice](std::uint32_t most) {
        return static_cast<std::uint32_t>(dice() % (most + 1));
    };
    for (int i = 0; i < 300; ++i) {
        const Image image(1 + up_to(70), 1 + up_to(40), 16, static_cast<unsigned>(i));
        View view{up_to(80), up_to(50),      up_to(90),
                  up_to(60), 1U << up_to(6), up_to(1) == 0 ? Reduce::max : Reduce::mean};
        view = clipped(view, image.width, image.height);
        REQUIRE(view.width > 0);
        REQUIRE(view.height > 0);
        REQUIRE(view.x + view.width <= image.width);
        REQUIRE(view.y + view.height <= image.height);
        const auto pixels = reduced(image.pixels, image.width, view);
        REQUIRE(pixels.size() == view.columns() * view.rows());
        REQUIRE(2 * pixels.size() == view.bytes());
        REQUIRE(pixels == by_brute_force(image, view));
    }
    const Image white(128, 128, 16, 1);
    Image full = white;
    std::fill(full.pixels.begin(), full.pixels.end(), std::uint16_t{65535});
    CHECK(reduced(full.pixels, 128, {0, 0, 128, 128, 64, Reduce::mean}) ==
          std::vector<std::uint16_t>(4, 65535));
}

TEST_CASE("a view is cut to the image, and 0 reaches to its edge", "[web]") {
    CHECK(clipped({0, 0, 0, 0, 2, Reduce::max}, 100, 50) == View{0, 0, 100, 50, 2, Reduce::max});
    CHECK(clipped({90, 10, 20, 20, 1, Reduce::max}, 100, 50) == View{90, 10, 10, 20, 1, Reduce::max});
    CHECK(clipped({500, 500, 20, 0, 1, Reduce::max}, 100, 50) == View{99, 49, 1, 1, 1, Reduce::max});
    CHECK(clipped({65535, 65535, 65535, 65535, 64, Reduce::mean}, 1, 1) ==
          View{0, 0, 1, 1, 64, Reduce::mean});
}

TEST_CASE("a histogram counts each pixel", "[web]") {
    std::vector<std::uint32_t> counts;
    for (const unsigned bits : {8U, 10U, 12U, 14U, 16U}) {
        Image image(97, 53, bits, bits);
        std::fill_n(image.pixels.begin(), 7, static_cast<std::uint16_t>((1U << bits) - 1));
        const Histogram h = histogram_of(image.pixels, bits, counts);
        std::vector<std::uint16_t> sorted = image.pixels;
        std::sort(sorted.begin(), sorted.end());
        CHECK(h.min == sorted.front());
        CHECK(h.max == sorted.back());
        const auto at = [&sorted](double share) {
            return sorted[static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size()))) -
                          1];
        };
        CHECK(h.p50 == at(0.5));
        CHECK(h.p99 == at(0.99));
        CHECK_THAT(h.mean, Catch::Matchers::WithinRel(std::accumulate(sorted.begin(), sorted.end(), 0.0) /
                                                          static_cast<double>(sorted.size()),
                                                      1e-12));
        CHECK(h.saturated ==
              static_cast<std::uint64_t>(std::count(sorted.begin(), sorted.end(), (1U << bits) - 1)));
        for (std::size_t bin = 0; bin < h.bins.size(); ++bin)
            REQUIRE(h.bins[bin] == static_cast<std::uint64_t>(
                                       std::count_if(sorted.begin(), sorted.end(), [&](std::uint16_t dn) {
                                           return dn * 256U / (1U << bits) == bin;
                                       })));
    }
    // What cannot be is still counted.
    const std::vector<std::uint16_t> odd{0, 65535};
    const Histogram h = histogram_of(odd, 8, counts);
    CHECK((h.bins[0] == 1 && h.bins[255] == 1 && h.saturated == 1 && h.max == 65535));
}

TEST_CASE("messages of viewers are taken or refused with what is allowed", "[web]") {
    CHECK(viewer_message_of(R"({"token":"abc"})").token == "abc");
    CHECK(viewer_message_of(R"({"ready":true})").ready);
    const ViewRequest view =
        viewer_message_of(
            R"({"view":{"camera":"4711-2","x":1,"y":2,"w":3,"h":4,"bin":8,"reduce":"mean","max_hz":2.5}})")
            .view.value();
    CHECK(view.camera == CameraId{4711, 2});
    CHECK(view.view == View{1, 2, 3, 4, 8, Reduce::mean});
    CHECK(view.max_hz == 2.5);
    const ViewRequest whole = viewer_message_of(R"({"view":{"camera":"1-0"}})").view.value();
    CHECK(whole.view == View{});
    CHECK(whole.max_hz == 10);
    for (const char* none : {"", "x", "[]", "3", "{}", "{", R"({"token":"a","ready":true})", "\xff", "null"})
        CHECK(refusal_of(none) == R"(a message is {"token": TOKEN}, {"view": {...}} or {"ready": true})");
    CHECK(refusal_of(R"({"other":1})") == "allowed are token, view and ready");
    CHECK(refusal_of(R"({"ready":false})") == "ready: true");
    CHECK(refusal_of(R"({"token":3})") == "token: a text of at most 256 bytes");
    CHECK(refusal_of(R"({"token":")" + std::string(257, 'x') + "\"}") ==
          "token: a text of at most 256 bytes");
    const auto refused = [](const std::string& fields) {
        return refusal_of(R"({"view":{"camera":"1-0",)" + fields + "}}");
    };
    for (const char* bad : {R"("x":-1)", R"("x":65536)", R"("x":1.5)", R"("x":"1")", R"("x":null)"})
        CHECK(refused(bad) == "view: x: a whole number from 0 to 65535");
    for (const char* bad : {R"("bin":0)", R"("bin":3)", R"("bin":63)"})
        CHECK(refused(bad) == "view: bin: a power of two from 1 to 64");
    CHECK(refused(R"("bin":128)") == "view: bin: a whole number from 0 to 64");
    CHECK(refused(R"("reduce":"median")") == "view: reduce: max or mean");
    for (const char* bad : {R"("max_hz":0)", R"("max_hz":61)", R"("max_hz":"1")", R"("max_hz":-1e300)"})
        CHECK(refused(bad) == "view: max_hz: a number from 0.1 to 60");
    CHECK(refused(R"("zoom":1)") == "view: allowed camera, x, y, w, h, bin, reduce, max_hz, enc");
    CHECK(refusal_of(R"({"view":[]})") == "view: an object");
    for (const char* id : {"", "1", "1-", "-1-0", "0-0", "1-1001", "1-0x", "x-0", "1--1", " 1-0"})
        CHECK(refusal_of(std::string(R"({"view":{"camera":")") + id + "\"}}") ==
              "view: camera: the id of a camera, as \"4711-0\"");
    CHECK(to_text(CameraId{4711, 2}) == "4711-2");
}

TEST_CASE("the header of a picture says what it shows", "[web]") {
    transports::FrameRingHeader frame;
    frame.frame_id = 0x0102030405060708;
    frame.trigger_id = 0x1112131415161718;
    frame.edge_tai_ns = -2;
    frame.bits = 12;
    frame.rows = 300;
    frame.width = 1024, frame.height = 768;
    frame.number = 0x2122232425262728;
    const auto bytes = picture_header(3, frame, {10, 20, 300, 400, 4, Reduce::mean}, 2, 70000, 0x31);
    CHECK(std::memcmp(bytes.data(), "OBSV", 4) == 0);
    const auto at = [&bytes](std::size_t from, std::size_t count) {
        std::uint64_t value = 0;
        for (std::size_t i = count; i-- > 0;)
            value = value << 8 | bytes[from + i];
        return value;
    };
    const std::vector<std::array<std::uint64_t, 3>> fields{{4, 2, 1},
                                                           {6, 2, 80},
                                                           {8, 4, 3},
                                                           {12, 4, 2},
                                                           {16, 8, frame.frame_id},
                                                           {24, 8, frame.trigger_id},
                                                           {32, 8, UINT64_MAX - 1},
                                                           {40, 2, 10},
                                                           {42, 2, 20},
                                                           {44, 2, 300},
                                                           {46, 2, 400},
                                                           {48, 2, 4},
                                                           {50, 1, 1},
                                                           {51, 1, 0},
                                                           {52, 1, 12},
                                                           {53, 1, 0},
                                                           {54, 2, 300},
                                                           {56, 4, 70000},
                                                           {60, 2, 1024},
                                                           {62, 2, 768},
                                                           {64, 8, frame.number},
                                                           {72, 8, 0x31}};
    for (const auto& [from, count, value] : fields) {
        INFO(from);
        CHECK(at(from, count) == value);
    }
}

TEST_CASE("texts to viewers are JSON", "[web]") {
    Histogram h;
    h.bins[3] = 5;
    h.mean = 1.5;
    const auto json = nlohmann::json::parse(histogram_text(UINT64_MAX, h))["histogram"];
    CHECK(json["frame"] == "18446744073709551615");
    CHECK(json["bins"].size() == 256);
    CHECK(json["bins"][3] == 5);
    CHECK(json["mean"] == 1.5);
    CHECK(nlohmann::json::parse(reason_text("gone", "a \"b\" \xff"))["gone"].is_string());
}

TEST_CASE("a kept frame is that of the ring, with the fields of the call", "[web]") {
    const Image image(5, 3, 12, 1);
    transports::RingFrame ring;
    ring.header.number = 17;
    ring.header.frame_id = 4;
    ring.header.exposure_ns = 1500;
    ring.header.width = 5, ring.header.height = 3, ring.header.rows = 2;
    ring.truth.camera.position_m = {1.5, -2, 3};
    ring.pixels = image.pixels;
    const auto kept = kept_frame({4711, 1}, ring);
    CHECK((kept->camera == CameraId{4711, 1} && kept->number == 17));
    CHECK((kept->width == 5 && kept->height == 3 && kept->pixels == image.pixels));
    CHECK(kept->head["number"] == 17);
    CHECK(kept->head["frame"] == 4);
    CHECK(kept->head["exposure_us"] == 1.5);
    CHECK(kept->head["rows"] == 2);
    CHECK(kept->head["camera_position_m"] == nlohmann::ordered_json{1.5, -2.0, 3.0});
}

TEST_CASE("frames on a screen are kept while others go, oldest first", "[web]") {
    const auto frame = [](std::uint32_t camera, std::uint64_t number, std::size_t pixels) {
        auto one = std::make_shared<KeptFrame>();
        one->camera = {1, camera};
        one->number = number;
        one->pixels.resize(pixels);
        return one;
    };
    KeptFrames frames(100); // bytes
    const auto kept = [&frames](std::uint32_t camera) {
        std::vector<std::uint64_t> numbers;
        for (std::uint64_t number = 0; number < 40; ++number)
            if (frames.find({1, camera}, number)) numbers.push_back(number);
        return numbers;
    };
    using Numbers = std::vector<std::uint64_t>;
    for (std::uint64_t number = 1; number <= 7; ++number)
        frames.keep(frame(0, number, 10));
    CHECK(kept(0) == Numbers{3, 4, 5, 6, 7});
    frames.keep(frame(0, 5, 10)); // is there
    CHECK(kept(0) == Numbers{3, 4, 5, 6, 7});
    frames.keep(frame(0, 8, 51)); // never fits
    CHECK(kept(0) == Numbers{3, 4, 5, 6, 7});
    CHECK(frames.find({2, 0}, 5) == nullptr);
    // The last two that a viewer was sent.
    frames.shown(1, {1, 0}, 3);
    frames.shown(1, {1, 0}, 4);
    frames.shown(1, {1, 0}, 4); // another view
    for (std::uint64_t number = 9; number <= 12; ++number)
        frames.keep(frame(1, number, 10));
    CHECK(kept(0) == Numbers{3, 4});
    CHECK(kept(1) == Numbers{10, 11, 12});
    frames.shown(1, {1, 1}, 12);
    frames.keep(frame(1, 13, 10));
    CHECK(kept(0) == Numbers{4});
    CHECK(kept(1) == Numbers{10, 11, 12, 13});
    // A frame in use stays whole.
    const auto held = frames.find({1, 0}, 4);
    frames.left(1);
    frames.keep(frame(0, 14, 50));
    CHECK(kept(0) == Numbers{14});
    CHECK(kept(1).empty());
    CHECK(held->pixels.size() == 10);
    // All on screens: the bound holds still.
    for (std::uint64_t viewer = 1; viewer <= 8; ++viewer) {
        frames.keep(frame(0, 20 + viewer, 10));
        frames.shown(viewer, {1, 0}, 20 + viewer);
    }
    CHECK(kept(0) == Numbers{24, 25, 26, 27, 28});
}

TEST_CASE("viewers get what they ask for while the budget reaches", "[web]") {
    const View view{0, 0, 512, 512, 1, Reduce::max};
    const std::vector<Wish> wishes(2, {view, 10});
    for (const Share& share : shared_out(wishes, 12e6)) {
        CHECK(share.view == view);
        CHECK(share.hz == 10);
    }
    CHECK(shared_out({}, 12e6).empty());
}

TEST_CASE("over the budget first the rate is lowered, then the view", "[web]") {
    const View view{0, 0, 512, 512, 1, Reduce::max};
    for (const Share& share : shared_out(std::vector<Wish>(8, {view, 10}), 12e6)) {
        CHECK(share.view.bin == 1);
        CHECK_THAT(share.hz,
                   Catch::Matchers::WithinRel(12e6 / 8 / (512 * 512 * 2 + picture_header_bytes), 1e-9));
    }
    for (const Share& share : shared_out(std::vector<Wish>(20, {view, 10}), 12e6)) {
        CHECK(share.view.bin == 2); // 1.1 Hz otherwise
        CHECK(share.hz >= 4);
    }
    // Who takes little is not touched.
    std::vector<Wish> mixed(20, {view, 10});
    mixed.push_back({{0, 0, 64, 64, 1, Reduce::max}, 30});
    const Share small = shared_out(mixed, 12e6).back();
    CHECK((small.hz == 30 && small.view.bin == 1));
    // Nor is a slow rate that was asked for a reason for a coarser view.
    CHECK(shared_out(std::vector<Wish>(10, {view, 0.5}), 12e6).front().view.bin == 1);
    // More than a picture may have is binned in any case.
    CHECK(shared_out(std::vector<Wish>(1, {{0, 0, 4096, 4096, 1, Reduce::max}, 0.1}), 12e6)[0].view.bin == 4);
}

TEST_CASE("no mixture of viewers takes more than the budget", "[web]") {
    std::mt19937 dice(9);
    const auto side = [&dice] { return static_cast<std::uint32_t>(1 + dice() % View::max_side); };
    for (int round = 0; round < 300; ++round) {
        std::vector<Wish> wishes;
        for (std::size_t i = 0, n = 1 + dice() % 24; i < n; ++i)
            wishes.push_back({{0, 0, side(), side(), 1U << dice() % 7, Reduce::max}, 0.1 + dice() % 60});
        const double budget = 1e4 * std::pow(10, dice() % 4);
        const std::vector<Share> shares = shared_out(wishes, budget);
        double sum = 0;
        for (std::size_t i = 0; i < shares.size(); ++i) {
            sum += bytes_of(shares[i]);
            REQUIRE(shares[i].hz > 0);
            REQUIRE(shares[i].hz <= wishes[i].hz);
            REQUIRE(shares[i].view.bytes() <= max_picture_bytes);
            const bool fast_enough = shares[i].hz >= std::min(wishes[i].hz, min_hz) * (1 - 1e-9);
            REQUIRE((fast_enough || shares[i].view.bin == View::max_bin));
        }
        REQUIRE(sum <= budget * (1 + 1e-9));
    }
}

TEST_CASE("a pace lets frames at its rate pass, and no more", "[web]") {
    using namespace std::chrono_literals;
    const Pace::Clock::time_point begin{1000s};
    Pace pace(1.5);
    pace.set_rate(10, begin);
    // At just the rate, 40 ms early or late.
    std::mt19937 dice(3);
    for (int i = 0; i < 1000; ++i) {
        const auto now = begin + i * 100ms + std::chrono::milliseconds(dice() % 41);
        REQUIRE(pace.time_of(1, now) == now);
        pace.take(1, now);
    }
    const auto later = begin + 200s;
    CHECK(pace.time_of(1.5, later) == later);
    pace.take(1.5, later);
    CHECK(std::chrono::abs(pace.time_of(1, later) - (later + 100ms)) < 1us);
    pace.take(3, later); // a debt is waited for
    CHECK(std::chrono::abs(pace.time_of(1, later) - (later + 400ms)) < 1us);
}

TEST_CASE("a viewer that names ever other cameras takes no more memory", "[web]") {
    LivePictures pictures;
    const LivePictures::ViewerId one = pictures.join([](LiveDelivery) {}),
                                 other = pictures.join([](LiveDelivery) {});
    pictures.view(other, {{5, 7}, {}});
    for (std::uint32_t number = 0; number < 100; ++number) {
        pictures.view(one, {{5, number}, {}});
        CHECK(pictures.cameras() == (number == 7 ? 1 : 2));
    }
    pictures.leave(one);
    pictures.leave(other);
    pictures.visited({});
    CHECK(pictures.cameras() == 0);
}

} // namespace live_test
