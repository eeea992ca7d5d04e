// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/gpio_line.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "sync/inputs/gpio_line_name.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <new>
#include <optional>
#include <stdexcept>
#include <vector>

namespace obscura::sync {
namespace {

std::vector<std::string> chip_devices() {
    std::vector<std::string> devices;
    std::error_code error;
    for (const std::filesystem::path& entry : paths_in("/dev", error))
        if (entry.filename().string().starts_with("gpiochip")) devices.push_back(entry.string());
    std::sort(devices.begin(), devices.end());
    return devices;
}

#ifdef GPIOD_LINE_BULK_MAX_LINES // libgpiod 1.x

bool has_offset(gpiod_chip* chip, unsigned offset) {
    return offset < gpiod_chip_num_lines(chip);
}

std::optional<unsigned> offset_of(gpiod_chip* chip, const std::string& name) {
    gpiod_line* line = gpiod_chip_find_line(chip, name.c_str());
    if (line == nullptr) return std::nullopt;
    return gpiod_line_offset(line);
}

#else // libgpiod 2.x

bool has_offset(gpiod_chip* chip, unsigned offset) {
    const std::unique_ptr<gpiod_chip_info, decltype(&gpiod_chip_info_free)> info(gpiod_chip_get_info(chip),
                                                                                 gpiod_chip_info_free);
    return info && offset < gpiod_chip_info_get_num_lines(info.get());
}

std::optional<unsigned> offset_of(gpiod_chip* chip, const std::string& name) {
    const int offset = gpiod_chip_get_line_offset_from_name(chip, name.c_str());
    if (offset < 0) return std::nullopt;
    return static_cast<unsigned>(offset);
}

#endif

} // namespace

void refuse_gpio_line(const std::string& key, const std::string& line, const std::string& why) {
    throw HardwareError(fmt::format(
        "{}: GPIO line \"{}\": {}; allowed is a line's name or \"gpiochipN:OFFSET\"", key, line, why));
}

GpioLine find_gpio_line(const std::string& key, const std::string& line) {
    GpioLineName wanted;
    try {
        wanted = parse_gpio_line(line);
    } catch (const std::invalid_argument& error) {
        throw ConfigError(fmt::format("{}: {}", key, error.what()));
    }
    if (wanted.name.empty()) {
        GpioChip chip(gpiod_chip_open(wanted.device.c_str()));
        if (!chip) refuse_gpio_line(key, line, fmt::format("{}: {}", wanted.device, std::strerror(errno)));
        if (!has_offset(chip.get(), wanted.offset))
            refuse_gpio_line(key, line, fmt::format("{} has no such line", wanted.device));
        return {std::move(chip), wanted.offset, wanted.device};
    }
    for (const std::string& device : chip_devices()) {
        GpioChip chip(gpiod_chip_open(device.c_str()));
        if (!chip) continue;
        if (const auto offset = offset_of(chip.get(), line)) return {std::move(chip), *offset, device};
    }
    refuse_gpio_line(key, line, "no chip that can be opened has it");
}

#ifndef GPIOD_LINE_BULK_MAX_LINES // libgpiod 2.x

LineSettings new_line_settings() {
    LineSettings settings(gpiod_line_settings_new());
    if (!settings) throw std::bad_alloc();
    return settings;
}

LineRequest request_gpio_line(const std::string& key, const std::string& name, const GpioLine& line,
                              gpiod_line_settings& settings, std::size_t buffered_events) {
    const std::unique_ptr<gpiod_line_config, FreeWith<gpiod_line_config_free>> lines(gpiod_line_config_new());
    const std::unique_ptr<gpiod_request_config, FreeWith<gpiod_request_config_free>> request(
        gpiod_request_config_new());
    if (!lines || !request) throw std::bad_alloc();
    if (gpiod_line_config_add_line_settings(lines.get(), &line.offset, 1, &settings) != 0)
        refuse_gpio_line(key, name, std::strerror(errno));
    gpiod_request_config_set_consumer(request.get(), gpio_consumer);
    gpiod_request_config_set_event_buffer_size(request.get(), buffered_events);
    LineRequest held(gpiod_chip_request_lines(line.chip.get(), request.get(), lines.get()));
    if (!held) refuse_gpio_line(key, name, std::strerror(errno));
    return held;
}

#endif

} // namespace obscura::sync
