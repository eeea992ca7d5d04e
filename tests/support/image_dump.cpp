// SPDX-License-Identifier: Apache-2.0
// Writes planes of images, as scenes read them, as f64 into files IMAGE.PLANE.f64, for tests in Python.
// Usage: image_dump PLANES IMAGE...
#include "images/image.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <fstream>
#include <string>

using namespace obscura;

int main(int argc, char* argv[]) {
    if (argc < 3) return 64;
    int status = 0;
    const int planes = std::stoi(argv[1]);
    for (int i = 2; i < argc; ++i)
        for (int plane = 0; plane < planes; ++plane)
            try {
                const std::string number = fmt::format("{}", plane);
                const images::Image image = images::read_image(argv[i], number);
                std::ofstream out(fmt::format("{}.{}.f64", argv[i], number),
                                  std::ios::binary | std::ios::trunc);
                out.write(reinterpret_cast<const char*>(image.values.data()),
                          static_cast<std::streamsize>(image.values.size() * sizeof(double)));
                if (!out.flush()) return 74;
            } catch (const std::exception& error) {
                fmt::print(stderr, "{}\n", error.what());
                status = 1;
            }
    return status;
}
