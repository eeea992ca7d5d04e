function obscura_build(output, varargin)
% OBSCURA_BUILD compiles the MEX function beside this file, in Octave or MATLAB, with the system's C compiler.
% OBSCURA_BUILD(FOLDER, FLAG, ...) puts it into another folder, which is to be in the path; flags go to the compiler driver.
% In the source tree the C client becomes a part of it; else the library libobscura-client and its header must be installed.

  % SPDX-License-Identifier: Apache-2.0
  folder = fileparts(mfilename('fullpath'));
  if nargin < 1
    output = folder;
  end
  client = fullfile(folder, '..', 'c');
  sources = {fullfile(folder, 'obscura_mex.c'), fullfile(folder, 'obscura_mex_values.c')};
  found = dir(fullfile(client, 'src', '*.c'));
  if isempty(found)
    flags = [varargin, {'-lobscura-client'}];
  else
    sources = [sources, cellfun(@(name) fullfile(client, 'src', name), {found.name}, 'UniformOutput', false)];
    flags = [varargin, {['-I' fullfile(client, 'include')]}];
  end
  if exist('OCTAVE_VERSION', 'builtin')
    mkoctfile('--mex', '-D_POSIX_C_SOURCE=200809L', '-o', fullfile(output, ['obscura_mex.' mexext()]), sources{:}, flags{:});
  else
    mex('-R2018a', '-D_POSIX_C_SOURCE=200809L', '-output', fullfile(output, 'obscura_mex'), sources{:}, flags{:});
  end
end
