// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/genicam/description.hpp"

#include "core/text/text.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace obscura::transports::gige {
namespace {

constexpr std::string_view head = R"(<?xml version="1.0" encoding="UTF-8"?>
<!-- Made from the feature table (transports/gige/device). -->
<RegisterDescription ModelName="Obscura" VendorName="Obscura" ToolTip="Camera emulator" StandardNameSpace="GEV"
    SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0" MajorVersion="1" MinorVersion="0"
    SubMinorVersion="0" ProductGuid="4D6B2C10-2C4E-4E0B-9A1B-0B5C00A6D001"
    VersionGuid="4D6B2C10-2C4E-4E0B-9A1B-0B5C00A6D002" xmlns="http://www.genicam.org/GenApi/Version_1_1"
    xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xsi:schemaLocation="http://www.genicam.org/GenApi/Version_1_1 http://www.genicam.org/GenApi/GenApiSchema_Version_1_1.xsd">
)";
constexpr std::string_view locked_node = "TLParamsLocked";
constexpr std::string_view chunk_port = "ChunkPort";

/// Writes the nodes of the rows. A feature that needs a range, a lock or a conversion has its register in a
/// node of its own, named after it.
class Writer {
public:
    explicit Writer(std::span<const FeatureCategory> table) : table_(table) {}

    std::string write() {
        out_ = head;
        write_category({.name = "Root", .parent = {}});
        for (const FeatureCategory& category : table_) {
            if (category.name != "Root") write_category(category);
            for (const Feature& f : category.features)
                write_feature(f);
        }
        if (const Feature* chunks = find_feature(table_, "ChunkSelector"))
            for (const FeatureEntry& e : chunks->entries)
                out_ += fmt::format("  <Port Name=\"{}{}\"><ChunkID>{:08X}</ChunkID></Port>\n", chunk_port,
                                    e.name, chunk_id(static_cast<Chunk>(e.value)));
        out_ += "  <Port Name=\"Device\" NameSpace=\"Standard\"/>\n</RegisterDescription>\n";
        return std::move(out_);
    }

private:
    void open(std::string_view tag, std::string_view name, std::string_view name_space) {
        tag_ = tag;
        out_ += fmt::format("  <{} Name=\"{}\"", tag, name);
        if (!name_space.empty()) out_ += fmt::format(" NameSpace=\"{}\"", name_space);
        out_ += ">\n";
    }
    void close() { out_ += fmt::format("  </{}>\n", tag_); }
    void element(std::string_view tag, std::string_view text) {
        out_ += fmt::format("    <{0}>{1}</{0}>\n", tag, escaped_xml(text));
    }
    void element(std::string_view tag, std::int64_t number) { element(tag, fmt::format("{}", number)); }
    void element_if(std::string_view tag, std::string_view text) {
        if (!text.empty()) element(tag, text);
    }

    static std::string_view name_space(const Feature& f) {
        return !f.listed ? "" : f.custom ? "Custom" : "Standard";
    }

    /// Whether the feature and its register are one node.
    static bool direct(const Feature& f) {
        if (f.type == FeatureType::string) return true;
        if (f.chunk) return f.type == FeatureType::integer || f.type == FeatureType::floating;
        return f.type == FeatureType::integer && f.has_register() && !f.minimum.given() &&
               !f.maximum.given() && lock_of(f).empty() && f.available.empty();
    }

    static std::string_view lock_of(const Feature& f) {
        if (!f.locked_by.empty()) return f.locked_by;
        const bool marked = f.lock == FeatureLock::streaming || f.lock == FeatureLock::streaming_but_first;
        return marked ? locked_node : std::string_view();
    }

    [[nodiscard]] const Feature& row(std::string_view name) const {
        const Feature* f = find_feature(table_, name);
        if (f == nullptr) throw std::logic_error(fmt::format("no feature {} in the table", name));
        return *f;
    }

    /// The node that holds the feature's raw integer.
    [[nodiscard]] std::string raw_node(const Feature& f) const {
        if (!f.value_of.empty()) return raw_node(row(f.value_of));
        if (f.type == FeatureType::formula || direct(f)) return std::string(f.name);
        if (f.has_register()) return fmt::format("{}Reg", f.name);
        return f.type == FeatureType::enumeration ? fmt::format("{}Index", f.name) : std::string(f.name);
    }
    [[nodiscard]] std::string raw_node(std::string_view name) const { return raw_node(row(name)); }

