function obscura_remove(camera, section, item)
% OBSCURA_REMOVE(CAMERA, SECTION) removes a table; OBSCURA_REMOVE(CAMERA, SECTION, ITEM) an element, by name or number from 0.

  % SPDX-License-Identifier: Apache-2.0
  fields = struct('section', section);
  if nargin > 2
    fields.item = item;
  end
  obscura_call(camera, 'scene.remove', fields);
end
