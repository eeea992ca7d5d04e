// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/model_calls.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "core/realtime/log.hpp"
#include "core/text/printable.hpp"
#include "emulator/config/model_use.hpp"
#include "emulator/control/model_examination.hpp"
#include "models/model/entry_points.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::bad_argument;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Permission;
using service::Work;

constexpr std::chrono::seconds unused{30};
constexpr std::string_view file_help = "Name of the model, with the ending of its kind";

struct ModelName {
    std::string file;
    std::optional<ModelPlace> place;

    Fields fields() {
        return {{config::key("file", &file).required().help(file_help),
                 config::key("place", &place, "first")
                     .help("Where it stands: in the folder of the scene, in models.folder, or shipped; "
                           "first: the first of these that has it, as scenes look")}};
    }
};

/// A model that a client sends.
struct ModelText {
    std::string file;
    json text;

    Fields fields() {
        return {{config::key("file", &file).required().help(file_help)},
                {{"text", "string", "Text of the model, at most 64 KiB", &text, true}}};
    }
    /// Throws Failure.
    [[nodiscard]] std::string checked() const {
        ModelStore::check_name(file);
        if (!text.is_string()) throw bad_argument("text", "text: a string is wanted");
        return ModelStore::checked_text(text.get<std::string>());
    }
};

struct WantedPlot : ModelText {
    std::string form = "png";

    Fields fields() {
        Fields all = ModelText::fields();
        all.keys.push_back(config::key("form", &form)
                               .help("Form of the picture, without a dot: one of the plots of model.check"));
        return all;
    }
};

struct NewModel : ModelText {
    bool show = false;

    Fields fields() {
        Fields all = ModelText::fields();
        all.keys.push_back(
            config::key("show", &show)
                .help(
                    "Build the scene that is shown again, and show it from a frame on; if that is refused, nothing has changed"));
        return all;
    }
};

struct ModelRemoval {
    std::string file;
    bool show = false;

    Fields fields() {
        return {
            {config::key("file", &file).required().help(file_help),
             config::key("show", &show)
                 .help(
                     "As for model.put: the scene then finds a shipped model of that name, or is refused")}};
    }
};

json findings_of(const ModelExamination& examined) {
    json rows = json::array();
    for (const models::Finding& finding : examined.findings)
        rows.push_back({{"line", finding.at.line},
                        {"column", finding.at.column},
                        {"severity", finding.error ? "error" : "warning"},
                        {"what", finding.what}});
    return rows;
}

/// Title of a stored model; empty where it cannot be read now.
std::string title_of(const std::filesystem::path& file) {
    try {
        return models::title_comment(ModelStore::text_of(file));
    } catch (const Failure&) {
        return ""; // unreadable now; model.get says why
    }
}

std::string_view kind_of_name(const std::string& name) {
    const models::ModelKind* const kind = models::kind_of_file(name);
    return kind == nullptr ? "" : kind->name;
}

std::string base64(const std::string& bytes) {
    std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
    const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),        // NOLINT
                                     reinterpret_cast<const unsigned char*>(bytes.data()), // NOLINT
                                     static_cast<int>(bytes.size()));
    text.resize(static_cast<std::size_t>(size));
    return text;
}

/// Whether a sensor has the model of that file.
bool has_model(const std::vector<std::filesystem::path>& sensors, const std::filesystem::path& file) {
    return std::any_of(sensors.begin(), sensors.end(), [&](const std::filesystem::path& one) {
        return absolute_path(one) == absolute_path(file);
    });
}

service::Call list_call(const ModelStore& store, ModelUsers users) {
    service::Call call = service::call<service::NoArguments>(
        "model.list", Permission::view,
        "Lists the models that scenes find: beside the scene that is shown, in models.folder, and shipped ones.",
        [&store, users = std::move(users)](const service::NoArguments&, Work& /*work*/) {
            const std::filesystem::path scene = users.scene();
            const std::vector<std::filesystem::path> sensors = users.sensors();
            json rows = json::array(), kinds = json::array();
            for (const StoredModel& model : store.list(scene))
                rows.push_back({{"name", model.name()},
                                {"kind", kind_of_name(model.name())},
                                {"place", name_of(model.place)},
                                {"hidden", model.hidden},
                                {"used", has_model(sensors, model.file) ||
                                             (!model.hidden && scene_names_model(scene, model.name()))},
                                {"title", title_of(model.file)}});
            for (const models::ModelKind& kind : models::model_kinds())
                kinds.push_back({{"name", kind.name}, {"ending", kind.ending}, {"help", kind.help}});
            return Answer{{{"models", std::move(rows)},
                           {"kinds", std::move(kinds)},
                           {"words", model_words()},
                           {"folder", store.folder().string()},
                           {"scene", scene.filename().string()}}};
        });
    call.results = {
        {"models", "array of maps", "",
         "name; kind; place: scene, folder or shipped; hidden: one of that name stands where scenes look before; "
         "used: the scene that is shown, or a sensor, has it; title: its first comment"},
        {"kinds", "array of maps", "", "Kinds of models: name, ending of their files, help"},
        {"words", "map", "", "Words of the language, for editors: keywords, functions, constants"},
        {"folder", "string", "", "Folder where model.put stores; empty: there is none"},
        {"scene", "string", "", "Name of the file of the scene that is shown"}};
    return call;
}

