// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/genicam/genicam_engine.hpp"

#include "core/error.hpp"

#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string_view>

namespace obscura::transports::gige {
namespace {

using Memory = GenicamEngine::Memory;

// Limits for untrusted files, so that none exhausts stack, time or memory of the daemon.
constexpr int chain_max = 100;             // depth of references between nodes
constexpr std::uint64_t steps_max = 20000; // nodes visited to evaluate one
constexpr std::uint64_t length_max = 65536;

/// ArvDevice whose registers are a Memory. Aravis requires a GObject class.
struct MemoryDevice {
    ArvDevice parent;
    Memory* memory;
};

Memory& memory_of(ArvDevice* device) {
    return *reinterpret_cast<MemoryDevice*>(device)->memory;
}

gboolean done(bool good, GError** error) {
    if (!good)
        g_set_error_literal(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_INVALID_PARAMETER, "no such register");
    return good ? TRUE : FALSE;
}

gboolean read_memory(ArvDevice* device, guint64 address, guint32 size, void* buffer, GError** error) {
    return done(memory_of(device).load(address, {static_cast<std::uint8_t*>(buffer), size}), error);
}
// Aravis of Debian 13 passes the bytes as const, that of Debian 12 does not.
template<typename Bytes>
gboolean write_memory(ArvDevice* device, guint64 address, guint32 size, Bytes* buffer, GError** error) {
    return done(memory_of(device).store(address, {static_cast<const std::uint8_t*>(buffer), size}), error);
}
gboolean read_register(ArvDevice* device, guint64 address, guint32* value, GError** error) {
    std::uint8_t bytes[4] = {};
    const bool good = memory_of(device).load(address, bytes);
    *value = static_cast<guint32>(bytes[0]) << 24 | static_cast<guint32>(bytes[1]) << 16 |
             static_cast<guint32>(bytes[2]) << 8 | bytes[3];
    return done(good, error);
}
gboolean write_register(ArvDevice* device, guint64 address, guint32 value, GError** error) {
    const std::uint8_t bytes[4] = {static_cast<std::uint8_t>(value >> 24),
                                   static_cast<std::uint8_t>(value >> 16),
                                   static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
    return done(memory_of(device).store(address, bytes), error);
}

void fill_class(void* of_class, void* /*data*/) {
    auto* c = static_cast<ArvDeviceClass*>(of_class);
    c->read_memory = read_memory;
    c->write_memory = write_memory;
    c->read_register = read_register;
    c->write_register = write_register;
}

GType memory_device_type() {
    static const GType type = [] {
        GTypeInfo info{};
        info.class_size = sizeof(ArvDeviceClass);
        info.class_init = fill_class;
        info.instance_size = sizeof(MemoryDevice);
        return g_type_register_static(ARV_TYPE_DEVICE, "ObscuraMemoryDevice", &info, GTypeFlags{});
    }();
    return type;
}

std::string_view tag_of(ArvDomNode* node) {
    const char* name = arv_dom_node_get_node_name(node);
    return name != nullptr ? name : "";
}

std::string text_of(ArvDomNode* element) {
    std::string text;
    for (ArvDomNode* n = arv_dom_node_get_first_child(element); n != nullptr;
         n = arv_dom_node_get_next_sibling(n))
        if (ARV_IS_DOM_CHARACTER_DATA(n))
            if (const char* data = arv_dom_character_data_get_data(ARV_DOM_CHARACTER_DATA(n))) text += data;
    const auto blank = [](unsigned char c) { return std::isspace(c) != 0; };
    text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), blank));
    text.erase(std::find_if_not(text.rbegin(), text.rend(), blank).base(), text.end());
    return text;
}

/// Properties of a node that the checks use.
struct Node {
    std::vector<std::string> uses;       // nodes evaluated to get or set its value
    std::vector<std::string> conditions; // nodes that may be evaluated to see whether it is available
    std::string port, access;
    bool chunk_port = false, indexed = false, variable_length = false;
    // Results of judge().
    bool visiting = false, safe = true;
    int judged = 0; // round
    std::uint64_t steps = 1;
};
using Nodes = std::map<std::string, Node>;

