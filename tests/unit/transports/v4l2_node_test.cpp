// SPDX-License-Identifier: Apache-2.0
#include "core/camera/frame.hpp"
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/transports/v4l2_fake_driver.hpp"
#include "transports/v4l2/v4l2_node.hpp"

#include <linux/videodev2.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace v4l2_node_test {

using namespace obscura;
using namespace obscura::transports;
using obscura::test::FakeV4l2Driver;
using Kind = FakeV4l2Driver::Kind;

namespace {

constexpr V4l2Image image_12bit{20, 6, 12};

V4l2Settings settings_for(const FakeV4l2Driver& driver) {
    V4l2Settings settings;
    settings.device = driver.path;
    return settings;
}

FrameRef make_frame(FramePool& pool, std::uint64_t id, V4l2Image image) {
    FrameRef frame = pool.acquire();
    frame->info.frame_id = id;
    frame->info.width = image.width, frame->info.height = image.height;
    frame->info.bits_per_pixel = image.bits_per_pixel;
    for (std::int32_t y = 0; y < image.height; ++y)
        for (std::int32_t x = 0; x < image.width; ++x)
            frame->row(y)[static_cast<std::size_t>(x)] = static_cast<std::uint16_t>(
                (static_cast<unsigned>(x) * 301 + static_cast<unsigned>(y) * 37 + id * 11) &
                ((1u << image.bits_per_pixel) - 1));
    frame->publish_rows(image.height);
    return frame;
}

/// Sends one frame and returns what became of it.
V4l2Result send(V4l2Node& node, const Frame& frame, Time edge = {}) {
    const V4l2Result place = node.acquire(0);
    if (place != V4l2Result::ok) return place;
    node.fill(frame, 0, frame.info.height);
    return node.send(frame.info.frame_id, edge, 0);
}

std::string refusal(FakeV4l2Driver& driver, const V4l2Settings& settings, V4l2Image image = image_12bit,
                    double frame_rate_hz = 0) {
    try {
        const V4l2Node node(driver, settings, image, frame_rate_hz);
    } catch (const HardwareError& error) {
        CHECK(driver.open_descriptors() == 0);
        CHECK(driver.open_mappings() == 0);
        CHECK(driver.complaints().empty());
        CHECK(std::string(error.what()).find('\n') == std::string::npos);
        return error.what();
    }
    return "accepted";
}

} // namespace

TEST_CASE("V4L2 images carry every pixel in the format's own bytes") {
    const auto kind = GENERATE(Kind::strict, Kind::newer_loopback, Kind::older_loopback);
    const auto format =
        GENERATE(V4l2Format::grey, V4l2Format::y10, V4l2Format::y12, V4l2Format::y14, V4l2Format::y16);
    const auto padding = GENERATE(0u, 12u);
    FakeV4l2Driver driver;
    driver.kind = kind;
    driver.stride_extra = padding;
    driver.buffer_page = 4096;
    V4l2Settings settings = settings_for(driver);
    settings.format = format;
    FramePool pool(1, 120, 6);
    {
        V4l2Node node(driver, settings, image_12bit);
        const FrameRef frame = make_frame(pool, 3, image_12bit);
        for (int i = 0; i < 20; ++i)
            REQUIRE(send(node, *frame) == V4l2Result::ok);

        const std::size_t pixel = format == V4l2Format::grey ? 1 : 2;
        const std::size_t stride = 20 * pixel + padding;
        CHECK(node.image_bytes() == stride * 6);
        for (const auto& image : driver.images()) {
            REQUIRE(image.bytes.size() == stride * 6);
            for (std::size_t y = 0; y < 6; ++y) {
                for (std::size_t x = 0; x < 20; ++x) {
                    const unsigned dn = frame->row(static_cast<std::int32_t>(y))[x];
                    const std::uint8_t* at = &image.bytes[y * stride + x * pixel];
                    const unsigned found = pixel == 1 ? at[0] : at[0] | static_cast<unsigned>(at[1]) << 8;
                    // 12-bit numbers: 8 and 10 bits keep the high ones, the deeper formats hold them as they
                    // are.
                    const unsigned expected = format == V4l2Format::grey  ? dn / 16
                                              : format == V4l2Format::y10 ? dn / 4
                                                                          : dn;
                    REQUIRE(found == expected);
                }
                for (std::size_t i = 20 * pixel; i < stride; ++i)
                    REQUIRE(image.bytes[y * stride + i] == 0);
            }
        }
        CHECK(driver.image_count() == 20);
    }
    CHECK(driver.complaints().empty());
    CHECK(driver.open_descriptors() == 0);
    CHECK(driver.open_mappings() == 0);
}

