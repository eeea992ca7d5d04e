function camera = obscura_start(scene, varargin)
% CAMERA = OBSCURA_START() starts a rendering server of this session's own and connects to it.
% CAMERA = OBSCURA_START('demo') loads a shipped scene, or a file below the server's folder, too.
% CAMERA = OBSCURA_START(SCENE, NAME, VALUE, ...) has options:
%   'root'       folder below which scenes may name files (the working directory)
%   'program'    program obscura (of the environment variable OBSCURA, else of PATH)
%   'threads'    render threads (one per core)
%   'timeout_s'  longest silence of the server (600)
% End it with OBSCURA_CLOSE; it ends with the session at the latest.

  % SPDX-License-Identifier: Apache-2.0
  if nargin < 1
    scene = '';
  end
  options = struct('root', '', 'program', '', 'threads', 0, 'timeout_s', 0);
  for i = 1:2:numel(varargin)
    if ~isfield(options, varargin{i})
      error('obscura:bad_use', 'obscura_start: there is no option %s', varargin{i});
    end
    options.(varargin{i}) = varargin{i + 1};
  end
  camera = struct('handle', obscura_mex('start', scene, options.root, options.program, options.threads, options.timeout_s));
end
