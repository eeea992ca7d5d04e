"""Renders a scene file's polygons with Blender's Cycles: the peer that validation.py compares with.

Usage: blender -b --factory-startup -P cycles_scene.py -- SCENE.toml BANDS SAMPLES SIZE SEED THREADS OUT.exr
BANDS: up to three of the scene's bands, from 1, with commas; they become red, green and blue.
Prints "RESULT seconds" of the rendering.
"""
import math
import sys
import time
import tomllib

import bpy
from mathutils import Matrix, Vector

scene_file, bands, samples, size, seed, threads, out = sys.argv[sys.argv.index("--") + 1:]
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


for body in scene["body"]:
    faces = body["faces_m"]
    points = [point for face in faces for point in face]
    polygons, first = [], 0
    for face in faces:
        polygons.append(list(range(first, first + len(face))))
        first += len(face)
    mesh = bpy.data.meshes.new(body["name"])
    mesh.from_pydata(points, [], polygons)
    mesh.update()
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
camera.sensor_width = view["width"] * view["pixel_pitch_um"] * 1e-3
camera.lens = view["focal_length_mm"]
camera.clip_start, camera.clip_end = 0.01, 1000
item = bpy.data.objects.new("camera", camera)
target.collection.objects.link(item)
target.camera = item
eye, z = Vector(view["position_m"]), -Vector(view["boresight"]).normalized()
x = Vector(view["up"]).cross(z).normalized()
y = z.cross(x)
item.matrix_world = Matrix(((x.x, y.x, z.x, eye.x), (x.y, y.y, z.y, eye.y), (x.z, y.z, z.z, eye.z), (0, 0, 0, 1)))

render = target.render
render.engine = "CYCLES"
cycles = target.cycles
cycles.device = "CPU"
cycles.samples = samples
cycles.seed = int(seed)
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
render.filepath = out
start = time.time()
bpy.ops.render.render(write_still=True)
print("RESULT", time.time() - start, flush=True)