    /// The node of a limit that is not a number.
    [[nodiscard]] std::string limit_node(const Feature& f, const FeatureBound& bound,
                                         std::string_view suffix) const {
        if (bound.address != 0) return fmt::format("{}{}Reg", f.name, suffix);
        if (const Feature* holder = find_feature(table_, bound.held_by)) return raw_node(*holder);
        // Another feature's limit.
        for (const std::string_view of : {minimum_suffix, maximum_suffix, increment_suffix}) {
            if (!bound.held_by.ends_with(of)) continue;
            const Feature* owner =
                find_feature(table_, bound.held_by.substr(0, bound.held_by.size() - of.size()));
            if (owner != nullptr) return fmt::format("{}Reg", bound.held_by);
        }
        throw std::logic_error(fmt::format("no limit {} of feature {}", bound.held_by, f.name));
    }

    void write_category(const FeatureCategory& category) {
        open("Category", category.name, category.custom ? "Custom" : "Standard");
        for (const FeatureCategory& own : table_)
            if (own.name == category.name && category.name != "Root") write_listed(own);
        for (const FeatureCategory& child : table_)
            if (child.parent == category.name) element("pFeature", child.name);
        for (const FeatureCategory& own : table_)
            if (own.name == category.name && category.name == "Root") write_listed(own);
        close();
    }
    void write_listed(const FeatureCategory& category) {
        for (const Feature& f : category.features)
            if (f.listed) element("pFeature", f.name);
    }

    /// Elements at the beginning of every node.
    void write_beginning(const Feature& f) {
        constexpr std::array<std::string_view, 4> names{"", "Expert", "Guru", "Invisible"};
        element_if("ToolTip", f.tooltip);
        element_if("Visibility", names[static_cast<std::size_t>(f.visibility)]);
        element_if("pIsAvailable", f.available);
        if (const std::string_view lock = lock_of(f); !lock.empty()) element("pIsLocked", raw_node(lock));
        if (f.access == Access::read_only && !direct(f) && f.type != FeatureType::formula)
            element("ImposedAccessMode", "RO");
    }

    void write_limits(const Feature& f) {
        const auto limit = [&](std::string_view tag, const FeatureBound& bound, std::string_view suffix) {
            if (bound.fixed) {
                element(tag, std::llround(*bound.fixed * f.scale));
            } else if (bound.given()) {
                element(fmt::format("p{}", tag), limit_node(f, bound, suffix));
            }
        };
        limit("Min", f.minimum, minimum_suffix);
        limit("Max", f.maximum, maximum_suffix);
        limit("Inc", f.increment, increment_suffix);
    }

    void write_selected(const Feature& selector) {
        for (const FeatureCategory& category : table_)
            for (const Feature& f : category.features)
                for (const std::string_view by : f.selectors)
                    if (f.listed && by == selector.name) element("pSelected", f.name);
    }

    static std::string_view register_tag(const Feature& f) {
        if (f.type == FeatureType::string) return "StringReg";
        if (f.chunk && f.type == FeatureType::floating) return "FloatReg";
        return f.bits.given() ? "MaskedIntReg" : "IntReg";
    }

    /// Address to Representation.
    void write_register(const Feature& f) {
        element("Address", fmt::format("0x{:X}", f.address));
        if (f.stride != 0)
            out_ +=
                fmt::format("    <pIndex Offset=\"{}\">{}</pIndex>\n", f.stride, raw_node(f.selectors[0]));
        element("Length", f.bytes);
        const bool command = f.type == FeatureType::command;
        element("AccessMode", command ? "WO" : f.access == Access::read_only ? "RO" : "RW");
        element("pPort", f.chunk ? port_of(*f.chunk) : "Device");
        if (!f.cached && !command && (f.type != FeatureType::string || f.chunk))
            element("Cachable", "NoCache");
        if (f.bits.given() && f.bits.lsb == f.bits.msb) {
            element("Bit", f.bits.lsb);
        } else if (f.bits.given()) {
            element("LSB", f.bits.lsb);
            element("MSB", f.bits.msb);
        }
        const std::string_view tag = register_tag(f);
        if (tag != "StringReg" && tag != "FloatReg") element("Sign", f.is_signed ? "Signed" : "Unsigned");
        if (tag != "StringReg") element("Endianess", "BigEndian");
        if (!direct(f)) return;
        element_if("Unit", f.unit);
        element_if("Representation", f.representation);
    }

    [[nodiscard]] std::string port_of(Chunk chunk) const {
        for (const FeatureEntry& e : row("ChunkSelector").entries)
            if (e.value == static_cast<std::uint32_t>(chunk)) return fmt::format("{}{}", chunk_port, e.name);
        throw std::logic_error("a chunk is not in ChunkSelector");
    }

    void write_limit_register(const Feature& f, const FeatureBound& bound, std::string_view suffix) {
        if (bound.address == 0) return;
        Feature limit{.name = f.name, .listed = false, .access = Access::read_only};
        limit.address = bound.address;
        limit.cached = bound.cached;
        limit.is_signed = f.is_signed;
        open("IntReg", fmt::format("{}{}Reg", f.name, suffix), "");
        write_register(limit);
        close();
    }

