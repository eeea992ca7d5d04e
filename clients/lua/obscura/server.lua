-- SPDX-License-Identifier: Apache-2.0
-- A server of this program's own.

local socket = require "socket"
local Client = require "obscura.client"
local errors = require "obscura.errors"

local function quoted(text)
  return "'" .. text:gsub("'", "'\\''") .. "'"
end

local function contents(file)
  local input = io.open(file, "rb")
  if not input then return "" end
  local text = input:read "a"
  input:close()
  return text
end

--- The program of the environment variable OBSCURA, else that of the source tree which this file stands in, else that of PATH.
local function find_program()
  local named = os.getenv "OBSCURA"
  if named and named ~= "" then return named end
  local folder = debug.getinfo(1, "S").source:match "^@(.*)/clients/lua/obscura/server.lua$"
  local built = folder and folder .. "/build/release/tools/obscura"
  local file = built and io.open(built, "rb")
  if file then
    file:close()
    return built
  end
  return "obscura"
end

local function private_folder()
  local output = io.popen("mktemp -d -t obscura-XXXXXXXX", "r")
  local folder = output and output:read "l"
  if output then output:close() end
  return folder or error(errors.lost "no temporary folder", 0)
end

--- Starts `obscura serve` and returns its client; the server ends with the client, or with this program. `scene`: a shipped
--- scene, or a file below `root`, to begin with. Options: root (folder below which scenes may name files), threads (0: one
--- per core), program, timeout_s.
---@param scene? string
---@param options? {root: string?, threads: integer?, program: string?, timeout_s: number?}
---@return obscura.Client
return function(scene, options)
  options = options or {}
  local timeout_s = options.timeout_s or 600
  local folder = private_folder()
  local files = { socket = folder .. "/socket", output = folder .. "/output", complaints = folder .. "/complaints",
    ended = folder .. "/ended" }
  local command = ("%s serve --listen none --unix %s --root %s --threads %d --clients 1 --with-input >%s 2>%s; echo $? >%s")
    :format(quoted(options.program or find_program()), quoted(files.socket), quoted(options.root or "."), options.threads or 0,
      quoted(files.output), quoted(files.complaints), quoted(files.ended))
  local input = io.popen(command, "w") -- its end ends the server
  local running = true

  --- Ends the server; returns what it complained of.
  local function stop()
    if not running then return "" end
    running = false
    if io.type(input) == "file" then input:close() end
    local complaints = contents(files.complaints):gsub("%s+$", "")
    for _, file in pairs(files) do os.remove(file) end
    os.remove(folder)
    return complaints
  end

  local ends = socket.gettime() + timeout_s
  while contents(files.output):sub(1, 13) ~= "listening at " do
    if contents(files.ended) ~= "" or socket.gettime() > ends then
      local why = stop()
      error(errors.lost(why ~= "" and why or "obscura: ended at its start"), 0)
    end
    socket.sleep(0.002)
  end
  local good, client = pcall(Client.new, files.socket, { timeout_s = timeout_s })
  if not good then
    stop()
    error(client, 0)
  end
  client.on_close = stop
  if scene then
    local loaded, why = pcall(client.load, client, scene)
    if not loaded then
      client:close()
      error(why, 0)
    end
  end
  return client
end
