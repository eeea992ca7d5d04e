function obscura_set(camera, section, varargin)
% OBSCURA_SET(CAMERA, SECTION, KEY, VALUE, ...) changes keys of a table: 'camera', 'sun', ...
% OBSCURA_SET(CAMERA, SECTION, ITEM, KEY, VALUE, ...) changes keys of an element of 'body', 'lamp', ...: ITEM is its name, or
% its number from 0. A struct of keys may stand for the pairs. [] removes a key. All keys change, or none.

  % SPDX-License-Identifier: Apache-2.0
  fields = struct('section', section);
  has_item = mod(numel(varargin), 2) == 1 && ~(numel(varargin) == 1 && isstruct(varargin{1}));
  has_item = has_item || (numel(varargin) == 2 && isstruct(varargin{2}));
  if has_item
    fields.item = varargin{1};
    varargin = varargin(2:end);
  end
  fields.keys = obscura_fields(varargin);
  obscura_call(camera, 'scene.set', fields);
end
