-- SPDX-License-Identifier: Apache-2.0
-- The Lua client beside a server, run by clients_test.py. Usage: lua5.4 client_test.lua ADDRESS FOLDER LOCKED-ADDRESS CAMERA-ADDRESS BROKEN-ADDRESS...
-- The server at LOCKED-ADDRESS wants FOLDER/token; at CAMERA-ADDRESS is a daemon. Prints one line a check; exit status 1 if one failed.
local obscura = require "obscura"
local messagepack = require "obscura.messagepack"

local address, folder = arg[1], arg[2]
local failed = 0

local function check(what, good, detail)
  print((good and "ok - " or "NOT OK - ") .. what .. (good and "" or ": " .. tostring(detail)))
  if not good then failed = failed + 1 end
end

--- `call` throws an error with that code and text. Returns it.
local function check_refused(what, code, message, call, ...)
  local done, thrown = pcall(call, ...)
  check(what, not done and type(thrown) == "table" and thrown.code == code and thrown.message:find(message, 1, true), thrown)
  return type(thrown) == "table" and thrown or {}
end

local function check_near(what, got, wanted, limit)
  check(what, math.abs(got - wanted) <= limit, ("%.9g, wanted %.9g"):format(got, wanted))
end

-- MessagePack
local function same(a, b)
  if type(a) ~= "table" or type(b) ~= "table" or a == messagepack.null then return a == b and math.type(a) == math.type(b) end
  for key, value in pairs(a) do
    if not same(value, b[key]) then return false end
  end
  for key in pairs(b) do
    if a[key] == nil then return false end
  end
  return true
end

local long = {}
for number = 1, 300 do long[number] = number end
local values = { true, false, 0, 127, 128, -1, -32, -33, math.maxinteger, math.mininteger, 0.1, 4.0, math.huge, "", ("ü"):rep(40),
  ("x"):rep(70000), {}, long, { a = { b = { 1, { c = "d" } } } }, messagepack.null }
