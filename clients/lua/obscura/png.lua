-- SPDX-License-Identifier: Apache-2.0
-- Writer of 8-bit grey PNG pictures, not compressed.

local crcs = {}
for byte = 0, 255 do
  local crc = byte
  for _ = 1, 8 do crc = crc & 1 == 1 and 0xEDB88320 ~ crc >> 1 or crc >> 1 end
  crcs[byte] = crc
end

local function crc32(data)
  local crc = 0xFFFFFFFF
  for at = 1, #data do crc = crcs[(crc ~ data:byte(at)) & 0xFF] ~ crc >> 8 end
  return crc ~ 0xFFFFFFFF
end

local function adler32(data)
  local a, b = 1, 0
  for at = 1, #data do
    a = (a + data:byte(at)) % 65521
    b = (b + a) % 65521
  end
  return b << 16 | a
end

local function chunk(kind, data)
  return string.pack(">I4", #data) .. kind .. data .. string.pack(">I4", crc32(kind .. data))
end

--- The picture as a PNG file; `rows`: strings of `width` bytes.
---@param width integer
---@param rows string[]
---@return string
return function(width, rows)
  local data = "\0" .. table.concat(rows, "\0") -- a zero before each row: no filter
  local blocks = { "\x78\x01" }
  for at = 1, #data, 0xFFFF do
    local block = data:sub(at, at + 0xFFFE)
    local is_last = at + 0xFFFF > #data
    blocks[#blocks + 1] = string.pack("<BI2I2", is_last and 1 or 0, #block, ~#block & 0xFFFF) .. block
  end
  blocks[#blocks + 1] = string.pack(">I4", adler32(data))
  return "\x89PNG\r\n\x1a\n" .. chunk("IHDR", string.pack(">I4I4BBBBB", width, #rows, 8, 0, 0, 0, 0))
    .. chunk("IDAT", table.concat(blocks)) .. chunk("IEND", "")
end
