function obscura_add(camera, section, varargin)
% OBSCURA_ADD(CAMERA, SECTION, KEY, VALUE, ...) adds an element to 'body', 'lamp', ...; a struct may stand for the pairs.

  % SPDX-License-Identifier: Apache-2.0
  obscura_call(camera, 'scene.add', struct('section', section, 'keys', obscura_fields(varargin)));
end