TEST_CASE("The way of transfer follows the driver's behaviour") {
    FakeV4l2Driver driver;
    V4l2Settings settings = settings_for(driver);
    FramePool pool(1, 120, 6);
    const FrameRef frame = make_frame(pool, 1, image_12bit);
    const auto indices = [&] {
        std::string result;
        for (const auto& image : driver.images())
            result += std::to_string(image.index);
        return result;
    };
    const auto run = [&](bool writes) {
        V4l2Node node(driver, settings, image_12bit);
        CHECK(node.writes() == writes);
        CHECK_THAT(node.describe(), Catch::Matchers::ContainsSubstring(writes ? ", write()" : ", mmap with"));
        CHECK_THAT(node.describe(),
                   Catch::Matchers::ContainsSubstring("fake \"Fake?node\", Y16 20x6, 12-bit data"));
        for (int i = 0; i < 10; ++i)
            REQUIRE(send(node, *frame, {1'000'000}) == V4l2Result::ok);
    };

    SECTION("a strict driver: buffers in its order") {
        driver.kind = Kind::strict;
        run(false);
        CHECK(indices() == "0123456701");
    }
    SECTION("a loopback that gives back the oldest: none is asked back but to find out") {
        driver.kind = Kind::newer_loopback;
        run(false);
        CHECK(indices() == "0123456701");
        CHECK(driver.calls("DQBUF") == 2);
    }
    SECTION("a loopback that gives back the newest: no image was shown to find out") {
        driver.kind = Kind::older_loopback;
        run(true);
        CHECK(driver.image_count() == 10);
        CHECK(driver.images().front().stamp_us == -1);
    }
    SECTION("the same when mmap is wanted: buffers in turn, none asked back") {
        driver.kind = Kind::older_loopback;
        settings.io = V4l2Io::mmap;
        run(false);
        CHECK(indices() == "0123456701");
        CHECK(driver.calls("DQBUF") == 2);
    }
    SECTION("write() when it is wanted") {
        settings.io = V4l2Io::write;
        run(true);
        CHECK(driver.calls("REQBUFS") == 0);
    }
    SECTION("write() when there is nothing else") {
        driver.capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_READWRITE;
        run(true);
        settings.io = V4l2Io::mmap;
        CHECK(refusal(driver, settings) ==
              "v4l2: /dev/video-fake: fake \"Fake?node\" has no mmap, only write()");
    }
    SECTION("mmap when there is nothing else") {
        driver.capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
        driver.kind = Kind::older_loopback;
        run(false);
        settings.io = V4l2Io::write;
        CHECK(refusal(driver, settings) ==
              "v4l2: /dev/video-fake: fake \"Fake?node\" has no write(), only mmap");
    }
    CHECK(driver.complaints().empty());
}

TEST_CASE("A V4L2 time stamp is the trigger's edge to the microsecond") {
    FakeV4l2Driver driver;
    driver.kind = GENERATE(Kind::strict, Kind::newer_loopback);
    FramePool pool(1, 120, 6);
    const FrameRef frame = make_frame(pool, 1, image_12bit);
    V4l2Node node(driver, settings_for(driver), image_12bit);
    for (const std::int64_t ns :
         {std::int64_t{1'000}, std::int64_t{777'000'001'999}, std::int64_t{123'456'789'012'345}}) {
        REQUIRE(send(node, *frame, {ns}) == V4l2Result::ok);
        CHECK(driver.images().back().stamp_us == ns / 1000);
        CHECK((driver.images().back().flags & V4L2_BUF_FLAG_TIMESTAMP_COPY) != 0);
    }
}

TEST_CASE("The frame counter sits in the first four pixels, a byte each") {
    FakeV4l2Driver driver;
    V4l2Settings settings = settings_for(driver);
    settings.frame_counter = true;
    settings.format = GENERATE(V4l2Format::grey, V4l2Format::y16);
    settings.io = GENERATE(V4l2Io::mmap, V4l2Io::write);
    FramePool pool(1, 120, 6);
    const std::uint64_t id = 0x5A04C3B2A1;
    {
        V4l2Node node(driver, settings, image_12bit);
        REQUIRE(send(node, *make_frame(pool, id, image_12bit)) == V4l2Result::ok);
    }
    const std::vector<std::uint8_t> bytes = driver.images().front().bytes;
    const std::vector<std::uint8_t> expected =
        settings.format == V4l2Format::grey ? std::vector<std::uint8_t>{0xA1, 0xB2, 0xC3, 0x04}
                                            : std::vector<std::uint8_t>{0xA1, 0, 0xB2, 0, 0xC3, 0, 0x04, 0};
    CHECK(std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + static_cast<long>(expected.size())) ==
          expected);
    CHECK(refusal(driver, settings, {3, 6, 12}) ==
          "v4l2: /dev/video-fake: a frame counter needs images 4 pixels wide");
}

