// SPDX-License-Identifier: Apache-2.0
// Folder of the appliance's models, and how programs of models are made and measured.
#include "core/error.hpp"
#include "emulator/config/daemon_sections.hpp"
#include "emulator/control/model_store.hpp"
#include "emulator/unit/reload.hpp"
#include "models/kinds/material_program.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

namespace model_store_test {

using namespace obscura;
using emulator::ModelPlace;
using emulator::ModelStore;

TEST_CASE("a model is found beside the scene, then in the folder, then among the shipped ones",
          "[emulator]") {
    const test::TempFolder temporary;
    const std::filesystem::path scene = temporary.path() / "scenes" / "scene.toml";
    temporary.write("scenes/scene.toml", "material = { model = \"lambert\" }");
    ModelStore store(temporary.path() / "models");
    CHECK(store.find("lambert.brdf", scene).place == ModelPlace::shipped);
    CHECK_FALSE(store.put("lambert.brdf", "// mine", scene).has_value());
    CHECK(store.find("lambert.brdf", scene).place == ModelPlace::folder);
    CHECK(ModelStore::text_of(store.find("lambert.brdf", scene).file) == "// mine");
    CHECK(store.find("lambert.brdf", scene, ModelPlace::shipped).place == ModelPlace::shipped);
    CHECK(store.put("lambert.brdf", "// other", scene) == "// mine");
    temporary.write("scenes/lambert.brdf", "// beside");
    CHECK(store.find("lambert.brdf", scene).place == ModelPlace::scene);
    CHECK_THROWS_AS(store.put("lambert.brdf", "// third", scene), service::Failure);
    store.restore("lambert.brdf", "// mine");
    CHECK(store.remove("lambert.brdf") == "// mine");
    CHECK_THROWS_AS(store.remove("lambert.brdf"), service::Failure);
    CHECK(emulator::scene_names_model(scene, "lambert.brdf"));
    CHECK_FALSE(emulator::scene_names_model(scene, "lamber.brdf"));
}

TEST_CASE("without a folder of models nothing is stored", "[emulator]") {
    const test::TempFolder temporary;
    ModelStore store({});
    CHECK_THROWS_AS(store.put("x.brdf", "//", temporary.path() / "scene.toml"), service::Failure);
    CHECK_FALSE(store.list(temporary.path() / "scene.toml").empty()); // the shipped ones
}

TEST_CASE("the folder of models is in the service's own", "[emulator]") {
    emulator::ModelsSection section;
    ::unsetenv("STATE_DIRECTORY");
    CHECK(emulator::models_folder(section).empty());
    ::setenv("STATE_DIRECTORY", "/var/lib/obscura-left:/var/lib/other", 1);
    CHECK(emulator::models_folder(section) == "/var/lib/obscura-left/models");
    ::unsetenv("STATE_DIRECTORY");
    section.folder = "/srv/models";
    CHECK(emulator::models_folder(section) == "/srv/models");
    section.folder = "";
    CHECK(emulator::models_folder(section).empty());
}

TEST_CASE("a model in the folder is part of the fingerprint of a scene that names it", "[emulator]") {
    const test::TempFolder temporary;
    const std::filesystem::path scene = temporary.path() / "scene.toml", folder = temporary.path() / "models";
    temporary.write("scene.toml", "material = { model = \"own\" }");
    const auto without = emulator::scene_fingerprint(scene, folder);
    temporary.write("models/other.brdf", "//");
    CHECK(emulator::scene_fingerprint(scene, folder) == without);
    temporary.write("models/own.brdf", "//");
    const auto with = emulator::scene_fingerprint(scene, folder);
    CHECK(with != without);
    temporary.write("models/own.brdf", "// longer");
    CHECK(emulator::scene_fingerprint(scene, folder) != with);
    CHECK(emulator::scene_fingerprint(scene, {}) == without);
}

TEST_CASE("a model that costs more than is allowed is refused with its cost", "[emulator]") {
    const auto model = models::Model::parse(
        "x.brdf", "vec4 brdf(vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)\n"
                  "{ return diffuse * exp(sin((i | n)) + (i | e)); }\n");
    models::MaterialParameters parameters{models::default_parameters(*model)};
    CHECK(models::MaterialProgram(model, parameters).program().measured_ns() == 0);
    parameters.target.max_ns = 1e9;
    CHECK(models::MaterialProgram(model, parameters).program().measured_ns() > 0);
    parameters.target.max_ns = 1e-3;
    try {
        const models::MaterialProgram refused(model, parameters);
        FAIL("was not refused");
    } catch (const ConfigError& error) {
        const std::string why = error.what();
        CHECK(why.starts_with("x.brdf:1:6: an evaluation takes "));
        CHECK(why.ends_with("(models.max_ns_per_evaluation)"));
    }
}

TEST_CASE("programs are made where they are told to be", "[emulator]") {
    const auto model = models::Model::parse(
        "x.brdf", "vec4 brdf(vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)\n"
                  "{ return diffuse * (i | n); }\n");
    models::MaterialParameters parameters{models::default_parameters(*model)};
    int aside = 0;
    parameters.target.aside = [&aside](const std::function<void()>& work) {
        ++aside;
        std::thread(work).join();
    };
    parameters.target.target = models::NativeTarget::none;
    const models::MaterialProgram law(model, parameters);
    CHECK(aside == 1);
    CHECK_FALSE(law.program().is_native());
}

} // namespace model_store_test
