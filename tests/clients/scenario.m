% SPDX-License-Identifier: Apache-2.0
% The scenario of scenario_test.py in Octave. Usage: octave-cli --path FOLDER-OF-THE-CLIENT scenario.m ADDRESS
1;

function show_digest(name, bytes)
  printf('%s %s\n', name, hash('sha256', char(bytes)));
end

function bytes = as_received(array)
% Bytes of [rows, columns, bands] as the server sends them: bands, rows, columns.
  bytes = typecast(permute(array, [2 1 3])(:)', 'uint8');
end

function show(picture)
  show_digest('values', as_received(picture.values));
  show_digest('depth', as_received(picture.layers.depth_m));
  printf('lit %d\nseen %d\n', nnz(picture.values > 0), nnz(~isnan(picture.layers.depth_m)));
end

camera = obscura_connect(argv(){1});
obscura_load(camera, struct());
obscura_set(camera, 'camera', 'width', 160, 'height', 120, 'focal_length_mm', single(10), 'pixel_pitch_um', single(20), ...
            'boresight', int32([0 0 1]), 'up', int32([0 -1 0]), 'psf_sigma_px', 1.5);
obscura_set(camera, 'sun', 'direction', [-1.0 -0.5 -2.0]);
obscura_add(camera, 'body', 'name', 'ball', 'shape', 'ellipsoid', 'radii_m', [1 1 1], 'albedo', 0.3, 'position_m', [0.25 -0.125 12.5]);
show(obscura_render(camera, 'time_s', 0, 'samples', 16, 'seed', 7, 'frame', 3, 'layers', {'depth_m'}));
try
  obscura_set(camera, 'body', 'ball', 'albedo', 2.5);
catch
  failure = obscura_last_error(camera);
  printf('refused %s %s %s\n', failure.code, failure.field, failure.allowed);
end
obscura_set(camera, 'body', 'ball', 'position_m', [0.1 0.2 10]);
obscura_set(camera, 'camera', 'psf_sigma_px', []);
show(obscura_render(camera, 'time_s', 1.5, 'samples', 16, 'seed', 7, 'frame', 4, 'layers', {'depth_m'}));
exposed = obscura_render(camera, 'exposure_s', 0.02, 'sensor', ...
                         struct('file', 'generic', 'readout', struct('width', 96, 'height', 64)), 'samples', 2, 'seed', 7, ...
                         'frame', 5, 'run', 3);
show_digest('dn', as_received(exposed.values));
printf('sum %d\n', sum(double(exposed.values(:))));
show_digest('export', obscura_export(camera));
obscura_close(camera);