service::Call get_call(const ModelStore& store, std::function<std::filesystem::path()> shown) {
    service::Call call =
        service::call<ModelName>("model.get", Permission::view, "Gives the text of a model.",
                                 [&store, shown = std::move(shown)](const ModelName& wanted, Work& /*work*/) {
                                     const StoredModel model = store.find(wanted.file, shown(), wanted.place);
                                     return Answer{{{"file", model.name()},
                                                    {"kind", kind_of_name(model.name())},
                                                    {"place", name_of(model.place)},
                                                    {"text", ModelStore::text_of(model.file)}}};
                                 });
    call.results = {{"file", "string", "", "Its name"},
                    {"kind", "string", "", "Its kind"},
                    {"place", "string", "", "Where it stands: scene, folder or shipped"},
                    {"text", "string", "", "Its text"}};
    return call;
}

/// Asks for the scene again if that is wanted; undoes the change of a model where the scene is refused.
template<typename Undo>
void show_again(bool wanted, SceneRequests& requests, const std::filesystem::path& scene, Work& work,
                const Undo& undo) {
    if (!wanted) return;
    std::string why;
    try {
        why = requests.ask(scene, work.cancelled());
    } catch (...) {
        undo();
        throw;
    }
    if (why.empty()) return;
    undo();
    throw Failure(FailureCode::bad_scene, why);
}

} // namespace

ModelDesk::ModelDesk(const ModelsSection& section, const CoreSet& cores)
    : store_(models_folder(section)), thread_([cores] { enter_model_thread(cores); }, [] {}, unused) {
    if (section.native == NativeModels::off) execution_.target = models::NativeTarget::none;
    constexpr double any_ns = 1e12; // costs are measured to be told
    execution_.max_ns = section.max_ns_per_evaluation > 0 ? section.max_ns_per_evaluation : any_ns;
}

service::Call ModelDesk::check_call() {
    service::Call call = service::call<ModelText>(
        "model.check", Permission::view,
        "Checks the text of a model with its default parameters, and stores nothing: all that is found, what it costs, its parameters.",
        [this](const ModelText& wanted, Work& work) {
            const auto examined = std::make_shared<ModelExamination>();
            thread_.run(
                [examined, file = wanted.file, text = wanted.checked(),
                 execution = execution_](const std::atomic<bool>& /*cancel*/) {
                    *examined = examine_model(file, text, execution);
                },
                work.cancelled());
            return Answer{{{"sound", examined->sound},
                           {"findings", findings_of(*examined)},
                           {"summary", examined->summary},
                           {"kind", kind_of_name(wanted.file)},
                           {"cost", examined->cost},
                           {"parameters", examined->parameters},
                           {"plots", examined->plots}}};
        });
    call.results = {
        {"sound", "boolean", "", "Whether a scene can use it, as far as a text by itself tells"},
        {"findings", "array of maps", "", "line and column, from 1; severity: error or warning; what"},
        {"summary", "string", "", "What was measured of a sound one, in one line"},
        {"kind", "string", "", "Kind of model, by the ending of its name"},
        {"cost", "map", "",
         "operations for each evaluation; values in use at once; ns: processor time of an evaluation on this machine; native: as machine code, else why_interpreted; "
         "empty: it cannot be run"},
        {"parameters", "array of maps", "",
         "name; key of the scene file; type; default: numbers, none for a texture; unit; min, max: nil for none; help; global; line"},
        {"plots", "array of strings", "", "Endings of the pictures that model.plot makes: .png, .svg, .csv"}};
    return call;
}

