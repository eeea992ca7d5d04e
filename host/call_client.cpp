// SPDX-License-Identifier: Apache-2.0
#include "host/call_client.hpp"

#include "core/error.hpp"

#include <obscura_client.h>

#include <cstddef>
#include <limits>
#include <utility>

namespace obscura::host {
namespace {

using Json = nlohmann::ordered_json;

/// Containers within each other that are sent: more than any call takes.
constexpr int max_levels = 16;

using Owned = std::unique_ptr<obscura_value, decltype(&obscura_value_free)>;

/// For the functions of the C client, which take it over.
obscura_value* value_of(const Json& json, int levels) {
    if (levels == 0)
        throw CallRefused("bad-argument", "a value has too many arrays and maps within each other");
    switch (json.type()) {
    case Json::value_t::boolean:
        return obscura_bool(json.get<bool>() ? 1 : 0);
    case Json::value_t::number_unsigned:
        if (json.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max())
            return obscura_number(json.get<double>());
        [[fallthrough]];
    case Json::value_t::number_integer:
        return obscura_int(json.get<std::int64_t>());
    case Json::value_t::number_float:
        return obscura_number(json.get<double>());
    case Json::value_t::string: {
        const auto& text = json.get_ref<const std::string&>();
        return obscura_text(text.data(), text.size());
    }
    case Json::value_t::array: {
        Owned array(obscura_array_new(), obscura_value_free);
        for (const Json& element : json)
            obscura_append(array.get(), value_of(element, levels - 1));
        return array.release();
    }
    case Json::value_t::object: {
        Owned map(obscura_map_new(), obscura_value_free);
        for (const auto& [name, element] : json.items())
            obscura_put(map.get(), name.c_str(), value_of(element, levels - 1));
        return map.release();
    }
    default:
        return obscura_nil();
    }
}

Json json_of(const obscura_value* value) {
    switch (obscura_type_of(value)) {
    case OBSCURA_NIL:
        break;
    case OBSCURA_BOOL:
        return obscura_as_bool(value) != 0;
    case OBSCURA_INT:
        return obscura_as_int(value, 0);
    case OBSCURA_NUMBER:
        return obscura_as_number(value, 0);
    case OBSCURA_STRING:
        return std::string(obscura_as_string(value), obscura_count(value));
    case OBSCURA_ARRAY: {
        Json array = Json::array();
        for (std::size_t i = 0; i < obscura_count(value); ++i)
            array.push_back(json_of(obscura_at(value, i)));
        return array;
    }
    case OBSCURA_MAP: {
        Json map = Json::object();
        for (std::size_t i = 0; i < obscura_count(value); ++i)
            map[obscura_name_at(value, i)] = json_of(obscura_at(value, i));
        return map;
    }
    }
    return nullptr;
}

[[noreturn]] void fail_call(const obscura_error& error) {
    if (error.status == OBSCURA_LOST && std::string_view(error.code) == "connection-lost")
        throw HardwareError(error.message);
    CallRefused refused(error.code, error.message);
    refused.field = error.field;
    refused.allowed = error.allowed;
    refused.hint = error.hint;
    throw refused;
}

} // namespace

CallClient::Answer::Answer(obscura_answer* answer)
    : head(json_of(obscura_answer_map(answer))), answer_(answer, obscura_answer_free) {
    head.erase("arrays");
    head.erase("descriptors");
}

std::span<const std::uint16_t> CallClient::Answer::numbers(std::string_view name) const {
    const obscura_array* const array = obscura_array_find(answer_.get(), std::string(name).c_str());
    if (array == nullptr || std::string_view(array->dtype) != "<u2") return {};
    return {static_cast<const std::uint16_t*>(array->data), array->count};
}

std::span<const float> CallClient::Answer::floats(std::string_view name) const {
    const obscura_array* const array = obscura_array_find(answer_.get(), std::string(name).c_str());
    if (array == nullptr || std::string_view(array->dtype) != "<f4") return {};
    return {static_cast<const float*>(array->data), array->count};
}

std::span<const std::size_t> CallClient::Answer::shape(std::string_view name) const {
    const obscura_array* const array = obscura_array_find(answer_.get(), std::string(name).c_str());
    if (array == nullptr) return {};
    return {array->shape, array->dimensions};
}

FileDescriptor CallClient::Answer::take_file(std::size_t number) {
    return FileDescriptor(obscura_take_descriptor(answer_.get(), number));
}

CallClient::CallClient(const std::string& address, const Options& options) {
    obscura_connect_options how{};
    how.timeout_s = options.timeout_s;
    how.connect_timeout_s = options.connect_timeout_s;
    how.max_body_bytes = options.max_array_bytes;
    how.token_file = options.token_file.empty() ? nullptr : options.token_file.c_str();
    obscura_error error;
    client_.reset(obscura_connect(address.c_str(), &how, &error), obscura_close);
    if (!client_) fail_call(error);
}

CallClient::Answer CallClient::call(const std::string& name, const Json& fields) {
    begin(name, fields);
    obscura_answer* answer = nullptr;
    if (obscura_wait(client_.get(), -1, &answer) != OBSCURA_OK) fail_call(*obscura_last_error(client_.get()));
    return Answer(answer);
}

void CallClient::begin(const std::string& name, const Json& fields) {
    obscura_value* const map = fields.is_null() ? nullptr : value_of(fields, max_levels);
    if (obscura_begin(client_.get(), name.c_str(), map) != OBSCURA_OK)
        fail_call(*obscura_last_error(client_.get()));
}

std::optional<CallClient::Answer> CallClient::wait(double wait_s) {
    obscura_answer* answer = nullptr;
    const obscura_status status = obscura_wait(client_.get(), wait_s, &answer);
    if (status == OBSCURA_PENDING) return std::nullopt;
    if (status != OBSCURA_OK) fail_call(*obscura_last_error(client_.get()));
    return Answer(answer);
}

} // namespace obscura::host
