function keys = obscura_get(camera, section, item)
% KEYS = OBSCURA_GET(CAMERA, SECTION): what a table ('camera', 'sun', ...) gives, or all elements of 'body', 'lamp', ...
% KEYS = OBSCURA_GET(CAMERA, SECTION, ITEM): of one element, by its name or its number from 0.

  % SPDX-License-Identifier: Apache-2.0
  fields = struct('section', section);
  if nargin > 2
    fields.item = item;
  end
  map = obscura_call(camera, 'scene.get', fields);
  keys = map.keys;
end
