// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/genicam/xml_presets.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/text.hpp"
#include "transports/gige/genicam/user_xml.hpp"
#include "transports/gige/genicam/xml_file.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::transports::gige {
namespace {

/// Memory without addresses, sufficient to check a description.
struct NoMemory final : GenicamEngine::Memory {
    bool load(std::uint64_t /*address*/, std::span<std::uint8_t> /*out*/) override { return false; }
    bool store(std::uint64_t /*address*/, std::span<const std::uint8_t> /*bytes*/) override { return false; }
};

} // namespace

std::vector<XmlPreset> xml_presets_of(const std::string& values) {
    std::vector<XmlPreset> presets;
    for (std::size_t begin = 0; begin < values.size();) {
        const std::size_t end = std::min(values.find(',', begin), values.size());
        constexpr std::string_view blanks = " \t\n";
        const std::string_view item = std::string_view(values).substr(begin, end - begin);
        begin = end + 1;
        if (trimmed(item, blanks).empty()) continue;
        const std::size_t equals = item.find('=');
        const bool has_value = equals != std::string_view::npos;
        presets.push_back(
            {std::string(trimmed(item, blanks)), std::string(trimmed(item.substr(0, equals), blanks)),
             std::string(has_value ? trimmed(item.substr(equals + 1), blanks) : ""), has_value});
    }
    return presets;
}

std::string explain_bad_preset(const XmlPreset& preset, std::string_view why, const std::string& file) {
    return fmt::format("\"{}\": {}, allowed is Feature=value of a feature in {}", printable(preset.item), why,
                       file);
}

std::string read_xml_file(const std::string& file) {
    try {
        return contents_of_genicam_file(file);
    } catch (const ConfigError& e) {
        throw ConfigError(fmt::format("gige.xml: {}", e.what()));
    }
}

std::string explain_invalid_xml(const std::string& file) {
    NoMemory memory;
    const auto quiet = GenicamEngine::suppress_messages();
    std::string contents;
    try {
        contents = contents_of_genicam_file(file);
    } catch (const ConfigError& e) {
        return e.what();
    }
    try {
        const GenicamEngine engine(contents, memory);
    } catch (const ConfigError& e) {
        return fmt::format("{}: {}", file, e.what());
    }
    return {};
}

std::string explain_invalid_values(const std::string& file, const std::string& values) {
    NoMemory memory;
    const auto quiet = GenicamEngine::suppress_messages();
    const GenicamEngine engine(contents_of_genicam_file(file), memory);
    for (const XmlPreset& preset : xml_presets_of(values)) {
        if (!preset.has_value) return explain_bad_preset(preset, "no =", file);
        if (engine.kind(preset.name) == GenicamEngine::Kind::absent)
            return explain_bad_preset(preset, "no such feature", file);
    }
    return {};
}

} // namespace obscura::transports::gige
