// SPDX-License-Identifier: Apache-2.0
#include "web/api/openapi.hpp"

#include "web/api/openapi_schemas.hpp"
#include "web/api/route_table.hpp"

#include <nlohmann/json.hpp>

#include <cctype>
#include <limits>
#include <string>
#include <utility>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;

Json schema_of(const Parameter& field) {
    Json schema = Json::object();
    if (field.type != Parameter::Type::any) schema["type"] = name_of(field.type);
    if (!field.choices.empty()) schema["enum"] = field.choices;
    if (field.type == Parameter::Type::integer || field.type == Parameter::Type::number) {
        if (field.min > std::numeric_limits<double>::lowest()) schema["minimum"] = field.min;
        if (field.max < std::numeric_limits<double>::max()) schema["maximum"] = field.max;
    }
    if (field.items != Parameter::Type::any) schema["items"] = {{"type", name_of(field.items)}};
    if (field.size > 0) schema["minItems"] = schema["maxItems"] = field.size;
    if (!field.unit.empty()) schema["x-unit"] = field.unit;
    if (!field.initial.empty()) schema["default"] = Json::parse(field.initial);
    return schema;
}

/// Schema of what the daemon answers to a call, as the table of calls has it.
Json answer_of(const CallRow& call) {
    Json properties = Json::object();
    for (const Parameter& result : call.results) {
        Json property = schema_of(result);
        // make_exact() has counts of more than 2^53 as texts.
        if (result.type == Parameter::Type::integer && result.unit == "ns")
            property["type"] = {"integer", "string"};
        property["description"] = result.help;
        properties[std::string(result.name)] = std::move(property);
    }
    return {{"type", "object"}, {"properties", std::move(properties)}};
}

/// "TimingRows" of the call timing.rows.
std::string component_name(std::string_view call) {
    std::string name;
    bool begins = true;
    for (const char c : call) {
        const bool parts = c == '.' || c == '_';
        if (!parts) name += begins ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
        begins = parts;
    }
    return name;
}

/// Name of the schema of the answer; empty: none is told.
std::string schema_name(const Route& route) {
    if (!route.schema.empty() || route.call == nullptr || route.call->results.empty())
        return std::string(route.schema);
    return component_name(route.call->name);
}

/// Adds what a schema of openapi_schemas says beyond that of a call; null removes a member. A reference says
/// all itself.
void refine(Json& schema, const Json& more) {
    if (more.contains("$ref")) schema.erase("type");
    for (const auto& [name, value] : more.items()) {
        if (value.is_null())
            schema.erase(name);
        else if (value.is_object() && schema.contains(name))
            refine(schema[name], value);
        else
            schema[name] = value;
    }
}

/// Schemas of all answers: those of calls with what is known of them beyond, and the server's own.
Json schemas() {
    Json all = Json::object();
    for (const Route& route : routes())
        if (const std::string name = schema_name(route);
            route.call != nullptr && !route.own_answer && !name.empty() && !all.contains(name))
            all[name] = answer_of(*route.call);
    refine(all, Json::parse(openapi_schemas));
    return all;
}

Json body_of(const Route& route) {
    Json schema{{"type", "object"}};
    if (route.body == Body::fields) {
        Json required = Json::array();
        schema["properties"] = Json::object();
        for (const Parameter& field : route.fields) {
            Json property = schema_of(field);
            property["description"] = field.help;
            schema["properties"][std::string(field.name)] = std::move(property);
            if (field.required) required.push_back(field.name);
        }
        schema["additionalProperties"] = false;
        if (!required.empty()) schema["required"] = std::move(required);
    }
    return {{"required", true}, {"content", {{"application/json", {{"schema", std::move(schema)}}}}}};
}

