-- SPDX-License-Identifier: Apache-2.0
-- A rendered picture: arrays with the first row on top, and what belongs to them.

local png = require "obscura.png"

--- `values`: obscura.Array, W/m2 per pixel at the entrance pupil (or W m-2 sr-1, see `unit`), a plane for each spectral band, or
--- digital numbers of a sensor, of whose readout `detector` tells bits, window, exposure and flags;
--- `layers`: further arrays by name, NaN where nothing is; `depth_m`: that layer; `quantity`, `unit`, `bands_nm`, `time_s`,
--- `seconds` (that the server took); `truth`: poses, if they were asked for; `width`, `height`, `bands`.
---@class obscura.Picture
local Picture = {}
local methods = {}

function Picture.__index(picture, name)
  return methods[name] or rawget(picture, "layers")[name]
end

function Picture.new(head, arrays, order)
  local values = arrays[order[1]]
  local layers = {}
  for index = 2, #order do layers[order[index]] = arrays[order[index]] end
  return setmetatable({
    quantity = values.name, unit = head.unit, values = values, layers = layers, bands = values.planes,
    height = values.height, width = values.width, bands_nm = head.bands_nm, time_s = head.time_s, seconds = head.seconds,
    truth = head.truth, detector = head.detector,
  }, Picture)
end

local function is_seen(value)
  return value == value and value ~= 0 and math.abs(value) ~= math.huge
end

--- Rows of bytes for looking at: from dark to the 99.9th percentile of the lit pixels, a layer from its least to its largest
--- value; not for measurement.
---@param layer? string
---@return string[]
function methods:preview(layer)
  local array = layer and (self.layers[layer] or error(("no layer %q"):format(layer), 2)) or self.values
  local planes = layer and 1 or self.bands
  local means, seen = {}, {}
  for row = 1, self.height do
    local sums = array:row(row)
    for plane = 2, planes do
      for column, value in ipairs(array:row(row, plane)) do sums[column] = sums[column] + value end
    end
    for column, sum in ipairs(sums) do
      sums[column] = sum / planes
      if is_seen(sum) then seen[#seen + 1] = sum / planes end
    end
    means[row] = sums
  end
  table.sort(seen)
  local low = layer and seen[1] or 0
  local high = layer and seen[#seen] or seen[math.ceil(0.999 * #seen)] or 1
  local scale = 1 / math.max((high or 1) - (low or 0), 1e-300)
  for row, values in ipairs(means) do
    for column, value in ipairs(values) do
      local part = value == value and (value - (low or 0)) * scale or 0
      values[column] = string.char(math.floor(255 * math.min(math.max(part, 0), 1) ^ (1 / 2.2) + 0.5))
    end
    means[row] = table.concat(values)
  end
  return means
end

--- Writes a PNG for looking at.
---@param file string
---@param layer? string
function methods:save(file, layer)
  local out = assert(io.open(file, "wb"))
  assert(out:write(png(self.width, self:preview(layer))))
  assert(out:close())
  return file
end

function Picture:__tostring()
  local most, names = 0, {}
  for plane = 1, self.bands do
    for _, values in self.values:rows(plane) do most = math.max(most, table.unpack(values)) end
  end
  for name in pairs(self.layers) do names[#names + 1] = name end
  table.sort(names)
  return ("Picture of %d x %d px, %d bands, %s up to %.4g %s, at %g s%s"):format(self.width, self.height, self.bands,
    self.quantity, most, self.unit, self.time_s, #names > 0 and ", layers " .. table.concat(names, ", ") or "")
end

return Picture