void collect(ArvDomNode* element, const std::string& owner, Nodes& nodes) {
    for (ArvDomNode* n = arv_dom_node_get_first_child(element); n != nullptr;
         n = arv_dom_node_get_next_sibling(n)) {
        if (!ARV_IS_DOM_ELEMENT(n)) continue;
        const std::string_view tag = tag_of(n);
        if (ARV_IS_GC_FEATURE_NODE(n)) {
            const char* name = arv_gc_feature_node_get_name(ARV_GC_FEATURE_NODE(n));
            // The entries of an enumeration are evaluated with it.
            collect(n, tag == "EnumEntry" || name == nullptr ? owner : std::string(name), nodes);
            continue;
        }
        if (owner.empty() || tag == "Group") {
            collect(n, owner, nodes);
            continue;
        }
        Node& node = nodes[owner];
        if (tag == "pPort") {
            node.port = text_of(n);
        } else if (tag == "AccessMode") {
            node.access = text_of(n);
        } else if (tag == "ChunkID" || tag == "EventID") {
            node.chunk_port = true;
        } else if (tag == "Length") {
            const std::string text = text_of(n);
            const unsigned long long length = std::strtoull(text.c_str(), nullptr, 0);
            if (length == 0 || length > length_max)
                throw ConfigError(fmt::format("{}: Length \"{}\", allowed are 1 to {} bytes", owner,
                                              text.substr(0, 40), length_max));
        } else if (tag.size() > 1 && tag[0] == 'p' && tag != "pSelected" && tag != "pFeature" &&
                   tag != "pInvalidator" && tag != "pError") {
            const bool condition = tag.substr(0, 3) == "pIs";
            (condition ? node.conditions : node.uses).push_back(text_of(n));
            node.variable_length |= tag == "pLength";
            node.indexed |= tag == "pIndex" || tag == "pAddress";
        } else if (tag == "IntSwissKnife") {
            node.indexed = true; // a computed address
        }
        // Descend into formulas inside a register and into struct entries.
        if (tag == "IntSwissKnife" || tag == "StructEntry") collect(n, owner, nodes);
    }
}

constexpr int values_only = 1, with_conditions = 2; // rounds

/// Determines whether a node can be evaluated within chain_max and steps_max. A value that depends on itself
/// is an error of the file, and `circular` becomes its name if it is empty; conditions that do so occur in
/// files of real cameras, and their nodes count as absent.
bool judge(const std::string& name, Nodes& nodes, int round, int depth, std::string& circular) {
    Node& node = nodes[name];
    if (node.visiting) {
        if (round == values_only && circular.empty()) circular = name;
        return node.safe = false;
    }
    if (node.judged == round) return node.safe;
    if (depth > chain_max) return false;
    node.visiting = true;
    node.steps = 1;
    node.safe = node.safe && !node.variable_length;
    const auto visit = [&](const std::vector<std::string>& names) {
        for (const std::string& used : names) {
            node.safe = judge(used, nodes, round, depth + 1, circular) && node.safe;
            node.steps = std::min(node.steps + nodes[used].steps, steps_max + 1);
        }
    };
    visit(node.uses);
    if (round == with_conditions) visit(node.conditions);
    node.safe = node.safe && node.steps <= steps_max;
    node.visiting = false;
    node.judged = round;
    return node.safe;
}

/// Throws ConfigError unless `xml` is well-formed. Aravis accepts a file up to its first error.
void check_well_formed(const std::string& xml) {
    const GMarkupParser ignore{};
    GMarkupParseContext* context = g_markup_parse_context_new(&ignore, GMarkupParseFlags{}, nullptr, nullptr);
    GError* error = nullptr;
    const bool good =
        g_markup_parse_context_parse(context, xml.data(), static_cast<gssize>(xml.size()), &error) != 0 &&
        g_markup_parse_context_end_parse(context, &error) != 0;
    std::string what = error != nullptr ? error->message : "";
    g_clear_error(&error);
    g_markup_parse_context_free(context);
    if (good) return;
    std::replace_if(
        what.begin(), what.end(), [](unsigned char c) { return c < ' '; }, ' ');
    throw ConfigError(fmt::format("no XML: {}", what.substr(0, 200)));
}