Json parameters_of(const Route& route) {
    Json parameters = Json::array();
    if (route.path.find("{camera}") != std::string_view::npos)
        parameters.push_back({{"$ref", "#/components/parameters/camera"}});
    if (route.path.find("{feature}") != std::string_view::npos)
        parameters.push_back({{"$ref", "#/components/parameters/feature"}});
    if (route.path.find("{frame}") != std::string_view::npos)
        parameters.push_back({{"$ref", "#/components/parameters/frame"}});
    for (const Parameter& field : route.query) {
        parameters.push_back({{"name", field.name},
                              {"in", "query"},
                              {"description", field.help},
                              {"schema", schema_of(field)}});
        if (field.required) parameters.back()["required"] = true;
    }
    if (route.answers == Answers::events)
        parameters.push_back({{"$ref", "#/components/parameters/last_event_id"}});
    if (route.method == "PATCH" || route.method == "PUT")
        parameters.push_back({{"$ref", "#/components/parameters/if_match"}});
    if (route.changes()) parameters.push_back({{"$ref", "#/components/parameters/idempotency_key"}});
    if (route.answers == Answers::trigger) parameters.push_back({{"$ref", "#/components/parameters/prefer"}});
    return parameters;
}

/// Answers by their status; those of refusals as far as the route can give them.
Json responses_of(const Route& route) {
    Json content = Json::object();
    // Media types of the document have no parameters.
    const std::string type(route.type.substr(0, route.type.find(';')));
    content[type] = Json::object();
    if (const std::string schema = schema_name(route); !schema.empty())
        content[type] = {{"schema", {{"$ref", "#/components/schemas/" + schema}}}};
    else if (type == "application/json")
        content[type] = {{"schema", {{"type", "object"}}}};
    const bool of_camera = route.path.find("{camera}") != std::string_view::npos;
    const bool of_newest =
        route.path.find("/frames/latest") != std::string_view::npos && route.answers != Answers::frame_exr;
    if (route.answers == Answers::frame)
        for (const FrameForm& form : frame_forms())
            content[std::string(form.type)] = form.suffix == "json"
                                                  ? Json{{"schema", {{"$ref", "#/components/schemas/Frame"}}}}
                                                  : Json::object();
    if (route.answers == Answers::events) content["text/event-stream"] = Json::object();
    Json responses{{"200", {{"description", route.help}, {"content", content}}}};
    if (route.answers == Answers::trigger)
        responses["202"] = {{"description", "The fate of the frame is not known, or was not asked for"},
                            {"content", content}};
    if (of_newest) responses["204"] = {{"description", "No frame came in time"}};
    const bool is_tagged = route.answers == Answers::page || route.answers == Answers::openapi ||
                           (of_camera && !route.changes() && route.answers != Answers::pictures);
    if (is_tagged) responses["304"] = {{"description", "As If-None-Match has it"}};
    const auto refuse = [&](bool can, std::initializer_list<const char*> statuses) {
        for (const char* status : statuses)
            if (can) responses[status] = {{"$ref", "#/components/responses/problem"}};
    };
    refuse(route.changes() || route.answers == Answers::events, {"400"});
    refuse(route.role.has_value(), {"401"});
    refuse(true, {"403"});
    refuse(of_camera || route.answers == Answers::support_bundle || route.answers == Answers::self_test,
           {"404", "409"});
    refuse(route.answers == Answers::frame, {"406"});
    refuse(route.method == "PATCH" || route.method == "PUT", {"412"});
    refuse(route.changes(), {"415"});
    refuse(true, {"421"});
    refuse(route.is_api(), {"422"}); // of fields of the query, too
    refuse(route.role.has_value(), {"429"});
    if (route.answers == Answers::ready)
        responses["503"] = {{"description", "A camera is not good, or there is none"}, {"content", content}};
    else
        refuse(of_camera || route.answers == Answers::events || route.answers == Answers::pictures ||
                   route.answers == Answers::support_bundle || route.answers == Answers::self_test,
               {"503"});
    return responses;
}

