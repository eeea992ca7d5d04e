// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/trajectories/ndm_xml.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "core/text/text.hpp"

#include <fmt/format.h>
#include <pugixml.hpp>

#include <algorithm>
#include <array>
#include <cstring>

namespace obscura::ephemeris {
namespace {

constexpr std::string_view xml_blanks = " \t\r\n";
/// Units of KVN, in which all values must be.
constexpr std::array<std::string_view, 9> kvn_units{"km",  "km/s", "km/s**2", "deg", "deg/s",
                                                    "1/s", "s",    "rev",     ""};

class NdmXml {
public:
    NdmXml(const std::string& xml, const std::string& name) : xml_(xml), name_(name) {
        for (std::size_t at = 0; (at = xml.find('\n', at)) != std::string::npos; ++at)
            line_ends_.push_back(at);
    }

    KvnText message(std::string_view root) {
        pugi::xml_document document;
        const pugi::xml_parse_result result = document.load_buffer(xml_.data(), xml_.size());
        if (!result)
            fail(line_at(static_cast<std::size_t>(std::max<std::ptrdiff_t>(result.offset, 0))),
                 fmt::format("not valid XML: {}", result.description()));
        const pugi::xml_node top = document.document_element();
        pugi::xml_node message = top;
        if (is(top, "ndm")) {
            message = {};
            for (const pugi::xml_node child : top.children()) {
                if (child.type() != pugi::node_element || is(child, "MESSAGE_ID") || is(child, "COMMENT"))
                    continue;
                if (message) fail(child, "a second message, allowed is one in a file");
                message = child;
            }
        }
        if (!message || !is(message, root))
            fail(message ? message : top, fmt::format("<{}> where <{}> is wanted",
                                                      printable((message ? message : top).name(), 40), root));
        line(message,
             fmt::format("{} = {}", message.attribute("id").value(), message.attribute("version").value()));
        keywords(only(message, "header"));
        const pugi::xml_node body = only(message, "body");
        for (const pugi::xml_node segment : body.children("segment"))
            this->segment(segment);
        return std::move(out_);
    }

private:
    static bool is(pugi::xml_node node, std::string_view name) { return name == node.name(); }

    [[nodiscard]] std::size_t line_at(std::size_t offset) const {
        return static_cast<std::size_t>(std::lower_bound(line_ends_.begin(), line_ends_.end(), offset) -
                                        line_ends_.begin()) +
               1;
    }
    [[nodiscard]] std::size_t line_of(pugi::xml_node node) const {
        return line_at(static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0)));
    }
    [[noreturn]] void fail(std::size_t line, std::string_view what) const {
        throw ConfigError(fmt::format("{}:{}: {}", name_, line, what));
    }
    [[noreturn]] void fail(pugi::xml_node at, std::string_view what) const { fail(line_of(at), what); }

    [[nodiscard]] pugi::xml_node only(pugi::xml_node parent, const char* name) const {
        const pugi::xml_node child = parent.child(name);
        if (!child) fail(parent, fmt::format("<{}> without <{}>", parent.name(), name));
        return child;
    }

    void line(pugi::xml_node at, std::string_view text) {
        out_.text += text;
        out_.text += '\n';
        out_.lines.push_back(line_of(at));
    }

    [[nodiscard]] std::string value(pugi::xml_node leaf) const {
        const pugi::xml_attribute units = leaf.attribute("units");
        if (units &&
            std::find(kvn_units.begin(), kvn_units.end(), std::string_view(units.value())) == kvn_units.end())
            fail(leaf, fmt::format("units \"{}\", {}", printable(units.value(), 40),
                                   allowed_words(units.value(), {kvn_units.begin(), kvn_units.end() - 1})));
        const std::string_view text = trimmed(leaf.child_value(), xml_blanks);
        // A value is one line of the notation.
        if (text.find('\n') != std::string_view::npos)
            fail(leaf, fmt::format("<{}>: of two lines", leaf.name()));
        return std::string(text);
    }

    void keywords(pugi::xml_node block) {
        for (const pugi::xml_node leaf : block.children())
            if (leaf.type() == pugi::node_element && !is(leaf, "COMMENT"))
                line(leaf, fmt::format("{} = {}", leaf.name(), value(leaf)));
    }

    void segment(pugi::xml_node segment) {
        const pugi::xml_node metadata = only(segment, "metadata"), data = only(segment, "data");
        line(metadata, "META_START");
        keywords(metadata);
        line(metadata, "META_STOP");
        const bool scalar_first = trimmed(metadata.child_value("QUATERNION_TYPE"), xml_blanks) == "FIRST";
        const bool attitudes = static_cast<bool>(data.child("attitudeState"));
        if (attitudes) line(data, "DATA_START");
        for (const pugi::xml_node state : data.children()) {
            if (state.type() != pugi::node_element || is(state, "COMMENT") || is(state, "covarianceMatrix"))
                continue;
            if (!is(state, "stateVector") && !is(state, "attitudeState"))
                fail(state, fmt::format("<{}> where a state is wanted", printable(state.name(), 40)));
            std::string epoch, numbers;
            collect(state, scalar_first, epoch, numbers, 0);
            if (epoch.empty()) fail(state, "a state without EPOCH");
            line(state, epoch + numbers);
        }
        if (attitudes) line(data, "DATA_STOP");
    }

    /// Adds the values of the leaves below a state, in their order; of a quaternion the scalar where the
    /// metadata say.
    void collect(pugi::xml_node node, bool scalar_first, std::string& epoch, std::string& numbers,
                 int depth) {
        constexpr int max_depth = 8;
        if (depth > max_depth) fail(node, "elements are nested too deep");
        std::vector<pugi::xml_node> leaves;
        for (const pugi::xml_node child : node.children())
            if (child.type() == pugi::node_element && !is(child, "COMMENT")) leaves.push_back(child);
        const auto scalar = std::find_if(leaves.begin(), leaves.end(),
                                         [](pugi::xml_node n) { return is(n, "QC") || is(n, "QC_DOT"); });
        if (scalar != leaves.end()) {
            const pugi::xml_node moved = *scalar;
            leaves.erase(scalar);
            leaves.insert(scalar_first ? leaves.begin() : leaves.end(), moved);
        }
        for (const pugi::xml_node child : leaves) {
            const bool leaf = std::none_of(child.begin(), child.end(),
                                           [](pugi::xml_node n) { return n.type() == pugi::node_element; });
            if (!leaf)
                collect(child, scalar_first, epoch, numbers, depth + 1);
            else if (is(child, "EPOCH"))
                epoch = value(child);
            else
                (numbers += ' ') += value(child);
        }
    }

    const std::string& xml_;
    const std::string& name_;
    std::vector<std::size_t> line_ends_;
    KvnText out_;
};

} // namespace

bool is_xml(std::string_view text) {
    const std::size_t first = text.find_first_not_of(xml_blanks);
    return first != std::string_view::npos && text[first] == '<';
}

KvnText kvn_of_xml(const std::string& xml, const std::string& name, std::string_view root) {
    return NdmXml(xml, name).message(root);
}

} // namespace obscura::ephemeris
