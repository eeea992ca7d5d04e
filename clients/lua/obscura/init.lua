-- SPDX-License-Identifier: Apache-2.0
-- Lua client of the Obscura rendering server; needs Lua 5.4 and LuaSocket.
--
--   local obscura = require "obscura"
--   local camera <close> = obscura.start "demo"    -- a server of this program's own, with a shipped scene
--   camera:render():save "demo.png"

local Client = require "obscura.client"
local messagepack = require "obscura.messagepack"

local obscura = {
  start = require "obscura.server",
  --- Stands for nil in tables: the value of a key that is to be removed.
  null = messagepack.null,
  --- Marks an empty table as a map; it is a list otherwise.
  map = messagepack.map,
}

--- Client of a server that runs: "HOST:PORT", or the path of its Unix socket. Options: timeout_s (longest wait for news from it),
--- token (file of the token that it wants).
---@param address? string
---@param options? {timeout_s: number?, token: string?}
---@return obscura.Client
function obscura.connect(address, options)
  return Client.new(address or "127.0.0.1:5152", options or {})
end

return obscura
