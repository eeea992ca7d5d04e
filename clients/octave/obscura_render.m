function picture = obscura_render(camera, varargin)
% PICTURE = OBSCURA_RENDER(CAMERA, NAME, VALUE, ...) renders the scene. Names are the fields of the call render:
%   time_s, exposure_s, width, height, window, samples, error, max_samples, bounces, seed, frame, truth, layers, ...
% layers is a cell array of names, as {'depth_m', 'normal.x'}. PICTURE is a struct:
%   values    single [rows, columns, bands], first row on top, W/m2 per pixel at the entrance pupil (or unit)
%   layers    struct of single [rows, columns], NaN where nothing is; the name normal.x is normal_x
%   quantity, unit, bands_nm, time_s, seconds; truth if it was asked for, its pixels counted from 0

  % SPDX-License-Identifier: Apache-2.0
  [map, arrays] = obscura_call(camera, 'render', obscura_fields(varargin));
  names = fieldnames(arrays);
  picture = rmfield(map, 'arrays');
  picture.quantity = names{1};
  picture.values = arrays.(names{1});
  picture.layers = rmfield(arrays, names{1});
end
