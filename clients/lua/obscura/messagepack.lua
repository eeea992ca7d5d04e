-- SPDX-License-Identifier: Apache-2.0
-- MessagePack of message heads: nil, booleans, integers, floats, strings, lists, and maps with string keys.

local messagepack = {}

local DEEPEST = 16
local EMPTY_MAP = { __name = "obscura.map" }
local pack, unpack = string.pack, string.unpack

--- Stands for nil where a table cannot hold it: the value of a key that is to be removed, a nil in a list.
messagepack.null = setmetatable({}, { __name = "obscura.null", __tostring = function() return "null" end })

--- Marks a table as a map: an empty one is a list otherwise.
---@param members table
function messagepack.map(members)
  return setmetatable(members, EMPTY_MAP)
end

--- Head of a string, list or map; codes: of 8 bits (or nil), 16 and 32.
local function size(count, fix, fix_most, code8, code16, code32)
  if count <= fix_most then return pack("B", fix | count) end
  if code8 and count <= 0xFF then return pack("BB", code8, count) end
  if count <= 0xFFFF then return pack(">BI2", code16, count) end
  return pack(">BI4", code32, count)
end

local put

local function put_table(value, out, depth)
  local count = 0
  for _ in pairs(value) do count = count + 1 end
  if getmetatable(value) ~= EMPTY_MAP and count == #value then
    out[#out + 1] = size(count, 0x90, 15, nil, 0xDC, 0xDD)
    for _, item in ipairs(value) do put(item, out, depth + 1) end
    return
  end
  out[#out + 1] = size(count, 0x80, 15, nil, 0xDE, 0xDF)
  for key, item in pairs(value) do
    if type(key) ~= "string" then
      error(("a table with the key %s, neither a list without gaps nor a map of strings"):format(key), 0)
    end
    put(key, out, depth + 1)
    put(item, out, depth + 1)
  end
end

function put(value, out, depth)
  if depth > DEEPEST then error(("more than %d levels"):format(DEEPEST), 0) end
  local kind = math.type(value) or type(value)
  if value == nil or value == messagepack.null then
    out[#out + 1] = "\xC0"
  elseif kind == "boolean" then
    out[#out + 1] = value and "\xC3" or "\xC2"
  elseif kind == "integer" then
    out[#out + 1] = value >= 0 and value < 128 and string.char(value) or pack(">Bi8", 0xD3, value)
  elseif kind == "float" then
    out[#out + 1] = pack(">Bd", 0xCB, value)
  elseif kind == "string" then
    out[#out + 1] = size(#value, 0xA0, 31, 0xD9, 0xDA, 0xDB)
    out[#out + 1] = value
  elseif kind == "table" then
    put_table(value, out, depth)
  else
    error(("a %s cannot be sent"):format(kind), 0)
  end
end

--- The value as MessagePack. Throws a string for what cannot be sent.
---@return string
function messagepack.pack(value)
  local out = {}
  put(value, out, 0)
  return table.concat(out)
end

local function wrong(what)
  error("not MessagePack: " .. what, 0)
end

-- Numbers by their first byte: format and bytes.
local NUMBERS = {
  [0xCA] = { ">f", 4 }, [0xCB] = { ">d", 8 }, [0xCC] = { "B", 1 }, [0xCD] = { ">I2", 2 }, [0xCE] = { ">I4", 4 },
  [0xCF] = { ">i8", 8 }, [0xD0] = { "b", 1 }, [0xD1] = { ">i2", 2 }, [0xD2] = { ">i4", 4 }, [0xD3] = { ">i8", 8 },
}
-- Strings, lists and maps: kind, format and bytes of the count.
local SIZED = {
  [0xD9] = { "string", "B", 1 }, [0xDA] = { "string", ">I2", 2 }, [0xDB] = { "string", ">I4", 4 },
  [0xDC] = { "list", ">I2", 2 }, [0xDD] = { "list", ">I4", 4 }, [0xDE] = { "map", ">I2", 2 }, [0xDF] = { "map", ">I4", 4 },
}

local function number(data, at, row)
  if #data - at + 1 < row[#row] then wrong("a number ends early") end
  return (unpack(row[#row - 1], data, at)), at + row[#row]
end

local take

local function take_sized(data, at, kind, count, depth)
  local least = kind == "map" and 2 or 1 -- bytes of an element
  if count * least > #data - at + 1 then wrong(("a %s ends early"):format(kind)) end
  local value = {}
  if kind == "string" then
    value = data:sub(at, at + count - 1)
    if not utf8.len(value) then wrong("text that is no UTF-8") end
    return value, at + count
  end
  for index = 1, count do
    local item
    item, at = take(data, at, depth + 1)
    if kind == "list" then
      value[index] = item == nil and messagepack.null or item
    else
      if type(item) ~= "string" then wrong("a key that is no string") end
      value[item], at = take(data, at, depth + 1)
    end
  end
  return value, at
end

function take(data, at, depth)
  if depth > DEEPEST then wrong(("more than %d levels"):format(DEEPEST)) end
  local code = data:byte(at)
  if not code then wrong("it ends early") end
  at = at + 1
  if code < 0x80 then return code, at end
  if code >= 0xE0 then return code - 256, at end
  if code < 0x90 then return take_sized(data, at, "map", code & 15, depth) end
  if code < 0xA0 then return take_sized(data, at, "list", code & 15, depth) end
  if code < 0xC0 then return take_sized(data, at, "string", code & 31, depth) end
  if code == 0xC0 then return nil, at end
  if code == 0xC2 or code == 0xC3 then return code == 0xC3, at end
  if NUMBERS[code] then
    local value, after = number(data, at, NUMBERS[code])
    if code == 0xCF and value < 0 then wrong("an integer beyond 64 bits with sign") end
    return value, after
  end
  local row = SIZED[code]
  if not row then wrong(("code 0x%02x"):format(code)) end
  local count
  count, at = number(data, at, row)
  return take_sized(data, at, row[1], count, depth)
end

--- Whether the value that `data` holds is a map; Lua's tables do not tell.
---@param data string
function messagepack.is_map(data)
  local code = data:byte()
  return code & 0xF0 == 0x80 or code == 0xDE or code == 0xDF
end

--- The one value that `data` holds; a nil in a list is `null`. Throws a string if it is not whole, goes on behind it, or is
--- too deep.
---@param data string
function messagepack.unpack(data)
  local value, at = take(data, 1, 0)
  if at ~= #data + 1 then wrong("bytes behind its end") end
  return value
end

return messagepack
