function failure = obscura_last_error(camera)
% FAILURE = OBSCURA_LAST_ERROR(CAMERA): struct of code, message, field, allowed and hint of the last call; empty if all was well.

  % SPDX-License-Identifier: Apache-2.0
  failure = obscura_mex('error', camera.handle);
end
