-- SPDX-License-Identifier: Apache-2.0
-- What goes wrong between client and server: tables with `code` and `message`, thrown by error().

local errors = {}

local Error = {}
Error.__index = Error
Error.__name = "obscura.Error"
function Error:__tostring()
  return self.hint ~= "" and ("%s (%s)"):format(self.message, self.hint) or self.message
end

--- The server refused a request; the connection lives on. `code`: word such as "bad-argument", "bad-scene", "cancelled";
--- `field`: what of the request or scene is wrong; `allowed`: its values; `hint`: what to try. "" is what it did not say.
---@param head table
function errors.refused(head)
  local error = {}
  for _, name in ipairs { "code", "message", "field", "allowed", "hint" } do
    error[name] = tostring(head[name] or "")
  end
  return setmetatable(error, Error)
end

--- The server is gone, cannot be reached, does not answer in time or does not speak the protocol: code "connection-lost".
---@param message string
function errors.lost(message)
  return errors.refused { code = "connection-lost", message = message }
end

return errors
