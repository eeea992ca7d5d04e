-- SPDX-License-Identifier: Apache-2.0
-- SHA-256 (FIPS 180-4), and HMAC by it (RFC 2104), for proofs of tokens.

local sha256 = {}

-- First 32 bits of the fractional parts of cube roots (of square roots: START) of the first primes.
local ROUND, START = {}, {}
do
  local function fraction(root) return math.floor((root - math.floor(root)) * 2 ^ 32) end
  local prime = 1
  while #ROUND < 64 do
    repeat
      prime = prime + 1
      local composite = false
      for divisor = 2, math.floor(prime ^ 0.5) do composite = composite or prime % divisor == 0 end
    until not composite
    ROUND[#ROUND + 1] = fraction(prime ^ (1 / 3))
    if #START < 8 then START[#START + 1] = fraction(prime ^ 0.5) end
  end
end

local function rotated(word, bits)
  return (word >> bits | word << (32 - bits)) & 0xFFFFFFFF
end

local function add_block(state, block)
  local words = { string.unpack(">" .. ("I4"):rep(16), block) }
  for i = 17, 64 do
    local a, b = words[i - 15], words[i - 2]
    words[i] = words[i - 16] + (rotated(a, 7) ~ rotated(a, 18) ~ a >> 3) + words[i - 7]
      + (rotated(b, 17) ~ rotated(b, 19) ~ b >> 10) & 0xFFFFFFFF
  end
  local a, b, c, d, e, f, g, h = table.unpack(state)
  for i = 1, 64 do
    local first = h + (rotated(e, 6) ~ rotated(e, 11) ~ rotated(e, 25)) + (e & f ~ ~e & g) + ROUND[i] + words[i]
    local second = (rotated(a, 2) ~ rotated(a, 13) ~ rotated(a, 22)) + (a & b ~ a & c ~ b & c)
    h, g, f, e, d, c, b, a = g, f, e, d + first & 0xFFFFFFFF, c, b, a, first + second & 0xFFFFFFFF
  end
  for i, word in ipairs { a, b, c, d, e, f, g, h } do state[i] = state[i] + word & 0xFFFFFFFF end
end

--- Digest of 32 bytes.
---@param data string
---@return string
function sha256.digest(data)
  local state = table.move(START, 1, 8, 1, {})
  local padded = data .. "\x80" .. ("\0"):rep((55 - #data) % 64) .. string.pack(">I8", 8 * #data)
  for at = 1, #padded, 64 do add_block(state, padded:sub(at, at + 63)) end
  return string.pack(">" .. ("I4"):rep(8), table.unpack(state))
end

--- HMAC-SHA256 of 32 bytes; `key`: at most 64 bytes.
---@param key string
---@param data string
---@return string
function sha256.hmac(key, data)
  local padded = key .. ("\0"):rep(64 - #key)
  local function mixed(byte)
    return (padded:gsub(".", function(char) return string.char(char:byte() ~ byte) end))
  end
  return sha256.digest(mixed(0x5C) .. sha256.digest(mixed(0x36) .. data))
end

--- Bytes as lower-case hexadecimal digits.
---@param bytes string
---@return string
function sha256.hex(bytes)
  return (bytes:gsub(".", function(char) return ("%02x"):format(char:byte()) end))
end

return sha256
