-- SPDX-License-Identifier: Apache-2.0
-- Client of a rendering server: one scene, which only this client sees.

local Connection = require "obscura.connection"
local Picture = require "obscura.picture"
local calls = require "obscura.calls"
local errors = require "obscura.errors"
local messagepack = require "obscura.messagepack"
local sha256 = require "obscura.sha256"

local VERSION = "0.2.0"

--- A connection and its scene. Names and units of keys are those of scene files. Close it with close(), or declare it
--- `local camera <close>`. All methods throw tables with `code`, `message`, `field`, `allowed` and `hint`. `calls` has each
--- call of the server by its name: camera.calls:scene_load { file = "demo" }.
---@class obscura.Client
local Client = {}
Client.__index = Client

--- Fields as they are sent: Lua's tables and numbers made those that the call wants.
local function typed(call, fields)
  local kinds, sent = calls.kinds[call] or {}, {}
  for name, value in pairs(fields or {}) do
    if type(value) == "table" and next(value) == nil and kinds[name] == "map" then
      value = messagepack.map {}
    elseif kinds[name] == "integer" then
      value = math.tointeger(value) or value
    end
    sent[name] = value
  end
  return sent
end

--- The 32 bytes of a token's file. Throws a table of obscura.errors.
local function token_of(file)
  local input <close> = io.open(file, "rb")
  local secret = input and input:read "a"
  if secret and #secret == 32 then return secret end
  error(errors.refused { code = "bad-argument", message = file .. (input and ": no token of 32 bytes" or ": cannot be read") }, 0)
end

local function greet(asked, token)
  local fields = { protocol_min = 1, protocol_max = 1, client = "obscura " .. VERSION .. " (Lua)" }
  if token then
    local challenge = asked:challenge().challenge:gsub("%x%x", function(digits) return string.char(tonumber(digits, 16)) end)
    fields.proof = sha256.hex(sha256.hmac(token_of(token), challenge))
  end
  return asked:hello(fields)
end

--- Options: timeout_s, and token, a file.
function Client.new(address, options)
  local self = setmetatable({ connection = Connection.open(address, options.timeout_s or 600) }, Client)
  self.calls = setmetatable({
    request = function(_, name, fields) return self.connection:request(name, typed(name, fields)) end,
  }, { __index = calls })
  local good, answer = pcall(greet, self.calls, options.token)
  if not good then
    self.connection:close()
    error(answer, 0)
  end
  self.server = answer -- what the server said of itself: version, permission, limits
  return self
end

--- Ends the connection, and a server of the program's own; the scene is gone.
function Client:close()
  self.connection:close()
  local on_close = self.on_close
  self.on_close = nil
  if on_close then on_close() end
end

Client.__close = Client.close
Client.__gc = Client.close

function Client:__tostring()
  return ("obscura.Client at %s, server %s"):format(self.connection.socket and self.connection.address or "(closed)",
    self.server.version)
end

--- Any call of the server by its name: head of the answer, and its arrays.
function Client:call(name, fields)
  return self.calls:request(name, fields)
end

-- Scene

--- Replaces the scene by a shipped one or a file below the server's folder ("demo"), or by { toml = text } or
--- { scene = tables }. Returns the names of the bodies.
---@param what string|table
function Client:load(what)
  return self.calls:scene_load(type(what) == "string" and { file = what } or what).bodies
end

--- The scene as a scene file; `obscura render` makes the same picture of it.
function Client:export()
  return self.calls:scene_export().toml
end

--- Keys that a table gives ("camera", "sun", "stars", "scene"), or an element of "body", "lamp", ...
---@param item? string|integer name, or number from 0
function Client:get(section, item)
  return self.calls:scene_get({ section = section, item = item }).keys
end

--- Changes keys of a table, set("camera", {...}), or of an element, set("body", "ball", {...}), all of them or none;
--- obscura.null removes a key.
function Client:set(section, item, keys)
  if keys == nil then item, keys = nil, item end
  self.calls:scene_set { section = section, item = item, keys = keys }
end

--- Adds a body, a lamp, ...
function Client:add(section, keys)
  self.calls:scene_add { section = section, keys = keys }
end

--- Removes a table or an element.
---@param item? string|integer name, or number from 0
function Client:remove(section, item)
  self.calls:scene_remove { section = section, item = item }
end

-- Pictures

--- Renders the scene: render { time_s = 2, samples = 16, layers = { "depth_m" } }. What is left out has the server's default.
--- `progress(done_rows, rows, seconds_left)` is called up to five times a second; what it throws cancels.
---@param options? obscura.Render
---@param progress? fun(done: integer, total: integer, left_s: number?)
---@return obscura.Picture
function Client:render(options, progress)
  return Picture.new(self.connection:request("render", typed("render", options), progress))
end

-- Server

--- The table of calls (`calls`) and the tables and keys of scenes (`sections`).
function Client:describe()
  return (self.calls:describe())
end

--- What the server does for this connection.
function Client:status()
  return (self.calls:status())
end

return Client
