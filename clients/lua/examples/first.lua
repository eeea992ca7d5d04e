-- SPDX-License-Identifier: Apache-2.0
-- The first example of docs/clients.md: a ball comes nearer. Run:
-- LUA_PATH="clients/lua/?.lua;clients/lua/?/init.lua;;" lua5.4 first.lua
local obscura = require "obscura"
local camera <close> = obscura.start()
camera:set("camera", { width = 640, height = 480, focal_length_mm = 25, boresight = { 0, 0, 1 }, up = { 0, -1, 0 } })
camera:set("sun", { direction = { -1, -1, -2 } })
camera:add("body", { name = "ball", shape = "ellipsoid", radii_m = { 1, 1, 1 }, albedo = 0.3 })
for step = 0, 9 do
  camera:set("body", "ball", { position_m = { 0, 0, 40 - step } })
  local picture = camera:render { samples = 16, layers = { "depth_m", "normal.x", "normal.y", "normal.z" } }
  print(picture, picture.depth_m:at(241, 321))
end
io.open("ball.toml", "w"):write(camera:export()) -- obscura render ball.toml: the same bytes
