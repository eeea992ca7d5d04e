// SPDX-License-Identifier: Apache-2.0
// Compares images that a video consumer saved with the pattern of v4l2_stream, pixel by pixel, and their time
// stamps with the edges. The frame number of each image is in the low bytes of its first four pixels.
//   image_check FILE --size WxH --format GREY|Y16 --bits N --count N [--stamps FILE --edges FILE] [--repeats
//   yes]
// FILE of --stamps: one time stamp in microseconds a line, in the order of the images. --repeats allows the
// same image twice in a row (a consumer with a clock of its own).
#include "tests/kernel/programs/pattern.hpp"

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

namespace {

int complain(const std::string& text) {
    std::cerr << "image_check: " << text << '\n';
    return 1;
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return complain("no file given");
    std::map<std::string, std::string> option;
    for (int i = 2; i + 1 < argc; i += 2)
        option[argv[i]] = argv[i + 1];
    int width = 0, height = 0;
    if (std::sscanf(option["--size"].c_str(), "%dx%d", &width, &height) != 2)
        return complain("no size given");
    const bool grey = option["--format"] == "GREY";
    const int bits = std::stoi(option["--bits"]);
    const std::size_t pixel = grey ? 1 : 2;
    const std::size_t image = pixel * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);

    std::ifstream file(argv[1], std::ios::binary);
    const std::vector<char> data{std::istreambuf_iterator<char>(file), {}};
    const std::size_t count = data.size() / image;
    if (data.size() % image != 0)
        return complain("the file ends inside an image: " + std::to_string(data.size()));
    if (count < std::stoul(option["--count"])) return complain("only " + std::to_string(count) + " images");

    std::vector<std::uint64_t> stamps;
    if (std::ifstream in(option["--stamps"]); in) stamps.assign(std::istream_iterator<std::uint64_t>(in), {});
    std::map<std::uint64_t, std::uint64_t> edges;
    if (std::ifstream in(option["--edges"]); in)
        for (std::uint64_t id = 0, edge = 0; in >> id >> edge;)
            edges[id] = edge;
    if (!option["--stamps"].empty() && stamps.size() < count)
        return complain(std::to_string(stamps.size()) + " time stamps for " + std::to_string(count) +
                        " images");

    std::uint64_t previous = 0, missed = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto* bytes = reinterpret_cast<const unsigned char*>(data.data() + i * image);
        const auto at = [&](std::size_t n) -> unsigned {
            return grey ? bytes[n] : bytes[2 * n] | static_cast<unsigned>(bytes[2 * n + 1]) << 8;
        };
        const std::uint64_t id = at(0) | at(1) << 8 | at(2) << 16 | at(3) << 24;
        for (int y = 0; y < height; ++y) {
            for (int x = y == 0 ? 4 : 0; x < width; ++x) {
                const unsigned dn = obscura::rig::pattern(x, y, id, bits);
                const unsigned expected = grey ? dn >> (bits > 8 ? bits - 8 : 0) : dn;
                const unsigned found = at(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                          static_cast<std::size_t>(x));
                if (found != expected)
                    return complain("image " + std::to_string(i) + " (frame " + std::to_string(id) +
                                    "): pixel " + std::to_string(x) + "," + std::to_string(y) + " is " +
                                    std::to_string(found) + " and not " + std::to_string(expected));
            }
        }
        if (i > 0 && (id < previous || (id == previous && option["--repeats"] != "yes")))
            return complain("frame " + std::to_string(id) + " follows " + std::to_string(previous));
        if (i > 0 && id > previous) missed += id - previous - 1;
        previous = id;
        if (!stamps.empty() && (edges.count(id) == 0 || edges[id] != stamps[i]))
            return complain("frame " + std::to_string(id) + ": time stamp " + std::to_string(stamps[i]) +
                            " us, its edge was at " + std::to_string(edges[id]));
    }
    std::cout << count << " images, every pixel as sent, " << missed << " frames between them not seen"
              << (stamps.empty() ? "" : ", every time stamp its edge") << '\n';
    return 0;
}
