// SPDX-License-Identifier: Apache-2.0
#include "emulator/config/configuration_entries.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace obscura::emulator {
namespace {

using config::Entry;
using config::Section;

void append(std::vector<Entry>& all, std::vector<Entry> more) {
    std::move(more.begin(), more.end(), std::back_inserter(all));
}

/// Lines "key = value" that were printed.
std::vector<Entry> printed_entries(const std::string& text, const std::string& path) {
    std::vector<Entry> entries;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t sign = line.find(" = ");
        if (line.starts_with('#') || sign == std::string::npos) continue;
        entries.push_back({path + "." + line.substr(0, sign), line.substr(sign + 3), "", ""});
    }
    return entries;
}

/// Entries of sections under their own names behind `prefix`.
std::vector<Entry> entries_of_each(const std::vector<Section>& sections, const std::vector<Section>& fresh,
                                   const std::string& prefix) {
    std::vector<Entry> all;
    for (std::size_t i = 0; i < sections.size(); ++i)
        append(all, entries_of(sections[i], fresh[i], prefix + std::string(sections[i].name)));
    return all;
}

/// Entries of one [[camera]].
std::vector<Entry> entries_of_camera(DaemonConfig& camera, DaemonConfig& fresh, const std::string& path) {
    std::vector<Entry> all = printed_entries(camera.view, path + ".view");
    const std::vector<Section> sections = camera_sections(camera), defaults = camera_sections(fresh);
    for (std::size_t i = 0; i < sections.size(); ++i) {
        if (sections[i].name == "trigger" && !camera.own_trigger) continue;
        const bool itself = sections[i].name == "camera";
        append(all, entries_of(sections[i], defaults[i],
                               itself ? path : fmt::format("{}.{}", path, sections[i].name)));
    }
    return all;
}

} // namespace

std::vector<Entry> configuration_entries(const DaemonConfig& config) {
    DaemonConfig c = config, fresh; // the sections bind to what can be written
    std::vector<Entry> all = entries_of_each(shared_sections(c), shared_sections(fresh), "");
    if (!c.several) {
        append(all, entries_of_each(camera_sections(c), camera_sections(fresh), ""));
    } else {
        std::vector<DaemonConfig*> cameras{&c};
        for (DaemonConfig& other : c.others)
            cameras.push_back(&other);
        const auto one = std::find_if(cameras.begin(), cameras.end(),
                                      [](const DaemonConfig* camera) { return !camera->own_trigger; });
        if (one != cameras.end())
            append(all, entries_of(section_of((*one)->trigger), section_of(fresh.trigger), "trigger"));
        for (std::size_t i = 0; i < cameras.size(); ++i)
            append(all, entries_of_camera(*cameras[i], fresh, fmt::format("camera[{}]", i)));
    }
    for (Entry& entry : all) {
        const auto found = config.sources.find(entry.key);
        entry.source = found == config.sources.end() ? "default" : found->second;
    }
    return all;
}

std::string configuration_sha256(const std::vector<Entry>& entries) {
    std::vector<std::string> lines;
    for (const Entry& entry : entries)
        lines.push_back(fmt::format("{} = {}\n", entry.key, entry.value));
    std::sort(lines.begin(), lines.end());
    std::string text;
    for (const std::string& line : lines)
        text += line;
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int bytes = 0;
    if (EVP_Digest(text.data(), text.size(), digest.data(), &bytes, EVP_sha256(), nullptr) != 1)
        throw std::runtime_error("libcrypto has no SHA-256");
    std::string hex;
    for (std::size_t i = 0; i < bytes; ++i)
        hex += fmt::format("{:02x}", digest[i]);
    return hex;
}

} // namespace obscura::emulator