/// Suppresses messages of GLib, Aravis and libxml2 while it lives.
class MessageSuppression {
public:
    MessageSuppression() : before_(g_log_set_default_handler([](auto...) {}, nullptr)) {}
    ~MessageSuppression() { g_log_set_default_handler(before_, nullptr); }
    MessageSuppression(const MessageSuppression&) = delete;
    MessageSuppression& operator=(const MessageSuppression&) = delete;

private:
    GLogFunc before_;
};

/// Error of a GLib call of which only the occurrence matters.
struct Outcome {
    GError* error = nullptr;
    ~Outcome() { g_clear_error(&error); }
    [[nodiscard]] bool good() const { return error == nullptr; }
};

} // namespace

struct GenicamEngine::Impl {
    ArvDevice* device = nullptr;
    ArvGc* gc = nullptr;
    Nodes nodes;

    ~Impl() {
        if (gc != nullptr) g_object_unref(gc);
        if (device != nullptr) g_object_unref(device);
    }
    [[nodiscard]] ArvGcNode* find(const std::string& name) const {
        const auto at = nodes.find(name);
        if (at == nodes.end() || !at->second.safe) return nullptr;
        ArvGcNode* node = arv_gc_get_node(gc, name.c_str());
        return node != nullptr && ARV_IS_GC_FEATURE_NODE(node) ? node : nullptr;
    }
};

GenicamEngine::GenicamEngine(const std::string& xml, Memory& memory) : impl_(std::make_unique<Impl>()) {
    check_well_formed(xml);
    impl_->device = static_cast<ArvDevice*>(g_object_new(memory_device_type(), nullptr));
    reinterpret_cast<MemoryDevice*>(impl_->device)->memory = &memory;
    impl_->gc = arv_gc_new(impl_->device, xml.data(), xml.size());
    ArvDomNode* root = impl_->gc != nullptr ? arv_dom_node_get_first_child(ARV_DOM_NODE(impl_->gc)) : nullptr;
    if (root == nullptr || tag_of(root) != "RegisterDescription")
        throw ConfigError("not a GenICam description (XML with the root RegisterDescription is wanted)");
    collect(root, "", impl_->nodes);
    std::vector<std::string> names;
    for (const auto& [name, node] : impl_->nodes)
        names.push_back(name);
    std::string circular;
    for (const int round : {values_only, with_conditions}) {
        for (const std::string& name : names)
            judge(name, impl_->nodes, round, 0, circular);
        if (!circular.empty()) throw ConfigError(fmt::format("{}: refers to itself", circular.substr(0, 80)));
    }
}

GenicamEngine::~GenicamEngine() = default;

std::shared_ptr<void> GenicamEngine::suppress_messages() {
    return std::make_shared<MessageSuppression>();
}

GenicamEngine::Kind GenicamEngine::kind(const std::string& feature) const {
    ArvGcNode* node = impl_->find(feature);
    if (node == nullptr) return Kind::absent;
    if (ARV_IS_GC_COMMAND(node)) return Kind::command;
    if (ARV_IS_GC_ENUMERATION(node)) return Kind::choice;
    if (ARV_IS_GC_BOOLEAN(node)) return Kind::flag;
    if (ARV_IS_GC_FLOAT(node) || ARV_IS_GC_INTEGER(node)) return Kind::number;
    if (ARV_IS_GC_STRING(node)) return Kind::text;
    return Kind::absent;
}

