# SPDX-License-Identifier: Apache-2.0
"""Renders a scene file's polygons and meshes with Blender's Cycles: the peer that validation.py compares with.

Usage: blender -b --factory-startup -P cycles_scene.py -- SCENE.toml BANDS SAMPLES SIZE SEEDS THREADS OUT
BANDS: up to three of the scene's bands, from 1, with commas; they become red, green and blue.
SEEDS: with commas; OUT gets "-SEED.exr" appended. A mesh must be a binary PLY file of triangles as peer_scenes.py writes
them. Blender's own lines tell when the rendering proper begins ("Sample 0/") and ends ("Finished").
"""
import math
import sys
import tomllib

import bpy
from mathutils import Matrix, Vector

scene_file, bands, samples, size, seeds, threads, out = sys.argv[sys.argv.index("--") + 1:]
bands = [int(b) - 1 for b in bands.split(",")]
bands += bands[-1:] * (3 - len(bands))
with open(scene_file, "rb") as file:
    scene = tomllib.load(file)
samples, size = int(samples), int(size)

for item in list(bpy.data.objects):
    bpy.data.objects.remove(item)
target = bpy.context.scene
target.world.node_tree.nodes["Background"].inputs[1].default_value = 0


def colour_of(values, scale=1.0):
    return [scale * values[b] for b in bands]


def read_ply(name):
    import numpy
    with open(name, "rb") as ply:
        counts = []
        while (line := ply.readline()) != b"end_header\n":
            if line.startswith(b"element"):
                counts.append(int(line.split()[2]))
        points = numpy.fromfile(ply, "<f4", 3 * counts[0])
        table = numpy.fromfile(ply, [("n", "u1"), ("v", "<i4", 3)], counts[1])
    return points, numpy.ascontiguousarray(table["v"]).ravel()


# Cycles works in floats and with lengths of its own for many things: bodies get a size of about 1.
unit_m = 1.0


def mesh_of(body):
    global unit_m
    mesh = bpy.data.meshes.new(body["name"])
    if "file" not in body:
        faces = body["faces_m"]
        points = [point for face in faces for point in face]
        polygons, first = [], 0
        for face in faces:
            polygons.append(list(range(first, first + len(face))))
            first += len(face)
        mesh.from_pydata(points, [], polygons)
        mesh.update()
        return mesh
    points, corners = read_ply(body["file"])
    unit_m = float(abs(points).max())
    mesh.vertices.add(len(points) // 3)
    mesh.vertices.foreach_set("co", points / unit_m)
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(corners) // 3)
    mesh.polygons.foreach_set("loop_start", range(0, len(corners), 3))
    mesh.polygons.foreach_set("loop_total", [3] * (len(corners) // 3))
    mesh.update(calc_edges=True)
    return mesh


for body in scene["body"]:
    mesh = mesh_of(body)
    item = bpy.data.objects.new(body["name"], mesh)
    target.collection.objects.link(item)
    material = bpy.data.materials.new(body["name"])
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    albedo = body.get("albedo", 1)
    diffuse.inputs[0].default_value = (*colour_of(body.get("colour", [1] * 16), albedo), 1)
    if "emission_w_m2_sr" in body:
        # The outer side alone glows.
        emission = nodes.new("ShaderNodeEmission")
        emission.inputs[0].default_value = (*colour_of(body["emission_w_m2_sr"]), 1)
        dark = nodes.new("ShaderNodeEmission")
        dark.inputs[1].default_value = 0
        side = nodes.new("ShaderNodeNewGeometry")
        mix = nodes.new("ShaderNodeMixShader")
        links.new(side.outputs["Backfacing"], mix.inputs[0])
        links.new(emission.outputs[0], mix.inputs[1])
        links.new(dark.outputs[0], mix.inputs[2])
        both = nodes.new("ShaderNodeAddShader")
        links.new(diffuse.outputs[0], both.inputs[0])
        links.new(mix.outputs[0], both.inputs[1])
        links.new(both.outputs[0], output.inputs[0])
    else:
        links.new(diffuse.outputs[0], output.inputs[0])
    item.data.materials.append(material)

view = scene["camera"]
camera = bpy.data.cameras.new("camera")
# Not the sensor's own size: Blender does not take less than a millimetre.
camera.sensor_width = 36
camera.lens = view["focal_length_mm"] * 36 / (view["width"] * view["pixel_pitch_um"] * 1e-3)
camera.clip_start, camera.clip_end = 0.001, 1000
item = bpy.data.objects.new("camera", camera)
target.collection.objects.link(item)
target.camera = item
eye = Vector(view["position_m"]) / unit_m
z = -Vector(view["boresight"]) if "boresight" in view else eye - Vector(view["look_at_m"]) / unit_m
z.normalize()
x = Vector(view["up"]).cross(z).normalized()
y = z.cross(x)
item.matrix_world = Matrix(((x.x, y.x, z.x, eye.x), (x.y, y.y, z.y, eye.y), (x.z, y.z, z.z, eye.z), (0, 0, 0, 1)))

if "direction" in scene["sun"]:
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = 1
    sun.angle = 2 * math.asin(695700e3 / (scene["sun"].get("distance_au", 1) * 149597870700))
    item = bpy.data.objects.new("sun", sun)
    target.collection.objects.link(item)
    item.rotation_mode = "QUATERNION"
    item.rotation_quaternion = Vector(scene["sun"]["direction"]).to_track_quat("Z", "Y")

render = target.render
render.engine = "CYCLES"
cycles = target.cycles
cycles.device = "CPU"
cycles.use_adaptive_sampling = False
cycles.use_denoising = False
bounces = scene.get("max_bounces", 0)
cycles.max_bounces = cycles.diffuse_bounces = bounces
cycles.glossy_bounces = cycles.transmission_bounces = 0
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
cycles.light_sampling_threshold = 0
cycles.pixel_filter_type = "BOX"
cycles.filter_width = 1
render.threads_mode, render.threads = "FIXED", int(threads)
render.resolution_x = render.resolution_y = size
render.resolution_percentage = 100
render.image_settings.file_format = "OPEN_EXR"
render.image_settings.color_depth = "32"
cycles.samples = samples
for seed in seeds.split(","):
    cycles.seed = int(seed)
    bpy.ops.render.render()
    bpy.data.images["Render Result"].save_render(f"{out}-{seed}.exr")