    void write_feature(const Feature& f) {
        switch (f.type) {
        case FeatureType::formula:
            write_formula(f);
            break;
        case FeatureType::enumeration:
            write_enumeration(f);
            break;
        case FeatureType::boolean:
            open("Boolean", f.name, name_space(f));
            write_beginning(f);
            element("pValue", raw_node(f));
            close();
            break;
        case FeatureType::command:
            open("Command", f.name, name_space(f));
            write_beginning(f);
            element("pValue", raw_node(f));
            element("CommandValue", f.command_value);
            close();
            break;
        case FeatureType::floating:
            if (!f.chunk) write_converter(f);
            break;
        case FeatureType::integer:
            if (!direct(f)) write_integer(f);
            break;
        case FeatureType::string:
            break;
        }
        if (direct(f)) {
            open(register_tag(f), f.name, name_space(f));
            write_beginning(f);
            write_register(f);
            close();
        } else if (f.has_register()) {
            open(register_tag(f), raw_node(f), "");
            write_register(f);
            close();
        }
        write_limit_register(f, f.minimum, minimum_suffix);
        write_limit_register(f, f.maximum, maximum_suffix);
        write_limit_register(f, f.increment, increment_suffix);
    }

    void write_formula(const Feature& f) {
        open("IntSwissKnife", f.name, name_space(f));
        write_beginning(f);
        for (const FormulaVariable& v : f.variables)
            if (!v.symbol.empty())
                out_ +=
                    fmt::format("    <pVariable Name=\"{}\">{}</pVariable>\n", v.symbol, raw_node(v.feature));
        element("Formula", f.formula);
        element_if("Unit", f.unit);
        close();
    }

    void write_enumeration(const Feature& f) {
        open("Enumeration", f.name, name_space(f));
        write_beginning(f);
        for (const FeatureEntry& e : f.entries) {
            out_ += fmt::format("    <EnumEntry Name=\"{}\" NameSpace=\"{}\">", e.name,
                                e.custom ? "Custom" : "Standard");
            if (!e.tooltip.empty()) out_ += fmt::format("<ToolTip>{}</ToolTip>", escaped_xml(e.tooltip));
            std::string available(e.available);
            if (!f.entries_below.empty() && e.value > 0) available = availability(e);
            if (!available.empty()) out_ += fmt::format("<pIsAvailable>{}</pIsAvailable>", available);
            out_ += fmt::format("<Value>{}</Value></EnumEntry>\n", e.value);
        }
        const bool bound = f.has_register() || !f.value_of.empty() || f.entries.size() > 1;
        if (bound) {
            element("pValue", raw_node(f));
        } else {
            element("Value", f.entries.front().value);
        }
        write_selected(f);
        close();
        if (bound && !f.has_register() && f.value_of.empty()) {
            open("Integer", raw_node(f), "");
            element("Value", f.constant);
            element("Min", 0);
            element("Max", item_count(f) - 1);
            close();
        }
        if (f.entries_below.empty()) return;
        for (const FeatureEntry& e : f.entries)
            if (e.value > 0)
                out_ += fmt::format(
                    "  <IntSwissKnife Name=\"{}\"><pVariable Name=\"N\">{}</pVariable><Formula>N&gt;{}</Formula></IntSwissKnife>\n",
                    availability(e), raw_node(f.entries_below), e.value);
    }
    static std::string availability(const FeatureEntry& e) { return fmt::format("{}Available", e.name); }

    void write_converter(const Feature& f) {
        open("Converter", f.name, name_space(f));
        write_beginning(f);
        element("FormulaTo", fmt::format("FLOOR(FROM*{:g}+0.5)", f.scale));
        element("FormulaFrom", fmt::format("TO/{:g}.0", f.scale));
        const bool limited = f.minimum.given() || f.maximum.given();
        const std::string words = limited ? fmt::format("{}Units", f.name) : raw_node(f);
        element("pValue", words);
        element_if("Unit", f.unit);
        element("Slope", "Increasing");
        close();
        if (!limited) return;
        open("Integer", words, "");
        element("pValue", raw_node(f));
        write_limits(f);
        close();
    }

    void write_integer(const Feature& f) {
        open("Integer", f.name, name_space(f));
        write_beginning(f);
        if (f.has_register() || !f.value_of.empty()) {
            element("pValue", raw_node(f));
        } else {
            element("Value", f.constant);
        }
        write_limits(f);
        element_if("Unit", f.unit);
        write_selected(f);
        close();
    }

    std::span<const FeatureCategory> table_;
    std::string out_;
    std::string_view tag_;
};

} // namespace

std::string describe_camera(std::span<const FeatureCategory> table) {
    return Writer(table).write();
}

} // namespace obscura::transports::gige
