function camera = obscura_connect(address, timeout_s, token_file)
% CAMERA = OBSCURA_CONNECT() connects to the rendering server at 127.0.0.1:5152.
% CAMERA = OBSCURA_CONNECT(ADDRESS, TIMEOUT_S, TOKEN_FILE): 'HOST:PORT', or the path of its Unix socket; TIMEOUT_S: longest
% silence (600); TOKEN_FILE: file of the token that the server wants.

  % SPDX-License-Identifier: Apache-2.0
  if nargin < 1
    address = '127.0.0.1:5152';
  end
  if nargin < 2
    timeout_s = 0;
  end
  if nargin < 3
    token_file = '';
  end
  camera = struct('handle', obscura_mex('connect', address, timeout_s, token_file));
end
