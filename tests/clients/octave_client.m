% SPDX-License-Identifier: Apache-2.0
% The client for Octave and MATLAB with a server of its own: light and geometry beside their formulas, values there and back,
% mistakes. Ends with status 1 at the first check that fails. Usage: octave-cli --path ... octave_client.m
1;

function check(what, good)
  printf('%s - %s\n', {'NOT OK', 'ok'}{1 + all(good(:))}, what);
  if ~all(good(:))
    exit(1);
  end
end

function check_refused(what, id, text, work)
  try
    work();
    check([what ': was not refused'], false);
  catch failure
    check([what ': ' failure.identifier ': ' failure.message], ...
          strcmp(failure.identifier, id) && ~isempty(strfind(failure.message, text)));
  end
end

% A ball and a lamp at the place of the camera, which looks along z. A focal length for the rows, another for the columns.
tan10 = tan(10 * pi / 180);
tan15 = tan(15 * pi / 180);
scene = struct('quantity', 'radiance');
scene.sun = struct('irradiance_scale', 0);
scene.camera = struct('width', 64, 'height', 48, 'focal_length_mm', 10, 'pixel_pitch_um', 150, 'pixel_pitch_y_um', 120, ...
                      'psf_sigma_px', 0, 'boresight', [0 0 1], 'up', [0 -1 0]);
scene.lamp = {struct('name', 'lamp', 'intensity_w_sr', {{100}}, 'boresight', [0 0 1], 'up', [0 -1 0])};
scene.body = {struct('name', 'ball', 'shape', 'ellipsoid', 'radii_m', [1 1 1], 'albedo', 0.8, 'position_m', [0 0 10])};

camera = obscura_start('', 'threads', 1);
check('bodies of a scene', isequal(obscura_load(camera, scene), {'ball'}));
picture = obscura_render(camera, 'samples', 16, 'layers', {'depth_m', 'normal.z', 'body'}, 'truth', true);
check('size of a picture', isequal(size(picture.values), [48 64]) && isa(picture.values, 'single'));
% Lambert: radiance = albedo / pi * intensity / distance^2, near the point that is nearest, half a pixel off the axis.
check('radiance at the centre of a ball', abs(picture.values(24, 32) - 0.8 / pi * 100 / 81) < 5e-3);
check('depth', abs(picture.layers.depth_m(24, 32) - 9) < 5e-3 && isnan(picture.layers.depth_m(1, 1)));
check('a layer whose name has a dot', abs(picture.layers.normal_z(24, 32) + 1) < 1e-2);
check('what a picture tells', strcmp(picture.quantity, 'radiance') && strcmp(picture.unit, 'W m-2 sr-1') && ...
      isequal(size(picture.bands_nm), [1 2]) && picture.time_s == 0);
ball = picture.truth.bodies{1};
check('truth', strcmp(ball.name, 'ball') && isequal(ball.position_m, [0 0 10]) && ball.range_m == 10);

obscura_set(camera, 'body', 'ball', 'position_m', [1000 * tan15, 1000 * tan10, 1000], 'radii_m', [20 20 20]);
obscura_set(camera, 'lamp', 0, struct('intensity_w_sr', {{1e6}}));
picture = obscura_render(camera, 'samples', 64);
light = double(picture.values);
[columns, rows] = meshgrid(0.5:63.5, 0.5:47.5);
check('column of a ball at 15 degrees', abs(sum(sum(light .* columns)) / sum(light(:)) - (32 + 1e4 / 150 * tan15)) < 0.05);
check('row of a ball at 10 degrees', abs(sum(sum(light .* rows)) / sum(light(:)) - (24 + 1e4 / 120 * tan10)) < 0.05);

% Bands are the third dimension.
scene.band = {struct('from_nm', 400, 'to_nm', 500), struct('from_nm', 500, 'to_nm', 700)};
scene.lamp{1}.intensity_w_sr = [1e6 2e6];
scene.body{1} = obscura_get(camera, 'body', 0);
obscura_load(camera, scene);
both = obscura_render(camera, 'samples', 64);
check('bands', isequal(size(both.values), [48 64 2]) && isequal(size(both.bands_nm), [2 2]));
check('light of the bands', abs(both.values(:, :, 2) - 2 * both.values(:, :, 1)) <= 1e-5 * max(both.values(:)));
window = obscura_render(camera, 'samples', 64, 'window', [40 20 16 10]);
check('a window has the pixels of the whole', isequal(window.values, both.values(21:30, 41:56, :)));

% Values there and back
keys = obscura_get(camera, 'camera');
check('keys', keys.width == 64 && isequal(keys.boresight, [0 0 1]));
all = obscura_get(camera, 'body');
check('elements', iscell(all) && numel(all) == 1 && strcmp(all{1}.name, 'ball'));
obscura_set(camera, 'camera', 'pixel_pitch_y_um', []);
check('[] removes a key', ~isfield(obscura_get(camera, 'camera'), 'pixel_pitch_y_um'));
toml = obscura_export(camera);
obscura_load(camera, toml);
check('a scene file comes back', strcmp(obscura_export(camera), toml));
map = obscura_call(camera, 'status');
check('any call', map.waiting == 0);

% Mistakes
check_refused('out of range', 'obscura:bad_scene', 'out of range', @() obscura_set(camera, 'camera', 'focal_length_mm', -1));
failure = obscura_last_error(camera);
check('its parts', strcmp(failure.code, 'bad-scene') && strcmp(failure.field, 'camera.focal_length_mm') && ~isempty(failure.allowed));
check_refused('a misspelt field', 'obscura:bad_argument', 'samples', @() obscura_render(camera, 'sample', 4));
check_refused('a complex number', 'obscura:bad_use', 'real numbers', @() obscura_set(camera, 'camera', 'width', 1i));
check_refused('a function', 'obscura:bad_use', 'can be sent', @() obscura_set(camera, 'camera', 'width', @sin));
check_refused('no pairs', 'obscura:bad_use', 'in turn', @() obscura_add(camera, 'body', 'name'));
check_refused('no server', 'obscura:connection_lost', 'is `obscura serve` running there?', @() obscura_connect('127.0.0.1:1'));
check_refused('no program', 'obscura:connection_lost', 'environment variable OBSCURA', @() obscura_start('', 'program', '/none'));
check('nothing has changed', strcmp(obscura_export(camera), toml));

other = obscura_start('demo', 'threads', 1);
check('another scene beside it', numel(obscura_get(other, 'body')) == 1 && strcmp(obscura_export(camera), toml));
obscura_close(other);
obscura_close(other);
check_refused('closed', 'obscura:closed', 'closed', @() obscura_export(other));
check('the first is still there', strcmp(obscura_export(camera), toml));
obscura_close(camera);