service::Call ModelDesk::plot_call() {
    service::Call call = service::call<WantedPlot>(
        "model.plot", Permission::view,
        "Draws what a model does with its default parameters, as `obscura model plot` does.",
        [this](const WantedPlot& wanted, Work& work) {
            struct Plotted {
                std::string why_not, bytes;
            };
            const auto plotted = std::make_shared<Plotted>();
            thread_.run(
                [plotted, file = wanted.file, ending = "." + wanted.form, text = wanted.checked(),
                 execution = execution_](const std::atomic<bool>& /*cancel*/) {
                    const ModelExamination examined = examine_model(file, text, execution);
                    const auto& plots = examined.plots;
                    if (!examined.sound)
                        plotted->why_not = "text: " + examined.first_error(file);
                    else if (std::find(plots.begin(), plots.end(), ending) == plots.end())
                        plotted->why_not =
                            fmt::format("form: \"{}\": pictures of this kind are {}",
                                        printable(ending.substr(1), 20), fmt::join(plots, ", "));
                    else
                        plotted->bytes = plot_of(file, text, ending, execution);
                },
                work.cancelled());
            if (!plotted->why_not.empty())
                throw bad_argument(plotted->why_not.starts_with("form") ? "form" : "text", plotted->why_not);
            return Answer{{{"form", wanted.form}, {"bytes", base64(plotted->bytes)}}};
        });
    call.results = {{"form", "string", "", "Form of the picture"},
                    {"bytes", "string", "", "The file, as base64"}};
    return call;
}

service::Call ModelDesk::put_call(SceneRequests& requests, std::function<std::filesystem::path()> shown) {
    service::Call call = service::call<NewModel>(
        "model.put", Permission::scene,
        "Stores the text of a model in models.folder, as a whole, where scenes find it; a text with errors is refused. "
        "With show, frames use it from one on.",
        [this, &requests, shown = std::move(shown)](const NewModel& wanted, Work& work) {
            const std::string text = wanted.checked();
            const auto error = std::make_shared<std::string>();
            thread_.run(
                [error, file = wanted.file, text, execution = execution_](const std::atomic<bool>&) {
                    *error = examine_model(file, text, execution).first_error(file);
                },
                work.cancelled());
            if (!error->empty()) throw bad_argument("text", *error);
            const std::filesystem::path scene = shown();
            const std::lock_guard lock(changes_);
            const std::optional<std::string> before = store_.put(wanted.file, text, scene);
            show_again(wanted.show, requests, scene, work, [&] { store_.restore(wanted.file, before); });
            log_notice("models: {} stored", wanted.file);
            Answer answer{{{"file", wanted.file},
                           {"used", scene_names_model(scene, wanted.file)},
                           {"replaced", before.has_value()}}};
            if (before) answer.head["before"] = *before;
            return answer;
        });
    call.results = {{"file", "string", "", "Its name"},
                    {"used", "boolean", "", "Whether the scene that is shown names it"},
                    {"replaced", "boolean", "", "Whether there was one of that name in the folder"},
                    {"before", "string", "", "Its text; missing: there was none"}};
    return call;
}

service::Call ModelDesk::remove_call(SceneRequests& requests, ModelUsers users) {
    service::Call call = service::call<ModelRemoval>(
        "model.remove", Permission::scene,
        "Removes a model from models.folder. One that the scene names needs show, and another of that name behind it; one of a sensor stays.",
        [this, &requests, users = std::move(users)](const ModelRemoval& wanted, Work& work) {
            ModelStore::check_name(wanted.file);
            const std::filesystem::path scene = users.scene();
            const std::lock_guard lock(changes_);
            if (has_model(users.sensors(), store_.folder() / wanted.file))
                throw Failure(
                    FailureCode::not_now,
                    fmt::format("{}: a sensor has it: it is read again at the next start", wanted.file));
            if (!wanted.show && scene_names_model(scene, wanted.file))
                throw Failure(
                    FailureCode::not_now,
                    fmt::format(
                        "{}: the scene that is shown names it: show = true builds the scene without it",
                        wanted.file));
            std::string before = store_.remove(wanted.file);
            show_again(wanted.show, requests, scene, work, [&] { store_.restore(wanted.file, before); });
            log_notice("models: {} removed", wanted.file);
            return Answer{{{"before", std::move(before)}}};
        });
    call.results = {{"before", "string", "", "Its text"}};
    return call;
}

service::Calls ModelDesk::calls(SceneRequests& requests, const ModelUsers& users) {
    return {list_call(store_, users),        get_call(store_, users.scene), check_call(), plot_call(),
            put_call(requests, users.scene), remove_call(requests, users)};
}

} // namespace obscura::emulator
