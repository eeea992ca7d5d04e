# SPDX-License-Identifier: Apache-2.0
# Every third-party dependency is found here and nowhere else. Debian 12 and Debian 13 both serve.

find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(fmt REQUIRED)

# Embree 4 (Debian 13) or 3 (Debian 12); renderer/shapes/embree_compat.hpp hides the difference.
find_package(embree 4 QUIET)
if(NOT embree_FOUND)
    find_package(embree 3 REQUIRED)
endif()

find_package(OpenEXR REQUIRED)
find_package(TBB REQUIRED)
find_package(PNG REQUIRED)
find_package(TIFF REQUIRED)
find_package(JPEG REQUIRED)
find_package(assimp REQUIRED)
find_package(ZLIB REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(pugixml REQUIRED)
pkg_check_modules(CFITSIO REQUIRED IMPORTED_TARGET cfitsio)
pkg_check_modules(ERFA REQUIRED IMPORTED_TARGET erfa)
pkg_check_modules(LIBUSB REQUIRED IMPORTED_TARGET libusb-1.0)
pkg_check_modules(LZ4 REQUIRED IMPORTED_TARGET liblz4)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(MINIZIP REQUIRED IMPORTED_TARGET minizip)
pkg_check_modules(HWY REQUIRED IMPORTED_TARGET libhwy)
pkg_check_modules(CRYPTO REQUIRED IMPORTED_TARGET libcrypto)
pkg_check_modules(SSL REQUIRED IMPORTED_TARGET libssl)
# 1.6 (Debian 12) or 2.x (Debian 13); sync/inputs/gpio_input.cpp hides the difference.
pkg_check_modules(GPIOD REQUIRED IMPORTED_TARGET libgpiod)
pkg_check_modules(ARAVIS REQUIRED IMPORTED_TARGET aravis-0.8)

# toml++ is header-only; both Debian releases ship the pkg-config file.
pkg_check_modules(TOMLPLUSPLUS REQUIRED IMPORTED_TARGET tomlplusplus)

# Optional: machine code of models, on x86-64; without it they are interpreted.
find_package(asmjit QUIET)
# Optional: for the helper obscura-gdal, which has a package of its own. Nothing else links it.
pkg_check_modules(GDAL QUIET IMPORTED_TARGET gdal)
# Optional: for `obscura texture mount`.
pkg_check_modules(FUSE3 QUIET IMPORTED_TARGET fuse3)

if(OBSCURA_BUILD_TESTS)
    find_package(Catch2 REQUIRED)
endif()