TEST_CASE("What the driver changes silently is refused with one line") {
    FakeV4l2Driver driver;
    const V4l2Settings settings = settings_for(driver);
    const std::string node = "v4l2: /dev/video-fake: ";
    std::uint32_t format = 0, width = 0, height = 0, stride = 0, size = 0, field = 0;
    driver.change_format = [&](auto& f, auto& w, auto& h, auto& b, auto& s, auto& i) {
        if (format != 0) f = format;
        if (width != 0) w = width;
        if (height != 0) h = height;
        if (stride != 0) b = stride;
        if (size != 0) s = size;
        if (field != 0) i = field;
    };
    SECTION("pixels") {
        format = V4L2_PIX_FMT_YUYV;
        CHECK(refusal(driver, settings) ==
              node + "the driver made YUYV 20x6 of Y16 20x6 (does another program hold the format?)");
        format = 0x01020304; // not to be printed as it is
        CHECK(refusal(driver, settings) ==
              node + "the driver made ???? 20x6 of Y16 20x6 (does another program hold the format?)");
    }
    SECTION("size") {
        width = 640, height = 480;
        CHECK(refusal(driver, settings) ==
              node + "the driver made Y16 640x480 of Y16 20x6 (does another program hold the format?)");
        width = 0, height = 8; // the height alone
        CHECK(refusal(driver, settings) ==
              node + "the driver made Y16 20x8 of Y16 20x6 (does another program hold the format?)");
    }
    SECTION("bytes a row: formats counted as packed") {
        stride = 25;
        CHECK(refusal(driver, settings) ==
              node + "the driver counts 25 bytes a row for Y16 20x6, 40 are needed");
    }
    SECTION("bytes an image") {
        size = 239;
        CHECK(refusal(driver, settings) ==
              node + "the driver counts 239 bytes an image for Y16 20x6, 240 are needed");
        stride = 0x80000000; // x 6 does not fit 32 bits
        size = 0;
        CHECK(refusal(driver, settings) ==
              node + "the driver counts 240 bytes an image for Y16 20x6, 12884901888 are needed");
    }
    SECTION("interlacing") {
        field = V4L2_FIELD_INTERLACED;
        CHECK(refusal(driver, settings) == node + "the driver made Y16 20x6 interlaced (field 4)");
    }
    CHECK(driver.image_count() == 0);
}

TEST_CASE("A node that will not do is refused with one line") {
    FakeV4l2Driver driver;
    const V4l2Settings settings = settings_for(driver);
    double rate_hz = 0;
    const std::string node = "v4l2: /dev/video-fake: ";
    std::string failing;
    int error = 0;
    driver.fault = [&](const std::string& call) { return call == failing ? -error : 0; };
    const auto with = [&](const std::string& call, int number) {
        failing = call;
        error = number;
        return refusal(driver, settings, image_12bit, rate_hz);
    };
    CHECK(with("open", ENOENT) == node + "is not there");
    CHECK(with("open", ENODEV) == node + "is not there");
    CHECK(with("open", EACCES) ==
          node + "may not be opened for reading and writing (is the user in the group of the node?)");
    CHECK(with("open", EBUSY) == node + "is in use by another program");
    CHECK(with("open", EMFILE) == node + "cannot be opened: Too many open files");
    CHECK(with("QUERYCAP", ENOTTY) == node + "is not a V4L2 node");
    CHECK(with("QUERYCAP", ENODEV) == node + "is not there");
    CHECK(with("S_FMT", EBUSY) == node + "another program uses it and holds its format; Y16 20x6 is needed");
    CHECK(with("S_FMT", EINVAL) == node + "Y16 20x6 refused: Invalid argument");
    CHECK(with("REQBUFS", EBUSY) == node + "another program streams to it");
    CHECK(with("REQBUFS", ENOMEM) == node + "no buffers available: Cannot allocate memory");
    CHECK(with("QUERYBUF", EINVAL) == node + "buffer 0 cannot be asked for: Invalid argument");
    CHECK(with("mmap", ENOMEM) == node + "buffer 0 cannot be mapped: Cannot allocate memory");
    // Only a hint, so its failure is none.
    rate_hz = 12.5;
    CHECK(with("S_PARM", ENOTTY) == "accepted");
    CHECK(with("nothing", 0) == "accepted");
    CHECK(driver.frame_interval() == std::pair<std::uint32_t, std::uint32_t>{1000, 12500});

    driver.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    CHECK(refusal(driver, settings) ==
          node + "fake \"Fake?node\" is no video output but a capture node (a v4l2loopback "
                 "or another output node is needed)");
    driver.capabilities = V4L2_CAP_VIDEO_OUTPUT;
    CHECK(refusal(driver, settings) == node + "fake \"Fake?node\" takes neither write() nor buffers");
    driver.capabilities = 0;
    driver.character_device = false;
    CHECK(refusal(driver, settings) == node + "is not a V4L2 node");
    driver.character_device = true;
    CHECK(refusal(driver, settings, {20, 0, 12}) == node + "cannot show 20x0 pixels");
    CHECK(refusal(driver, settings, {70000, 1, 12}) == node + "cannot show 70000x1 pixels");
}

