function obscura_close(camera)
% OBSCURA_CLOSE(CAMERA) ends the connection, and the server of OBSCURA_START. The scene is gone.

  % SPDX-License-Identifier: Apache-2.0
  obscura_mex('close', camera.handle);
end