check("values come back", same(messagepack.unpack(messagepack.pack(values)), values))
check("an empty map is one", messagepack.pack(messagepack.map {}) == "\x80" and messagepack.pack {} == "\x90")
local packed = messagepack.pack { name = ("x"):rep(40), list = { 1, 2.5, { a = 1 } }, n = 1 << 40 }
local refused = 0
for cut = 0, #packed - 1 do refused = refused + (pcall(messagepack.unpack, packed:sub(1, cut)) and 0 or 1) end
check("heads that are cut are refused", refused == #packed, refused)
for _, bad in ipairs { packed .. "\xC0", "\xDD\xFF\xFF\xFF\xFF", "\xDB\xFF\xFF\xFF\xFF", "\xDF\xFF\xFF\xFF\xFF", ("\x91"):rep(100000),
  "\xC1", "\x81\x01\x02", "\xA1\xFF", "\xCF" .. ("\xFF"):rep(8) } do
  check(("a head of %d bytes that begins with %d is refused"):format(#bad, bad:byte()), not pcall(messagepack.unpack, bad))
end
math.randomseed(1)
local strange = 0
for _ = 1, 20000 do
  local bytes = {}
  for at = 1, math.random(1, 24) do bytes[at] = string.char(math.random(0, 255)) end
  local read, why = pcall(messagepack.unpack, table.concat(bytes))
  if not read and why:sub(1, 15) ~= "not MessagePack" then strange = strange + 1 end
end
check("random heads are read or refused", strange == 0, strange)
check("functions cannot be sent", not pcall(messagepack.pack, { print }))
check("lists with gaps cannot be sent", not pcall(messagepack.pack, { 1, nil, 3 }))
local cycle = {}
cycle[1] = cycle
check("tables without end cannot be sent", not pcall(messagepack.pack, cycle))

-- Scene and pictures: a ball and a lamp at the place of the camera, which looks along z.
local camera = obscura.connect(address, { timeout_s = 120 })
check("the server says what it is", camera.server.server == "obscura" and camera.server.limits.clients >= 1)
local bodies = camera:load { scene = {
  quantity = "radiance", sun = { irradiance_scale = 0.0 },
  camera = { psf_sigma_px = 0.0, boresight = { 0, 0, 1 }, up = { 0, -1, 0 }, width = 65, height = 49, pixel_pitch_um = 2.0, focal_length_mm = 10 },
  lamp = { { name = "lamp", intensity_w_sr = { 100.0 }, boresight = { 0, 0, 1 }, up = { 0, -1, 0 } } },
  body = { { name = "ball", shape = "ellipsoid", radii_m = { 1, 1, 1 }, albedo = 0.8, position_m = { 0, 0, 10 } } },
} }
check("a scene of a table is loaded", same(bodies, { "ball" }))
local picture = camera:render { samples = 16.0, layers = { "depth_m", "normal.z" }, truth = true }
check_near("radiance at the centre of the ball", picture.values:at(25, 33), 0.8 / math.pi * 100 / 81, 1e-3)
check_near("its depth", picture.depth_m:at(25, 33), 9, 1e-5)
check_near("its normal", picture.layers["normal.z"]:at(25, 33), -1, 1e-6)
check("a picture tells what it is", tostring(picture):find("65 x 49 px, 1 bands, radiance up to 0.31", 1, true), picture)
check("the truth has the ball", picture.truth.bodies[1].name == "ball")
check("rows are those of the pixels", picture.values:row(25)[33] == picture.values:at(25, 33) and #picture.values:row(1) == 65)
check("pixels outside are refused", not pcall(picture.values.at, picture.values, 50, 1) and not pcall(picture.values.row, picture.values, 0))
picture:save(folder .. "/lua.png")
picture:save(folder .. "/lua-depth.png", "depth_m")
check("keys are read", camera:get("body", "ball").albedo == 0.8 and camera:get("body")[1].name == "ball" and camera:get("camera").width == 65)

local before = camera:export()
local wrong = check_refused("a value out of range", "bad-scene", "out of range", camera.set, camera, "body", "ball", { albedo = 2.5, position_m = { 1, 1, 1 } })
check("its field and what is allowed", wrong.field == "body[0].albedo" and wrong.allowed == "0 to 1", wrong.field)
check_refused("a misspelt key", "bad-scene", 'did you mean "width"?', camera.set, camera, "camera", { widht = 3 })
check_refused("a misspelt field", "bad-argument", 'did you mean "samples"?', camera.render, camera, { sample = 4 })
check_refused("what cannot be sent", "bad-argument", "a function cannot be sent", camera.set, camera, "camera", { width = print })
check("nothing was changed", camera:export() == before)
camera:add("body", { name = "moon", shape = "ellipsoid", radii_m = { 1, 1, 1 }, albedo = 0.1, position_m = { 5, 0, 10 }, spin_rate_deg_per_s = 1 })
camera:set("body", "moon", { spin_rate_deg_per_s = obscura.null })
check("a key is removed", camera:get("body", "moon").spin_rate_deg_per_s == nil and camera:get("body", 1).name == "moon")
camera:remove("body", "moon")
check("a scene comes back from its text", camera:export() == before and camera:load { toml = before }[1] == "ball" and
  camera:export() == before)
check("an empty table is an empty scene", #camera:load { scene = {} } == 0)
check("typed calls answer", camera.calls:scene_load { file = "demo" }.width > 0 and #camera:describe().calls > 5 and camera:status().waiting == 0)

-- Digital numbers of a sensor
local exposed = camera:render { exposure_s = 0.02, sensor = { file = "generic", readout = { width = 96, height = 64 } } }
check("a sensor gives digital numbers", exposed.quantity == "dn" and exposed.detector.bits == 12 and #exposed.values.data == 2 * 96 * 64)
local least, most = math.huge, 0
for _, row in exposed.values:rows() do
  least, most = math.min(least, table.unpack(row)), math.max(most, table.unpack(row))
end
check("which are those of its bits", math.type(most) == "integer" and 0 < least and least < most and most < 4096, most)
check("and can be looked at", #exposed:preview() == 64 and tostring(exposed):find("dn up to", 1, true), exposed)

-- Tokens
check_refused("a server that wants a token", "forbidden", "token", obscura.connect, arg[3])
check_refused("a token that is none", "bad-argument", "32 bytes", obscura.connect, arg[3], { token = folder .. "/lua.png" })
check_refused("a token that is missing", "bad-argument", "cannot be read", obscura.connect, arg[3], { token = folder .. "/none" })
check_refused("a wrong token", "forbidden", "", obscura.connect, arg[3], { token = folder .. "/wrong" })
do
  local known <close> = obscura.connect(arg[3], { token = folder .. "/token" })
  check("the token permits", known.server.permission == "scene" and known:status().waiting == 0, known.server.permission)
end

-- A running camera
do
  local live <close> = obscura.connect(arg[4], { timeout_s = 120 })
  check("settings of a camera are changed", live.calls:camera_set({ values = { ExposureTime = 5000 } }).changed.ExposureTime == 5000 and
    live.calls:camera_get({ names = { "ExposureTime" } }).values.ExposureTime == 5000)
  local head, arrays = live.calls:frame {}
  local _, pixels = next(arrays)
  check("its frames are digital numbers", pixels.dtype == "<u2" and math.type(pixels:at(1, 1)) == "integer" and head.bits >= 8, head.bits)
  check_refused("an unknown setting", "bad-argument", "", live.calls.camera_set, live.calls, { values = { Exposure = 1 } })
end

-- Progress, cancelling
local told
check("progress is told, and what it throws cancels", select(2, pcall(camera.render, camera,
  { width = 2048, height = 2048, samples = 65536 }, function(done, total)
    told = { done, total }
    error({ "enough" }, 0)
  end))[1] == "enough" and told[2] == 2048)
check("the connection lives on", camera:status().waiting == 0)
camera:close()
check_refused("a closed client says so", "connection-lost", "closed", camera.status, camera)

-- Servers of its own
do
  local own <close> = obscura.start("demo", { threads = 1, root = folder })
  local small = own:render { width = 32, height = 32, samples = 1 }
  check("a server of the program's own renders", #small.values.data == 4 * 32 * 32)
end
check_refused("a program that is missing", "connection-lost", "not found", obscura.start, nil, { program = folder .. "/it's none" })
check_refused("a scene that is missing", "bad-scene", "nosuch", obscura.start, "nosuch")

-- Servers that are none
for index = 5, #arg do
  local broken, expected = arg[index]:match "^(.*)=(.*)$"
  check_refused("a broken server: " .. expected, "connection-lost", expected, obscura.connect, broken, { timeout_s = 0.3 })
end
check_refused("no server", "connection-lost", "is `obscura serve` running there?", obscura.connect, "nonsense")
check_refused("no server at a socket", "connection-lost", "is `obscura serve` running there?", obscura.connect, folder .. "/none")

print(("%d checks failed"):format(failed))
os.exit(failed == 0, true)
