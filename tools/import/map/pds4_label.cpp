// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/pds4_label.hpp"

#include "core/error.hpp"
#include "core/text/number.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <string_view>

namespace obscura::tools {
namespace {

/// A name without its namespace.
std::string_view pds4_name(const pugi::xml_node& node) {
    const std::string_view name = node.name();
    return name.substr(name.find(':') == std::string_view::npos ? 0 : name.find(':') + 1);
}

pugi::xml_node pds4_child(const pugi::xml_node& node, std::string_view name) {
    return node.find_child([&](const pugi::xml_node& child) { return pds4_name(child) == name; });
}

std::string pds4_text(const pugi::xml_node& node) {
    return std::string(trimmed(node.child_value(), " \t\r\n"));
}

/// Whether it is an array of lines and samples of that number.
bool is_array_of(const pugi::xml_node& node, std::int64_t width, std::int64_t height) {
    if (!pds4_name(node).starts_with("Array")) return false;
    bool lines = false, samples = false;
    for (const pugi::xml_node axis : node.children()) {
        if (pds4_name(axis) != "Axis_Array") continue;
        const std::string axis_name = pds4_text(pds4_child(axis, "axis_name"));
        const auto elements = whole_number(pds4_text(pds4_child(axis, "elements")));
        lines = lines || (axis_name == "Line" && elements == height);
        samples = samples || (axis_name == "Sample" && elements == width);
    }
    return lines && samples;
}

} // namespace

void read_pds4_constants(const std::string& xml, const std::string& name, std::int64_t width,
                         std::int64_t height, const images::PdsSampleType& type,
                         images::PdsNumbers& numbers) {
    pugi::xml_document document;
    if (!document.load_buffer(xml.data(), xml.size())) return; // GDAL has read it: it was cut off
    const pugi::xml_node array =
        document.find_node([&](const pugi::xml_node& node) { return is_array_of(node, width, height); });
    const pugi::xml_node constants = pds4_child(array, "Special_Constants");
    if (!constants) return;
    numbers.missing.clear();
    for (const pugi::xml_node constant : constants.children()) {
        const std::string text = pds4_text(constant);
        if (constant.type() != pugi::node_element || images::says_nothing(text)) continue;
        const std::optional<double> sample = images::sample_constant(type, text);
        const std::string_view key = pds4_name(constant);
        if (!sample && !decimal_number(text))
            throw InputError(
                fmt::format("{}: {} is \"{}\", allowed are numbers and bit patterns of {} bits such as 0x80",
                            name, key, text.substr(0, 60), 8 * type.bytes));
        if (!sample) continue; // no sample can be that
        if (key == "valid_minimum")
            numbers.min_valid = *sample;
        else if (key == "valid_maximum")
            numbers.largest_valid = *sample;
        else
            numbers.missing.push_back(*sample);
    }
}

} // namespace obscura::tools
