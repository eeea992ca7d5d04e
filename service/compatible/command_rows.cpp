// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/command_rows.hpp"

#include "service/compatible/command_row.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace obscura::service::compatible {
namespace {

Row row(std::string_view name) {
    return Row(name);
}

std::vector<Command> in(Group group, std::vector<Row> rows) {
    std::vector<Command> all;
    for (Row& row : rows)
        all.push_back(std::move(row).in(group));
    return all;
}

} // namespace

std::vector<Command> make_commands() {
    std::vector<Command> all;
    for (
        std::vector<Command>& group : std::vector<std::vector<Command>>{
            in(Group::connection,
               {
                   row("cd")
                       .takes("path:text")
                       .help("Changes the folder that relative names of files start from, below the root."),
                   row("clearMetadata").help("Forgets all metadata."),
                   row("close").unanswered().help("Ends the connection; what was sent before is done first."),
                   row("closeViewer").awaited().help("Closes the viewer of the server, which has none."),
                   row("getMetadata").gives("metadata").help("The metadata that were set."),
                   row("getRessourcePath").gives("ressource_path").help("The folder of resources."),
                   row("help").takes("function_name:text").gives("help").help("Says what a call does."),
                   row("ls").gives("listing").help("Lists the folder that names of files start from."),
                   row("printAPI").gives("api").help("Lists all calls with their arguments."),
                   row("pwd").gives("path").help("The folder that relative names of files start from."),
                   row("runLUACode").takes("code:text").gives("return").help("Runs Lua on the server."),
                   row("runLUAScript")
                       .takes("filename:text")
                       .gives("return")
                       .help("Runs a Lua file of the server."),
                   row("sendFile")
                       .takes("filename:text compressed:flag offset:integer append:flag data:bytes")
                       .awaited()
                       .help("Writes a part of a file below the root."),
                   row("sendImageTo")
                       .takes(
                           "target_name:text format:text port:integer depth:integer channels:integer texture_name:text")
                       .unanswered()
                       .help("Sends the picture to another program."),
                   row("setCompressionLevel")
                       .takes("compression_level:integer")
                       .awaited()
                       .help("How pictures are compressed: 0 not at all, to 9 best."),
                   row("setMetadata")
                       .takes("name:text value:any")
                       .help("Sets one of the metadata, which the client gets back."),
                   row("setRessourcePath")
                       .takes("ressource_path:text")
                       .help("Sets the folder of resources, below the root."),
                   row("syncDir")
                       .takes("dirname:text files:list compressionLevel:integer targets:list?")
                       .gives("files2update")
                       .help(
                           "Compares files of the client with those below the root; those that differ are asked for."),
                   row("version").gives("version").help("Version of the server."),
               }),
            in(Group::camera,
               {
                   row("getCameraFOVDeg")
                       .gives("fov")
                       .help("Fields of view, horizontal and vertical, degrees."),
                   row("getCameraFOVRad")
                       .gives("fov")
                       .help("Fields of view, horizontal and vertical, radians."),
                   row("getConventions")
                       .gives("conventions")
                       .help("The conventions that setConventions sets."),
                   row("getImageSize").gives("size").help("Width and height, px."),
                   row("getIntegrationTime").gives("integration_time").help("Integration time, s."),
                   row("getPSF").gives("width height psf").help("The point spread function that was set."),
                   row("loadMotionModel")
                       .takes("filename:text parameters:any")
                       .help("Moves the camera by a table .csv of poses in its own frame."),
                   row("loadProjectionModel")
                       .takes("filename:text parameters:any")
                       .help("Sets projection and distortion of the lens."),
                   row("loadPSFModel")
                       .takes("filename:text parameters:any")
                       .help("Loads a point spread function by formula."),
                   row("loadSpectrumModel")
                       .takes("filename:text parameters:any")
                       .help("Sets the wavelengths of the channels: model bands."),
                   row("loadTimeSamplingModel")
                       .takes("filename:text parameters:any")
                       .help("Sets when rows are exposed: rolling_shutter or global_shutter."),
                   row("setCameraFOVDeg")
                       .takes("fov_x:number fov_y:number")
                       .help("Sets the fields of view, degrees; each gives a focal length of its own."),
                   row("setCameraFOVRad")
                       .takes("fov_x:number fov_y:number")
                       .help("Sets the fields of view, radians; each gives a focal length of its own."),
                   row("setConventions")
                       .takes("quaternion_convention:integer camera_convention:integer")
                       .help(
                           "Quaternions are 0: x y z w, 1: w x y z; the camera looks 0: along -z with y up, 1: along +z with y down."),
                   row("setFocus")
                       .takes("focus_plane_Z:number pupil_radius:number")
                       .help("Distance of focus and radius of the pupil, m; 0: all is sharp."),
                   row("setImageSize")
                       .takes("width:integer height:integer")
                       .help("Sets width and height, px."),
                   row("setIntegrationTime")
                       .takes("integration_time:number")
                       .help("Sets the integration time, s, over which motions blur."),
                   row("setPSF")
                       .takes(
                           "w:integer h:integer psf:bytes support_w:number support_h:number blooming_threshold_distance:integer")
                       .awaited()
                       .help(
                           "Sets the point spread function as an image, with the width and height in px that it covers (-1: a value for each px)."),
                   row("setPSFWithTail")
                       .takes(
                           "w:integer h:integer psf:bytes support_w:number support_h:number w_tail:integer h_tail:integer psf_tail:bytes support_w_tail:number support_h_tail:number blooming_threshold_distance:integer PSF_tail_coef:number")
                       .awaited()
                       .help(
                           "Sets the point spread function as two images: a core, and a tail of which PSF_tail_coef is the share of light."),
               }),
            in(Group::scene,
               {
                   row("createBody")
                       .takes("body_name:text shape_name:text brdf_name:text textures:any")
                       .help(
                           "Creates a body of a shape, a BRDF and textures: diffuse, specular, emission, normal."),
                   row("createBRDF")
                       .takes("name:text filename:text parameters:any")
                       .help("Creates a BRDF of a model file or a built-in model."),
                   row("createDEM")
                       .takes("object_name:text conemap_filename:text brdf_name:text texture:text")
                       .gives("info")
                       .help("Creates a plane with relief of a .dem file."),
                   row("createMesh")
                       .takes("object_name:text model_name:text scale:number")
                       .help("Creates a body of a mesh file; scale: metres per unit of the file."),
                   row("createShape")
                       .takes("name:text filename:text parameters:any")
                       .help("Creates a shape of a model file or a built-in model."),
                   row("createSphericalDEM")
                       .takes("object_name:text conemap_filename:text brdf_name:text texture:text")
                       .gives("info")
                       .help("Creates a planet with relief of a .dem file."),
                   row("exists")
                       .takes("object_name:text")
                       .gives("exists")
                       .help("Whether there is an object of that name."),
                   row("getObjectAttitude")
                       .takes("object_name:text")
                       .gives("attitude")
                       .help("Attitude of an object, in the convention of quaternions."),
                   row("getObjectElementProperty")
                       .takes("name:text element_name:text property:text")
                       .gives("value")
                       .help("Value of a property of an element of an object."),
                   row("getObjectMotion")
                       .takes("object_name:text")
                       .gives("motion")
                       .help("Velocity, m/s, and rotation rate, rad/s."),
                   row("getObjectPosition")
                       .takes("object_name:text")
                       .gives("pos")
                       .help("Position of an object, m."),
                   row("getObjectProperty")
                       .takes("name:text property:text")
                       .gives("value")
                       .help("Value of a property of an object."),
                   row("getState")
                       .gives("state")
                       .help("Positions, attitudes, motions and settings as a text for setState."),
                   row("loadAndProjectMultipleMeshes")
                       .takes(
                           "object_name:text mesh_names:any positions:any attitudes:any projection_center:vector offset_ratio:number")
                       .help("Loads meshes into one object, projected onto those before."),
                   row("loadMultipleMeshes")
                       .takes("object_name:text mesh_names:any positions:any attitudes:any")
                       .help("Loads meshes, each with position and attitude, into one object."),
                   row("printObjectStructure")
                       .takes("object_name:text")
                       .gives("object_structure")
                       .help("Describes the elements of an object."),
                   row("printState").takes("state:text").gives("readable_state").help("A state in words."),
                   row("reset").help("Empties the scene and sets all but conventions and folders back."),
                   row("saveObject")
                       .takes("object_name:text filename:text")
                       .help("Writes an object to a file."),
                   row("setAlias")
                       .takes("object_name:text alias:text")
                       .help("Gives an object a second name."),
                   row("setObjectAttitude")
                       .takes("object_name:text attitude:vector")
                       .help("Sets the attitude of an object: turns vectors of its frame into the scene's."),
                   row("setObjectElementBRDF")
                       .takes("object_name:text element_name:text brdf:text")
                       .help(
                           "Sets the BRDF of an element; the element of the object's own name is all of it."),
                   row("setObjectElementProperty")
                       .takes("name:text element_name:text property:text value:number")
                       .help("Sets a property of an element of an object."),
                   row("setObjectElementTransform")
                       .takes("object_name:text element_name:text matrix:list relative:flag")
                       .help(
                           "Moves and turns all of an object by a matrix within its frame; its place and attitude stay."),
                   row("setObjectMotion")
                       .takes("object_name:text motion:list")
                       .help(
                           "Sets velocity, m/s, and rotation rate, rad/s, of an object during the integration time."),
                   row("setObjectPosition")
                       .takes("object_name:text pos:vector")
                       .help("Sets the position of an object, m."),
                   row("setObjectProperty")
                       .takes("name:text property:text value:number")
                       .help("Sets a property of an object."),
                   row("setState")
                       .takes("state:text")
                       .help("Sets back what getState gave, of objects that exist."),
               }),
            in(Group::light,
               {
                   row("createLight")
                       .takes("light_name:text spectrum:vector cutoff:number exponent:number")
                       .help("Creates a spot light: "
                             "W for each channel, half angle in degrees, exponent of the fall-off."),
                   row("getSunPower")
                       .gives("sun_power")
                       .help("Radiant intensity of the Sun, W/sr for each channel."),
                   row("setBackground").takes("background:text").help("Sets the background: a star map."),
                   row("setStarThreshold")
                       .takes("threshold:number")
                       .help("Irradiance, W/m2, that a star must exceed in a channel to be drawn."),
                   row("setSunPower")
                       .takes("sun_color:vector")
                       .help("Sets the radiant intensity of the Sun, W/sr for each channel."),
                   row("setSunPowerAtDistance")
                       .takes("sun_color:vector distance:number")
                       .help("Sets the irradiance, W/m2 for each channel, of the Sun at a distance, m."),
               }),
            in(Group::texture,
               {
                   row("attachDynamicTexture")
                       .takes("object_name:text element_name:text texture_name:text texture_unit_id:integer")
                       .help(
                           "Makes a dynamic texture one of an element's: 0 diffuse, 1 specular, 2 emission, 3 normal."),
                   row("createUserDataTexture")
                       .takes("name:text width:integer height:integer gray:flag")
                       .help("Creates a texture whose values the client sends."),
                   row("createVideoTexture")
                       .takes("name:text filename:text loop:flag")
                       .help("Creates a texture of numbered pictures."),
                   row("loadTextureObject")
                       .takes("name:text filename:text parameters:any")
                       .help("Loads a texture model."),
                   row("updateDynamicTexture").takes("name:text").help("The next picture of a sequence."),
                   row("updateUserDataTexture")
                       .takes("name:text data:bytes")
                       .awaited()
                       .help("Sends the values of a texture: float32, compressed."),
               }),
            in(Group::rendering,
               {
                   row("createPerPixelProcess")
                       .takes("name:text filename:text parameters:any")
                       .help("Creates a process for each pixel."),
                   row("dumpPhotonMapToFile")
                       .takes("object_name:text filename:text")
                       .help("Writes a photon map."),
                   row("enableAutoUpdate")
                       .takes("enable:flag")
                       .help("Updates the viewer by itself; there is none."),
                   row("enableIrradianceMode")
                       .takes("enable:flag")
                       .help("Pixels hold true: W/m2 of the pixel, false: W m-2 sr-1."),
                   row("enableLOSmapping")
                       .takes("b_enable:flag")
                       .help("Keeps the line of sight of each pixel."),
                   row("enablePathTracing")
                       .takes("enable:flag")
                       .help("Light between bodies, with up to setMaxSecondaryRays reflections."),
                   row("enablePhotonAccumulation")
                       .takes("enable:flag")
                       .help("Accumulates light on surfaces instead of a picture."),
                   row("enablePreviewMode")
                       .takes("enable:flag")
                       .help("Another rendering mode: remembered, the picture is the same."),
                   row("enableRaySharing")
                       .takes("enable:flag")
                       .help("Shares rays of neighbouring pixels: remembered, the picture is the same."),
                   row("enableRaytracing")
                       .takes("enable:flag")
                       .help("False asks for another rendering mode: the picture is the same."),
                   row("enableRegularPixelSampling")
                       .takes("enable:flag")
                       .help("Regular samples in pixels: remembered, samples are always stratified."),
                   row("enableRegularPSFSampling")
                       .takes("enable:flag")
                       .help("Regular samples of the PSF: remembered, samples are always stratified."),
                   row("enableScanningDeviceMode")
                       .takes("enable:flag")
                       .help(
                           "Scanning device: the pixels of the picture are one detector of one pixel, which the field of view is of, at the times of the time sampling model; without stars."),
                   row("enableSkipPixelSampling")
                       .takes("enable:flag")
                       .help("Leaves pixels without bodies out: remembered, that is always done."),
                   row("enableSpecularOptimization")
                       .takes("enable:flag")
                       .help("Samples reflections of the Sun: remembered, that is always done."),
                   row("enableTimeMapping")
                       .takes("b_enable:flag")
                       .help("Keeps the mean time of the light of each pixel."),
                   row("generateMicroTasks")
                       .gives("utasks")
                       .help("The picture as tasks, of which other servers can render parts."),
                   row("getGlobalVariables").gives("names_and_values").help("Variables of models."),
                   row("getIrradianceMode").gives("enable").help("Whether pixels hold W/m2."),
                   row("getLOSmapping").gives("b_enable").help("Whether lines of sight are kept."),
                   row("getMaxSamplesPerPixel")
                       .gives("max_samples")
                       .help("Largest number of samples per pixel."),
                   row("getMaxSecondaryRays")
                       .gives("max_secondary_rays")
                       .help("Largest number of reflections with path tracing."),
                   row("getMaxShadowRays").gives("max_shadow_rays").help("Largest number of shadow rays."),
                   row("getNbSamplesPerPixel").gives("nb_samples").help("Samples per pixel."),
                   row("getObjectSamples")
                       .takes("object_name:text")
                       .gives("nb_samples")
                       .help("Samples of an object."),
                   row("getPreviewMode").gives("enable").help("What enablePreviewMode set."),
                   row("getScanningDeviceMode")
                       .gives("enable")
                       .help("Whether the picture is that of a scanning device."),
                   row("render").help("Renders the picture."),
                   row("renderMicroTasks").takes("utasks:any").help("Renders the pixels of tasks."),
                   row("runPerPixelProcess")
                       .takes("output_name:text process_name:text")
                       .help("Runs a process for each pixel."),
                   row("setGlobalVariables").takes("names_and_values:any").help("Sets variables of models."),
                   row("setMaxSamplesPerPixel")
                       .takes("max_samples:integer")
                       .help(
                           "Sets the largest number of samples per pixel: remembered, each pixel gets setNbSamplesPerPixel."),
                   row("setMaxSecondaryRays")
                       .takes("max_secondary_rays:integer")
                       .help("Sets the largest number of reflections with path tracing."),
                   row("setMaxShadowRays")
                       .takes("max_shadow_rays:integer")
                       .help(
                           "Sets the largest number of shadow rays: remembered, each sample has one of its own."),
                   row("setNbSamplesPerPixel")
                       .takes("nb_samples:integer")
                       .help("Sets the samples per pixel."),
                   row("setObjectSamples")
                       .takes("object_name:text nb_samples:number")
                       .help("Sets samples of an object: remembered."),
                   row("updateDisplay").help("Updates the viewer of the server, which has none."),
               }),
            in(Group::output,
               {
                   row("getDepthMap")
                       .gives("w h compressed depth_data")
                       .help("Distances along the rays of the pixels, m, float64; infinite: nothing there."),
                   row("getImage")
                       .gives("w h compressed image_data")
                       .help("The picture: 4 channels, float32."),
                   row("getImageGray32F")
                       .gives("w h compressed image_data")
                       .help("Mean of the first three channels, float32."),
                   row("getImageGray8")
                       .gives("w h compressed image_data")
                       .help("Mean of the first three channels, 0 to 1 as 0 to 255."),
                   row("getImageRGBA8")
                       .gives("w h compressed image_data")
                       .help("The 4 channels, 0 to 1 as 0 to 255."),
                   row("getImageSpectrumProjection")
                       .takes("spectrum:vector")
                       .gives("w h compressed image_data")
                       .help("The channels weighted by a spectrum, float32."),
                   row("getLOSMap")
                       .gives("w h compressed los_data")
                       .help("Lines of sight of the pixels in the camera's frame, float32."),
                   row("getNormalMap")
                       .gives("w h compressed normal_data")
                       .help("Normals in the camera's frame, float32."),
                   row("getTimeMap")
                       .gives("w h compressed time_data")
                       .help("Mean time of the light of the pixels, s, float32."),
                   row("getTimeMapping").gives("b_enable").help("Whether times are kept."),
                   row("intersectScene")
                       .takes("rays:any")
                       .gives("distance_to_hit")
                       .help(
                           "Distances along rays, rows of origin and direction, to the nearest surface, m; infinite: none."),
                   row("saveDepthMap").takes("filename:text").help("Writes the depth map to a file."),
                   row("saveImage").takes("filename:text").help("Writes the picture to a file."),
                   row("saveImageGray32F")
                       .takes("filename:text")
                       .help("Writes the mean of the first three channels to a file."),
                   row("saveImageGray8")
                       .takes("filename:text")
                       .help("Writes the mean of the first three channels in 8 bits to a file."),
                   row("saveImageRGB8")
                       .takes("filename:text")
                       .help("Writes the first three channels in 8 bits to a file."),
                   row("saveImageSpectrumProjection")
                       .takes("filename:text spectrum:vector")
                       .help("Writes the channels weighted by a spectrum to a file."),
                   row("saveImageSpectrumProjectionQuantized")
                       .takes("filename:text spectrum:vector nbits:integer")
                       .help("Writes the channels weighted by a spectrum to a file of integers."),
               }),
            in(Group::preview,
               {
                   row("enableGlobalDynamicShadowMap").takes("enable:flag"),
                   row("getCubeMapSize").gives("cube_map_size"),
                   row("getObjectDynamicCubeMap").takes("object_name:text").gives("enable"),
                   row("getObjectDynamicShadowMap").takes("object_name:text").gives("enable"),
                   row("getPhotonMapSamplingStep").gives("step"),
                   row("getSelfVisibilitySamplingStep").gives("step"),
                   row("getShadowMapSize").gives("shadow_map_size"),
                   row("setCubeMapSize").takes("cube_map_size:any"),
                   row("setCubeMapZNear").takes("znear:number"),
                   row("setFSAA").takes("fsaa:integer"),
                   row("setNearPlane").takes("z:number"),
                   row("setObjectDynamicCubeMap").takes("object_name:text enable:flag"),
                   row("setObjectDynamicShadowMap").takes("object_name:text enable:flag"),
                   row("setPhotonMapSamplingStep").takes("step:number"),
                   row("setPSFSigma").takes("sigma:number"),
                   row("setSelfVisibilitySamplingStep").takes("step:number"),
                   row("setShadowMapSize").takes("shadow_map_size:any"),
               }),
            in(Group::removed,
               {
                   row("enableDoublePrecisionMode").awaited().help("Everything is done in double precision."),
                   row("enableFastPSFMode").awaited().help("Has no effect."),
                   row("enableMultilateralFiltering").awaited().help("Has no effect."),
                   row("getDoublePrecisionMode").awaited().help("Always true."),
               }),
        })
        std::move(group.begin(), group.end(), std::back_inserter(all));
    std::sort(all.begin(), all.end(), [](const Command& a, const Command& b) { return a.name < b.name; });
    return all;
}

} // namespace obscura::service::compatible
