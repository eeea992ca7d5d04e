// SPDX-License-Identifier: Apache-2.0
#include "service/call.hpp"

#include "config/section.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::service {
namespace {

using nlohmann::json;

/// The failure that the first line of a ConfigError of the key engine tells: "CALL: FIELD: what".
Failure failure_of(const ConfigError& error, std::string_view call) {
    std::string line = error.what();
    line = line.substr(0, line.find('\n'));
    Failure failure(FailureCode::bad_argument, line);
    const std::size_t begin = call.size() + 2;
    const std::size_t end = line.find(": ", begin);
    if (end != std::string::npos) failure.field = line.substr(begin, end - begin);
    constexpr std::string_view allowed = ", allowed ";
    if (const std::size_t at = line.find(allowed); at != std::string::npos)
        failure.allowed = line.substr(at + allowed.size());
    return failure;
}

void read_table(std::string_view call, const config::Value& table, const config::Keys& keys,
                const std::vector<std::string_view>& elsewhere) {
    try {
        (void)config::read_keys(table, {std::string(call), ""}, keys, elsewhere);
    } catch (const ConfigError& error) {
        throw failure_of(error, call);
    }
}

bool is_own(std::string_view name) {
    return name == "call" || name == "arrays";
}

} // namespace

const Call& find_call(const Calls& calls, std::string_view name) {
    const auto found =
        std::find_if(calls.begin(), calls.end(), [&](const Call& call) { return call.name == name; });
    if (found != calls.end()) return *found;
    std::vector<std::string_view> known;
    for (const Call& call : calls)
        known.push_back(call.name);
    Failure failure(FailureCode::unknown_call,
                    fmt::format("no call \"{}\", {}", printable(name, 60), suggestion(name, known)));
    failure.field = "call";
    failure.allowed = fmt::format("{}", fmt::join(known, ", "));
    throw failure;
}

BoundCall bind(const Call& call, const json& request) {
    BoundCall bound = call.bind();
    config::Value table;
    std::vector<std::string_view> elsewhere;
    for (const FreeField& field : bound.fields.free) {
        elsewhere.push_back(field.name);
        const auto found = request.find(std::string(field.name));
        if (found != request.end()) *field.target = *found;
        if (found != request.end() || !field.required) continue;
        throw bad_argument(field.name, fmt::format("{}: the field \"{}\" is missing", call.name, field.name));
    }
    for (const auto& [name, value] : request.items()) {
        if (is_own(name) || std::find(elsewhere.begin(), elsewhere.end(), name) != elsewhere.end()) continue;
        const bool known =
            std::any_of(bound.fields.keys.begin(), bound.fields.keys.end(),
                        [&, &wanted = name](const config::Key& k) { return k.name == wanted; });
        if (call.lenient && !known) continue;
        table.members.push_back({name, {}, value_of(value, name)});
    }
    read_table(call.name, table, bound.fields.keys, elsewhere);
    return bound;
}

void read_values(std::string_view call, const json& values, const config::Keys& keys) {
    config::Value table;
    for (const auto& [name, value] : values.items())
        table.members.push_back({name, {}, value_of(value, name)});
    read_table(call, table, keys, {});
}

void read_section(std::string_view call, const std::string& field, const json& values,
                  const config::Section& section) {
    try {
        config::Mistakes mistakes;
        const config::Value table = value_of(values, field);
        config::read_section(&table, {}, {std::string(call), field}, section, mistakes);
        mistakes.throw_if_any();
    } catch (const ConfigError& error) {
        throw failure_of(error, call);
    }
}

json describe(const config::Keys& keys) {
    json rows = json::array();
    for (const config::Key& key : keys) {
        json row{{"name", key.name}, {"type", config::type_text(key)}, {"help", key.help()}};
        if (!key.unit().empty()) row["unit"] = key.unit();
        if (const std::string allowed = config::allowed_text(key); !allowed.empty()) row["allowed"] = allowed;
        if (key.is_required())
            row["required"] = true;
        else
            row["default"] = config::value_text(key);
        rows.push_back(std::move(row));
    }
    return rows;
}

json describe(const std::vector<Result>& results) {
    json rows = json::array();
    for (const Result& result : results) {
        json row{{"name", result.name}, {"type", result.type}, {"help", result.help}};
        if (!result.unit.empty()) row["unit"] = result.unit;
        rows.push_back(std::move(row));
    }
    return rows;
}

json describe(const Calls& calls) {
    json rows = json::array();
    for (const Call& call : calls) {
        const BoundCall bound = call.bind();
        json fields = describe(bound.fields.keys);
        for (const FreeField& field : bound.fields.free) {
            json row{{"name", field.name}, {"type", field.type}, {"help", field.help}};
            if (field.required) row["required"] = true;
            fields.push_back(std::move(row));
        }
        rows.push_back({{"name", call.name},
                        {"help", call.help},
                        {"permission", name_of(call.permission)},
                        {"fields", std::move(fields)},
                        {"results", describe(call.results)}});
        if (!call.frames.empty()) rows.back()["frames"] = describe(call.frames);
    }
    return rows;
}

config::Value value_of(const json& json, const std::string& field) {
    using Kind = config::Value::Kind;
    config::Value value;
    if (json.is_boolean()) {
        value.kind = Kind::boolean;
        value.boolean = json.get<bool>();
    } else if (json.is_number_integer()) {
        value.kind = Kind::integer;
        value.integer = json.get<std::int64_t>();
    } else if (json.is_number_float()) {
        value.kind = Kind::real;
        value.real = json.get<double>();
    } else if (json.is_string()) {
        value.kind = Kind::string;
        value.string = json.get<std::string>();
    } else if (json.is_array()) {
        value.kind = Kind::array;
        for (const auto& item : json)
            value.items.push_back(value_of(item, field));
    } else if (json.is_object()) {
        for (const auto& [name, item] : json.items())
            value.members.push_back({name, {}, value_of(item, fmt::format("{}.{}", field, name))});
    } else {
        throw bad_argument(field, fmt::format("{}: nil is no value here", printable(field, 200)));
    }
    return value;
}

json json_of(const config::Value& value) {
    using Kind = config::Value::Kind;
    switch (value.kind) {
    case Kind::boolean:
        return value.boolean;
    case Kind::integer:
        return value.integer;
    case Kind::real:
        return value.real;
    case Kind::string:
    case Kind::date:
        return value.string;
    case Kind::array: {
        json items = json::array();
        for (const config::Value& item : value.items)
            items.push_back(json_of(item));
        return items;
    }
    case Kind::table:
        break;
    }
    json members = json::object();
    for (const config::Member& member : value.members)
        members[member.key] = json_of(member.value);
    return members;
}

} // namespace obscura::service
