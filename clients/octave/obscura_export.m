function toml = obscura_export(camera)
% TOML = OBSCURA_EXPORT(CAMERA): the scene as a scene file; the program obscura renders the same picture of it.

  % SPDX-License-Identifier: Apache-2.0
  map = obscura_call(camera, 'scene.export');
  toml = map.toml;
end
