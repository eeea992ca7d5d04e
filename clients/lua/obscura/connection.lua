-- SPDX-License-Identifier: Apache-2.0
-- Native protocol: messages of a frame of 24 bytes, a MessagePack head and raw arrays.

local socket = require "socket"
local errors = require "obscura.errors"
local messagepack = require "obscura.messagepack"
local Array = require "obscura.array"

local FRAME, FRAME_BYTES = "<c4BBI2I4I4I8", 24
local REQUEST, ANSWER, EVENT, ERROR = 1, 2, 3, 4
local MOST_HEAD_BYTES = 64 << 20

--- One connection, requests one after the other.
local Connection = {}
Connection.__index = Connection

local function connect(address, timeout_s)
  local path = address:find("/", 1, true)
  local sock, why
  if path then
    sock = require("socket.unix").stream()
  else
    sock = socket.tcp()
  end
  sock:settimeout(timeout_s)
  local done
  if path then
    done, why = sock:connect(address)
  else
    local host, port = address:match("^(.+):(%d+)$")
    if not host then return nil, "neither HOST:PORT nor the path of a socket" end
    done, why = sock:connect(host, port)
  end
  if not done then
    sock:close()
    return nil, why
  end
  if not path then sock:setoption("tcp-nodelay", true) end
  return sock
end

--- Connects. `address`: "HOST:PORT", or the path of a Unix socket, which has a "/".
function Connection.open(address, timeout_s)
  local sock, why = connect(address, timeout_s)
  if not sock then error(errors.lost(("%s: %s (is `obscura serve` running there?)"):format(address, why)), 0) end
  return setmetatable({ address = address, socket = sock, next = 1 }, Connection)
end

function Connection:close()
  if self.socket then self.socket:close() end
  self.socket = nil
end

--- Ends the connection for good.
function Connection:lose(why)
  self:close()
  error(errors.lost(self.address .. ": " .. why), 0)
end

--- Sends a request; returns its number.
function Connection:send(call, fields)
  if not self.socket then self:lose "the connection is closed" end
  local members = messagepack.map { call = call }
  for name, value in pairs(fields) do members[name] = value end
  local packed, head = pcall(messagepack.pack, members)
  if not packed then error(errors.refused { code = "bad-argument", message = call .. ": " .. head }, 0) end
  local number = self.next
  self.next = number % 0xFFFFFFFF + 1
  local _, why = self.socket:send(string.pack(FRAME, "OBSC", 1, REQUEST, 0, number, #head, 0) .. head)
  -- If the server has ended the connection there may be an error message to be read.
  if why and why ~= "closed" then self:lose(why) end
  return number
end

function Connection:read(count)
  if count == 0 then return "" end
  local data, why = self.socket:receive(count)
  if data then return data end
  self:lose(why == "timeout" and "no answer in time" or why == "closed" and "the server has ended the connection" or why)
end

function Connection:read_message()
  local magic, version, kind, _, of, head_bytes, body_bytes = string.unpack(FRAME, self:read(FRAME_BYTES))
  if magic ~= "OBSC" or version ~= 1 then self:lose "the server does not speak this protocol" end
  if head_bytes > MOST_HEAD_BYTES or body_bytes < 0 or body_bytes >= 1 << 40 then self:lose "a message that is too large" end
  local text = self:read(head_bytes)
  local good, head = pcall(messagepack.unpack, text)
  if not good then self:lose(head) end
  if not messagepack.is_map(text) then self:lose "a head that is no map" end
  return kind, of, head, self:read(body_bytes)
end

--- Head and arrays of the answer to a request. What `progress` throws cancels the request and reaches the caller.
function Connection:receive(number, progress)
  while true do
    local kind, of, head, body = self:read_message()
    if kind == ERROR and (of == 0 or of == number) then
      if of == 0 then self:close() end -- of the connection as a whole
      error(errors.refused(head), 0)
    elseif kind == EVENT and of == number and progress and head.event == "progress" then
      local good, thrown = pcall(progress, head.done, head.total, head.left_s)
      if not good then
        self:send("cancel", { request = number })
        pcall(self.receive, self, number)
        error(thrown, 0)
      end
    elseif kind == ANSWER and of == number then
      local good, arrays, order = pcall(Array.all, head.arrays or {}, body)
      if not good then self:lose("a message that is no answer: " .. tostring(arrays)) end
      head.arrays = nil
      return head, arrays, order
    end
  end
end

--- Head of the answer, its arrays by name, and their names in order. Throws a table of obscura.errors.
function Connection:request(call, fields, progress)
  return self:receive(self:send(call, fields), progress)
end

return Connection
