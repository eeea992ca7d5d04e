// SPDX-License-Identifier: Apache-2.0
// obscura_describe_features camera|page FILE: writes camera.xml or docs/reference/features.md.
#include "transports/gige/device/feature_table.hpp"
#include "transports/gige/genicam/description.hpp"
#include "transports/gige/genicam/feature_page.hpp"

#include <cstdio>
#include <exception>
#include <fstream>
#include <string>

int main(int argc, char** argv) {
    using namespace obscura::transports::gige;
    const std::string what = argc == 3 ? argv[1] : "";
    if (what != "camera" && what != "page") {
        std::fputs("usage: obscura_describe_features camera|page FILE\n", stderr);
        return 2;
    }
    try {
        std::ofstream file(argv[2], std::ios::binary);
        file << (what == "camera" ? describe_camera(feature_table()) : feature_page(feature_table()));
        file.close();
        if (file) return 0;
        std::fprintf(stderr, "%s: cannot be written\n", argv[2]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
    }
    return 1;
}
