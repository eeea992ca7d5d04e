-- SPDX-License-Identifier: Apache-2.0
-- An array of an answer: a string of numbers, with accessors. Rows, columns and planes count from 1.

--- `data`: its bytes, little-endian, last index fastest; `dtype`: type of its numbers as numpy writes it ("<f4", "<u2");
--- `shape`: numbers along each axis; `height`, `width`: of a plane; `planes`: bands of a picture, 1 for a layer.
---@class obscura.Array
local Array = {}
Array.__index = Array

-- Format of string.unpack and bytes of a number.
local FORMATS = { ["<f4"] = { "f", 4 }, ["<f8"] = { "d", 8 }, ["<u2"] = { "I2", 2 }, ["<u1"] = { "B", 1 }, ["|u1"] = { "B", 1 } }

local function new(row, data)
  local format = FORMATS[row.dtype] or error(("numbers of type %s"):format(row.dtype), 0)
  local numbers = 1
  for _, extent in ipairs(row.shape) do numbers = numbers * extent end
  if numbers * format[2] ~= #data then error("an array whose shape is not that of its bytes", 0) end
  local width = row.shape[#row.shape] or 1
  local height = row.shape[#row.shape - 1] or 1
  return setmetatable({
    name = row.name, dtype = row.dtype, shape = row.shape, data = data, width = width, height = height,
    planes = width * height > 0 and numbers // (width * height) or 0,
    one = "<" .. format[1], many = "<" .. format[1]:rep(width), bytes = format[2],
  }, Array)
end

--- The arrays that the row `arrays` of a head tells of, by name, and their names in order. Throws a string.
function Array.all(rows, body)
  local arrays, order = {}, {}
  for _, row in ipairs(rows) do
    if row.codec ~= "none" then error(("an array with the codec %s"):format(row.codec), 0) end
    if row.offset < 0 or row.bytes < 0 or row.offset > #body - row.bytes then error("an array outside the message", 0) end
    arrays[row.name] = new(row, body:sub(row.offset + 1, row.offset + row.bytes))
    order[#order + 1] = row.name
  end
  return arrays, order
end

function Array:place(row, column, plane)
  if row < 1 or row > self.height or column < 1 or column > self.width or plane < 1 or plane > self.planes then
    error(("%s: no pixel at row %d, column %d, plane %d"):format(self.name, row, column, plane), 3)
  end
  return 1 + self.bytes * (((plane - 1) * self.height + row - 1) * self.width + column - 1)
end

--- Value of a pixel.
---@param plane? integer spectral band, 1 if it is left out
---@return number
function Array:at(row, column, plane)
  return (string.unpack(self.one, self.data, self:place(row, column, plane or 1)))
end

--- Values of a row as a list.
---@param plane? integer spectral band, 1 if it is left out
---@return number[]
function Array:row(row, plane)
  local values = { string.unpack(self.many, self.data, self:place(row, 1, plane or 1)) }
  values[#values] = nil -- the place behind the last
  return values
end

--- Iterates over all rows: `for row, values in array:rows() do`.
---@param plane? integer spectral band, 1 if it is left out
function Array:rows(plane)
  local row = 0
  return function()
    row = row + 1
    if row <= self.height then return row, self:row(row, plane) end
  end
end

return Array
