-- SPDX-License-Identifier: Apache-2.0
-- What calls of the rendering server cost its Lua client, beside bare sockets; run by clients_bench.py.
-- Usage: lua5.4 client_bench.lua SERVER ECHO-SERVER REPEATS
local socket = require "socket"
local obscura = require "obscura"

local repeats = math.tointeger(arg[3])
local few = math.max(repeats // 20, 10)

local function show(what, count, work)
  local spent = {}
  for i = 1, count do
    local begin = socket.gettime()
    work(i)
    spent[i] = 1e6 * (socket.gettime() - begin)
  end
  table.sort(spent)
  print(("    %-26s p50 %9.0f us, p99 %9.0f us"):format(what, spent[count // 2 + 1], spent[count * 99 // 100]))
end

local function connect(address)
  if address:find "/" then
    local sock = require("socket.unix").stream()
    assert(sock:connect(address))
    return sock
  end
  local host, port = address:match "^(.+):(%d+)$"
  local sock = assert(socket.connect(host, port))
  sock:setoption("tcp-nodelay", true)
  return sock
end

local sock = connect(arg[2])
local function ask(first, bytes)
  assert(sock:send(string.char(first) .. ("\0"):rep(63)))
  assert(sock:receive(bytes))
end

show("bare sockets, 64 bytes", repeats, function() ask(0, 64) end)
show("bare sockets, 4 MiB", few, function() ask(1, 4 << 20) end)
sock:close()

local camera <close> = obscura.connect(arg[1])
show("status", repeats, function() camera:status() end)
show("set of a key of the Sun", repeats, function(i) camera:set("sun", { limb_darkening = i / repeats }) end)
camera:load { scene = {} }
show("empty picture, 4 MiB", few, function() camera:render { width = 1024, height = 1024, samples = 1 } end)
