% A ball comes nearer, ten pictures with depth. The folder of the client is in the path.
camera = obscura_start();
obscura_set(camera, 'camera', 'width', 640, 'height', 480, 'focal_length_mm', 25, 'boresight', [0 0 1], 'up', [0 -1 0]);
obscura_set(camera, 'sun', 'direction', [-1 -1 -2]);
obscura_add(camera, 'body', 'name', 'ball', 'shape', 'ellipsoid', 'radii_m', [1 1 1], 'albedo', 0.3);
for step = 0:9
  obscura_set(camera, 'body', 'ball', 'position_m', [0 0 40 - step]);
  picture = obscura_render(camera, 'samples', 16, 'layers', {'depth_m'});
  fprintf('nearest surface %.3f m\n', min(picture.layers.depth_m(:)));
end
obscura_close(camera);

% SPDX-License-Identifier: Apache-2.0
