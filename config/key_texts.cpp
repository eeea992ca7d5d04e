// SPDX-License-Identifier: Apache-2.0
#include "config/key_texts.hpp"

#include "config/toml_text.hpp"
#include "core/overloaded.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace obscura::config {
namespace {

/// A limit for people: 1e12 rather than thirteen digits, 1e-6 rather than 1e-06.
std::string limit_text(double value) {
    std::string text = fmt::format("{}", value);
    if (std::abs(value) >= 1e7) text = fmt::format("{:.6e}", value);
    const std::size_t e = text.find('e');
    if (e == std::string::npos) return text;
    std::string mantissa = text.substr(0, e);
    if (mantissa.find('.') != std::string::npos) mantissa.erase(mantissa.find_last_not_of("0") + 1);
    if (mantissa.back() == '.') mantissa.pop_back();
    return fmt::format("{}e{}", mantissa, std::stoi(text.substr(e + 1)));
}

std::string list_text(const std::vector<double>& values) {
    std::string text;
    for (const double value : values)
        text += (text.empty() ? "" : ", ") + number_text(value);
    return "[" + text + "]";
}

} // namespace

std::string range_text(const Range& range, std::string_view unit) {
    const std::string suffix = unit.empty() ? "" : fmt::format(" {}", unit);
    if (std::isfinite(range.min) && std::isfinite(range.max))
        return fmt::format("{} to {}{}", limit_text(range.min), limit_text(range.max), suffix);
    if (std::isfinite(range.min)) return fmt::format("{} or more{}", limit_text(range.min), suffix);
    if (std::isfinite(range.max)) return fmt::format("at most {}{}", limit_text(range.max), suffix);
    return {};
}

std::string type_name(const Target& target) {
    using Text = std::string;
    return std::visit(Overloaded{
                          [](bool*) { return Text("true or false"); },
                          [](double*) { return Text("a number"); },
                          [](Scaled) { return Text("a number"); },
                          [](std::string*) { return Text("a string"); },
                          [](const Path&) { return Text("a file name"); },
                          [](Files) { return Text("a file name, or an array of file names"); },
                          [](const Word&) { return Text("a string"); },
                          [](Vec3*) { return Text("an array of 3 numbers [x, y, z]"); },
                          [](Quat*) { return Text("an array of 4 numbers [w, x, y, z]"); },
                          [](Numbers n) { return fmt::format("an array of {} numbers", n.count); },
                          [](std::vector<double>*) { return Text("an array of numbers"); },
                          [](Faces) { return Text("an array of faces [[[x, y, z], ...], ...]"); },
                          [](Curve) { return Text("an array of [wavelength_nm, value] pairs"); },
                          [](auto*) { return Text("an integer"); },
                      },
                      target);
}

std::string toml_string(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            out += std::string("\\") + c;
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            out += fmt::format("\\u{:04X}", static_cast<unsigned char>(c));
        else
            out += c;
    }
    return out + "\"";
}

std::string value_text(const Key& key) {
    if (std::string table = key.table_text(); !table.empty()) return table;
    return std::visit(
        Overloaded{
            [](bool* v) { return std::string(*v ? "true" : "false"); },
            [](double* v) { return number_text(*v); },
            [](Scaled v) {
                // The file value that comes closest to reading back as the same SI value.
                double text = *v.value / v.si;
                for (const double near :
                     {text, std::nextafter(text, -HUGE_VAL), std::nextafter(text, HUGE_VAL)})
                    if (near * v.si == *v.value) {
                        text = near;
                        break;
                    }
                for (int digits = 6; digits < 17; ++digits) {
                    const double shorter = std::stod(fmt::format("{:.{}g}", text, digits));
                    if (shorter * v.si == *v.value) return number_text(shorter);
                }
                return number_text(text);
            },
            [](std::string* v) { return toml_string(*v); },
            [](const Path& v) { return toml_string(*v.value); },
            [](Files v) {
                std::string text;
                for (const std::string& file : *v.files)
                    text += (text.empty() ? "" : ", ") + toml_string(file);
                return "[" + text + "]";
            },
            [](const Word& v) { return toml_string(v.get()); },
            [](Vec3* v) {
                return fmt::format("[{}, {}, {}]", number_text(v->x), number_text(v->y), number_text(v->z));
            },
            [](Quat* v) {
                return fmt::format("[{}, {}, {}, {}]", number_text(v->w), number_text(v->x),
                                   number_text(v->y), number_text(v->z));
            },
            [](Numbers v) {
                return list_text({v.first, v.first + v.count});
            },
            [](std::vector<double>* v) { return list_text(*v); },
            [](Faces v) {
                std::string text;
                for (const std::vector<Vec3>& face : *v.faces) {
                    std::string corners;
                    for (Vec3 corner : face)
                        corners += (corners.empty() ? "" : ", ") + value_text(config::key("", &corner));
                    text += fmt::format("{}[{}]", text.empty() ? "" : ", ", corners);
                }
                return "[" + text + "]";
            },
            [](Curve v) {
                std::string text;
                for (const SpectralPoint& p : *v.points) {
                    double nm = p.wavelength_m;
                    double value = p.value;
                    text += fmt::format("{}[{}, {}]", text.empty() ? "" : ", ",
                                        value_text(config::key("", Scaled{&nm, 1e-9})),
                                        value_text(config::key("", &value)));
                }
                return "[" + text + "]";
            },
            [](auto* v) { return fmt::format("{}", *v); },
        },
        key.target);
}

std::string type_text(const Key& key) {
    std::string text = type_name(key.target);
    for (const std::string_view article : {"a ", "an "})
        if (text.starts_with(article)) return text.substr(article.size());
    return text;
}

std::string allowed_text(const Key& key) {
    if (!key.choices().empty()) return fmt::format("{}", fmt::join(key.choices(), " | "));
    const std::string range = range_text(key.range(), key.unit());
    if (!range.empty()) return range;
    return std::string(key.unit());
}

std::string print_keys(const Keys& keys) {
    std::string out;
    for (const Key& key : keys) {
        if (!key.is_printed()) continue;
        const std::string allowed = allowed_text(key);
        std::string comment(key.help());
        if (!allowed.empty()) comment += fmt::format(" ({})", allowed);
        out += fmt::format("# {}\n{} = {}\n", comment, key.name, value_text(key));
    }
    return out;
}

} // namespace obscura::config