TEST_CASE("Things that are no video node, through the real system calls") {
    const auto refused = [](const std::string& path) {
        V4l2Settings settings;
        settings.device = path;
        try {
            const V4l2Node node(system_v4l2_calls(), settings, image_12bit);
        } catch (const HardwareError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    std::string folder = (std::filesystem::temp_directory_path() / "obscura-v4l2-XXXXXX").string();
    REQUIRE(::mkdtemp(folder.data()) != nullptr);
    const std::string file = folder + "/file", pipe = folder + "/pipe";
    std::ofstream(file) << "not a device";
    REQUIRE(std::system(("mkfifo " + pipe).c_str()) == 0);
    CHECK(refused("/dev/null") == "v4l2: /dev/null: is not a V4L2 node");
    CHECK(refused(file) == "v4l2: " + file + ": is not a V4L2 node");
    CHECK(refused(pipe) == "v4l2: " + pipe + ": is not a V4L2 node");
    CHECK(refused(folder) == "v4l2: " + folder + ": cannot be opened: Is a directory");
    CHECK(refused(folder + "/none") == "v4l2: " + folder + "/none: is not there");
    std::filesystem::remove_all(folder);
}

TEST_CASE("A driver that takes only a part of an image, fails or has no room") {
    FakeV4l2Driver driver;
    V4l2Settings settings = settings_for(driver);
    FramePool pool(1, 120, 6);
    const FrameRef frame = make_frame(pool, 1, image_12bit);
    SECTION("part of an image written") {
        settings.io = V4l2Io::write;
        driver.write_most = 100;
        V4l2Node node(driver, settings, image_12bit);
        CHECK(send(node, *frame) == V4l2Result::lost);
        CHECK(node.problem() == "v4l2: /dev/video-fake: writing an image: the driver took only a part");
    }
    SECTION("no room: the image is dropped, a later one goes out") {
        driver.consumes = false;
        V4l2Node node(driver, settings, image_12bit);
        for (int i = 0; i < 8; ++i)
            REQUIRE(send(node, *frame) == V4l2Result::ok);
        CHECK(send(node, *frame) == V4l2Result::busy);
        CHECK(send(node, *frame) == V4l2Result::busy);
        CHECK(driver.image_count() == 8);
        CHECK(node.alive());
    }
    SECTION("no room to write") {
        settings.io = V4l2Io::write;
        bool full = true;
        driver.fault = [&](const std::string& call) { return call == "write" && full ? -EAGAIN : 0; };
        V4l2Node node(driver, settings, image_12bit);
        CHECK(send(node, *frame) == V4l2Result::busy);
        full = false;
        CHECK(send(node, *frame) == V4l2Result::ok);
    }
    SECTION("the node goes away") {
        settings.io = GENERATE(V4l2Io::mmap, V4l2Io::write);
        V4l2Node node(driver, settings, image_12bit);
        REQUIRE(send(node, *frame) == V4l2Result::ok);
        CHECK(node.alive());
        driver.remove();
        CHECK_FALSE(node.alive());
        CHECK(send(node, *frame) == V4l2Result::lost);
        CHECK(node.problem() == "v4l2: /dev/video-fake: is gone");
    }
    SECTION("the driver passes the probe and gives back the newest buffer later") {
        V4l2Node node(driver, settings, image_12bit);
        driver.kind = Kind::older_loopback;
        for (int i = 0; i < 8; ++i)
            REQUIRE(send(node, *frame) == V4l2Result::ok);
        CHECK(send(node, *frame) == V4l2Result::out_of_order);
    }
    SECTION("the driver gives back a buffer that does not exist") {
        V4l2Node node(driver, settings, image_12bit);
        for (int i = 0; i < 8; ++i)
            REQUIRE(send(node, *frame) == V4l2Result::ok);
        driver.give_back_index = 1000;
        CHECK(send(node, *frame) == V4l2Result::lost);
        CHECK(node.problem() == "v4l2: /dev/video-fake: getting a buffer back: Input/output error");
    }
    CHECK(driver.complaints().empty());
}

TEST_CASE("Few buffers work, with a warning") {
    FakeV4l2Driver driver;
    driver.buffers_most = 2;
    V4l2Node node(driver, settings_for(driver), image_12bit);
    CHECK_THAT(node.warning(), Catch::Matchers::ContainsSubstring("only 2 buffers"));
    FramePool pool(1, 120, 6);
    for (int i = 0; i < 5; ++i)
        CHECK(send(node, *make_frame(pool, 1, image_12bit)) == V4l2Result::ok);
}

} // namespace v4l2_node_test