Json operation_of(const Route& route) {
    Json operation{{"operationId", route.id}, {"summary", route.help}};
    operation["x-role"] = route.role ? Json(name_of(*route.role)) : Json(nullptr);
    if (route.call != nullptr) operation["x-call"] = route.call->name;
    if (!route.role) operation["security"] = Json::array({Json::object()});
    if (Json parameters = parameters_of(route); !parameters.empty())
        operation["parameters"] = std::move(parameters);
    if (route.changes()) operation["requestBody"] = body_of(route);
    operation["responses"] = responses_of(route);
    return operation;
}

} // namespace

Json openapi_document(std::string_view version) {
    Json document{
        {"openapi", "3.1.0"},
        {"jsonSchemaDialect", "https://json-schema.org/draft/2020-12/schema"},
        {"info",
         {{"title", "Obscura"},
          {"version", version},
          {"description",
           "Cameras of this machine: what they do, their settings, faults, scenes and frames. "
           "Each role has what those before it have: viewer reads, operator changes, admin also takes control away."},
          {"license", {{"name", "Apache-2.0"}, {"identifier", "Apache-2.0"}}}}},
        {"servers", Json::array({{{"url", "/"}}})},
        {"security", Json::array({{{"token", Json::array()}}})},
        {"paths", Json::object()}};
    for (const Route& route : routes()) {
        std::string method(route.method);
        for (char& c : method)
            c = static_cast<char>(c - 'A' + 'a');
        document["paths"][std::string(route.path)][method] = operation_of(route);
    }
    Json components = Json::object();
    components["schemas"] = schemas();
    components["parameters"] = {
        {"camera",
         {{"name", "camera"},
          {"in", "path"},
          {"required", true},
          {"description",
           "`id` of a camera in the answer to /api/v1/cameras; "
           "where one daemon runs, the number of its camera, from 0, does as well, and is the same for the next run of that daemon"},
          {"schema", {{"type", "string"}}}}},
        {"feature",
         {{"name", "feature"},
          {"in", "path"},
          {"required", true},
          {"description", "Name of SFNC, as in the answer to .../features"},
          {"schema", {{"type", "string"}}}}},
        {"frame",
         {{"name", "frame"},
          {"in", "path"},
          {"required", true},
          {"description", "`id` of a frame: of latest.json, or of a picture of the WebSocket"},
          {"schema", {{"type", "integer"}, {"minimum", 0}}}}},
        {"if_match",
         {{"name", "If-Match"},
          {"in", "header"},
          {"description", "ETag of the value that was read: another one is not overwritten"},
          {"schema", {{"type", "string"}}}}},
        {"last_event_id",
         {{"name", "Last-Event-ID"},
          {"in", "header"},
          {"description", "Of a stream: the `id` of the last event, after which it goes on. "
                          "Where some are lost an event `lost` tells how many, null: not known"},
          {"schema", {{"type", "string"}, {"pattern", "^[0-9]+(-[0-9a-f]{8})?$"}}}}},
        {"idempotency_key",
         {{"name", "Idempotency-Key"},
          {"in", "header"},
          {"description",
           "A text of the client's: the same command that is sent again with it within ten minutes is not made again, but answered as before"},
          {"schema", {{"type", "string"}, {"pattern", "^[!-~]{1,128}$"}}}}},
        {"prefer",
         {{"name", "Prefer"},
          {"in", "header"},
          {"description", "respond-async: answer at once with 202, as with wait = false"},
          {"schema", {{"type", "string"}}}}}};
    components["responses"] = {
        {"problem",
         {{"description", "Why not"},
          {"content",
           {{"application/problem+json", {{"schema", {{"$ref", "#/components/schemas/Problem"}}}}}}}}}};
    components["securitySchemes"] = {{"token", {{"type", "http"}, {"scheme", "bearer"}}}};
    document["components"] = std::move(components);
    return document;
}

} // namespace obscura::web
