-- SPDX-License-Identifier: Apache-2.0
-- The scenario of scenario_test.py in Lua. Usage: lua5.4 scenario.lua ADDRESS
local obscura = require "obscura"

local function show_digest(name, data)
  io.stdout:write(name, " ")
  io.stdout:flush()
  local digest = assert(io.popen("sha256sum | cut -d' ' -f1", "w"))
  digest:write(data)
  digest:close()
end

local function count(array, wanted)
  local found = 0
  for _, row in array:rows() do
    for _, value in ipairs(row) do
      if wanted(value) then found = found + 1 end
    end
  end
  return found
end

local function show(picture)
  show_digest("values", picture.values.data)
  show_digest("depth", picture.depth_m.data)
  print("lit " .. count(picture.values, function(value) return value > 0 end))
  print("seen " .. count(picture.depth_m, function(value) return value == value end))
end

local camera <close> = obscura.connect(arg[1])
camera:load { scene = {} }
camera:set("camera", { width = 160, height = 120, focal_length_mm = 10.0, pixel_pitch_um = 20.0, boresight = { 0, 0, 1 },
  up = { 0, -1, 0 }, psf_sigma_px = 1.5 })
camera:set("sun", { direction = { -1.0, -0.5, -2.0 } })
camera:add("body", { name = "ball", shape = "ellipsoid", radii_m = { 1.0, 1.0, 1.0 }, albedo = 0.3, position_m = { 0.25, -0.125, 12.5 } })
show(camera:render { time_s = 0.0, samples = 16, seed = 7, frame = 3, layers = { "depth_m" } })
local done, refused = pcall(camera.set, camera, "body", "ball", { albedo = 2.5 })
if not done then print("refused " .. refused.code .. " " .. refused.field .. " " .. refused.allowed) end
camera:set("body", "ball", { position_m = { 0.1, 0.2, 10.0 } })
camera:set("camera", { psf_sigma_px = obscura.null })
show(camera:render { time_s = 1.5, samples = 16, seed = 7, frame = 4, layers = { "depth_m" } })
local exposed = camera:render { exposure_s = 0.02, sensor = { file = "generic", readout = { width = 96, height = 64 } }, samples = 2,
  seed = 7, frame = 5, run = 3 }
show_digest("dn", exposed.values.data)
local sum = 0
for _, row in exposed.values:rows() do
  for _, number in ipairs(row) do sum = sum + number end
end
print("sum " .. sum)
show_digest("export", camera:export())
