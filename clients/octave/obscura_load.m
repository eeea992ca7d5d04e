function bodies = obscura_load(camera, scene)
% BODIES = OBSCURA_LOAD(CAMERA, FILE) replaces the scene by a shipped one ('demo') or by a file below the server's folder.
% BODIES = OBSCURA_LOAD(CAMERA, TOML) replaces it by the text of a scene file, which has more than one line.
% BODIES = OBSCURA_LOAD(CAMERA, SCENE) replaces it by tables in a struct. BODIES: their names.

  % SPDX-License-Identifier: Apache-2.0
  if isstruct(scene)
    map = obscura_call(camera, 'scene.load', 'scene', scene);
  elseif any(scene == char(10))
    map = obscura_call(camera, 'scene.load', 'toml', scene);
  else
    map = obscura_call(camera, 'scene.load', 'file', scene);
  end
  bodies = map.bodies;
  if isempty(bodies)
    bodies = {};
  end
end