bool GenicamEngine::get(const std::string& feature, double& number) {
    ArvGcNode* node = impl_->find(feature);
    Outcome outcome;
    switch (kind(feature)) {
    case Kind::number:
        number = ARV_IS_GC_FLOAT(node)
                     ? arv_gc_float_get_value(ARV_GC_FLOAT(node), &outcome.error)
                     : static_cast<double>(arv_gc_integer_get_value(ARV_GC_INTEGER(node), &outcome.error));
        return outcome.good() && std::isfinite(number);
    case Kind::flag:
        number = arv_gc_boolean_get_value(ARV_GC_BOOLEAN(node), &outcome.error) != 0 ? 1 : 0;
        return outcome.good();
    default:
        return false;
    }
}

bool GenicamEngine::get(const std::string& feature, std::string& text) {
    ArvGcNode* node = impl_->find(feature);
    Outcome outcome;
    const char* value = nullptr;
    switch (kind(feature)) {
    case Kind::choice:
        value = arv_gc_enumeration_get_string_value(ARV_GC_ENUMERATION(node), &outcome.error);
        break;
    case Kind::text:
        value = arv_gc_string_get_value(ARV_GC_STRING(node), &outcome.error);
        break;
    default:
        return false;
    }
    if (!outcome.good() || value == nullptr) return false;
    text = value;
    return true;
}

bool GenicamEngine::set(const std::string& feature, double number) {
    ArvGcNode* node = impl_->find(feature);
    Outcome outcome;
    switch (kind(feature)) {
    case Kind::number:
        if (ARV_IS_GC_FLOAT(node))
            arv_gc_float_set_value(ARV_GC_FLOAT(node), number, &outcome.error);
        else if (std::abs(number) < 9e18)
            arv_gc_integer_set_value(ARV_GC_INTEGER(node), std::llround(number), &outcome.error);
        else
            return false;
        return outcome.good();
    case Kind::flag:
        arv_gc_boolean_set_value(ARV_GC_BOOLEAN(node), number != 0 ? TRUE : FALSE, &outcome.error);
        return outcome.good();
    default:
        return false;
    }
}

bool GenicamEngine::set(const std::string& feature, const std::string& text) {
    ArvGcNode* node = impl_->find(feature);
    Outcome outcome;
    switch (kind(feature)) {
    case Kind::choice:
        return arv_gc_enumeration_set_string_value(ARV_GC_ENUMERATION(node), text.c_str(), &outcome.error) !=
                   0 &&
               outcome.good();
    case Kind::text:
        arv_gc_string_set_value(ARV_GC_STRING(node), text.c_str(), &outcome.error);
        return outcome.good();
    case Kind::number:
    case Kind::flag: {
        char* end = nullptr;
        const double number = std::strtod(text.c_str(), &end);
        return end != text.c_str() && *end == 0 && std::isfinite(number) && set(feature, number);
    }
    default:
        return false;
    }
}

bool GenicamEngine::execute(const std::string& command) {
    ArvGcNode* node = impl_->find(command);
    if (kind(command) != Kind::command) return false;
    Outcome outcome;
    arv_gc_command_execute(ARV_GC_COMMAND(node), &outcome.error);
    return outcome.good();
}

std::vector<GenicamEngine::RegisterRange> GenicamEngine::registers() {
    std::vector<RegisterRange> ranges;
    for (const auto& [name, node] : impl_->nodes) {
        ArvGcNode* found = impl_->find(name);
        if (found == nullptr || !ARV_IS_GC_REGISTER(found)) continue;
        const auto port = impl_->nodes.find(node.port);
        if (port != impl_->nodes.end() && port->second.chunk_port) continue;
        Outcome address, length;
        RegisterRange r;
        r.begin = arv_gc_register_get_address(ARV_GC_REGISTER(found), &address.error);
        const std::uint64_t bytes = arv_gc_register_get_length(ARV_GC_REGISTER(found), &length.error);
        if (!address.good() || !length.good() || bytes == 0 || bytes > length_max) continue;
        r.end = r.begin + bytes;
        if (r.begin > UINT32_MAX || r.end > std::uint64_t{UINT32_MAX} + 1)
            continue; // addresses of GVCP have 32 bits
        r.writable = node.access != "RO";
        r.indexed = node.indexed;
        ranges.push_back(r);
    }
    return ranges;
}

} // namespace obscura::transports::gige
