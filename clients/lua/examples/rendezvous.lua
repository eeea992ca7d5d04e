-- SPDX-License-Identifier: Apache-2.0
-- A chaser approaches a target and its arm unfolds: 100 frames with depth maps, a light spot on the target.
--
-- The arm is a tree: each link hangs on the one before by a hinge, so that a frame only sets angles. Prints one line a frame
-- and writes the last picture; the same pictures as clients/python/examples/rendezvous.py.
--
-- Run: LUA_PATH="clients/lua/?.lua;clients/lua/?/init.lua;;" lua5.4 rendezvous.lua [FRAMES [FOLDER]]
local obscura = require "obscura"

local frames = tonumber(arg[1] or 100)
local folder = arg[2] or "."

--- A boom of 2 m, hinged at its parent's end.
local function link(name, parent)
  return {
    name = name, shape = "cone", bottom_radius_m = 0.08, top_radius_m = 0.08, height_m = 2.0, albedo = 0.6, parent = parent,
    position_m = { 0, 0, 2 }, joint = "hinge", joint_axis = { 0, 1, 0 }, joint_angle_deg = 0.0,
  }
end

local scene = {
  sun = { direction = { -0.6, -0.5, -1.0 } },
  camera = { width = 256, height = 256, focal_length_mm = 25, pixel_pitch_um = 20, aperture_mm = 10, look_at = "target" },
  lamp = { { name = "spot", beam = "gaussian", half_angle_deg = 2.0, intensity_w_sr = { 5e5 }, look_at = "target" } },
  body = {
    { name = "target", shape = "box", size_m = { 3.0, 3.0, 4.0 }, albedo = 0.3, spin_axis = { 0, 0, 1 }, spin_rate_deg_per_s = 0.5 },
    link("upper arm", "target"),
    link("forearm", "upper arm"),
  },
}

local function nearest(depths)
  local least = math.huge
  for _, row in depths:rows() do
    for _, depth in ipairs(row) do
      if depth < least then least = depth end -- NaN is not
    end
  end
  return least
end

local function sum(values)
  local all = 0
  for _, row in values:rows() do
    for _, value in ipairs(row) do all = all + value end
  end
  return all
end

local digest = assert(io.popen(("sha256sum >'%s/rendezvous.sha256'"):format(folder), "w"))
local camera <close> = obscura.start()
camera:load { scene = scene }
for frame = 0, frames - 1 do
  local along = frame / math.max(frames - 1, 1)
  local far = 1 - 0.6 * along
  camera:set("camera", { position_m = { 6.0 * far, -3.0 * far, -60.0 * far } })
  camera:set("lamp", "spot", { position_m = { 6.0 * far + 0.5, -3.0 * far, -60.0 * far } })
  camera:set("body", "upper arm", { joint_angle_deg = 70 * along })
  camera:set("body", "forearm", { joint_angle_deg = 40 * along })
  local picture = camera:render { time_s = frame, frame = frame + 1, samples = 4, layers = { "depth_m" }, truth = true }
  digest:write(picture.values.data)
  print(("frame %3d: nearest surface %7.3f m, light %.4e W/m2"):format(frame + 1, nearest(picture.depth_m), sum(picture.values)))
  if frame + 1 == frames then picture:save(folder .. "/rendezvous.png") end
end
io.open(folder .. "/rendezvous.toml", "w"):write(camera:export())
digest:close()
print("sha256 of all pictures: " .. io.open(folder .. "/rendezvous.sha256"):read(64))
