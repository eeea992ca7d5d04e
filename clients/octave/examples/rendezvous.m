function rendezvous(frames, folder)
% RENDEZVOUS(FRAMES, FOLDER): a chaser approaches a target and its arm unfolds: 100 frames with depth maps, a light spot on the
% target. The arm is a tree: each link hangs on the one before by a hinge, so that a frame only sets angles. Prints one line a
% frame and writes the last scene. The folder of the client is in the path.

  % SPDX-License-Identifier: Apache-2.0
  if nargin < 1
    frames = 100;
  end
  if nargin < 2
    folder = '.';
  end
  scene = struct();
  scene.sun = struct('direction', [-0.6 -0.5 -1.0]);
  scene.camera = struct('width', 256, 'height', 256, 'focal_length_mm', 25, 'pixel_pitch_um', 20, 'aperture_mm', 10, ...
                        'look_at', 'target');
  scene.lamp = {struct('name', 'spot', 'beam', 'gaussian', 'half_angle_deg', 2, 'intensity_w_sr', {{5e5}}, 'look_at', 'target')};
  target = struct('name', 'target', 'shape', 'box', 'size_m', [3 3 4], 'albedo', 0.3, 'spin_axis', [0 0 1], ...
                  'spin_rate_deg_per_s', 0.5);
  scene.body = {target, link('upper arm', 'target'), link('forearm', 'upper arm')};

  camera = obscura_start();
  obscura_load(camera, scene);
  for frame = 0:frames - 1
    along = frame / max(frames - 1, 1);
    place = [6 -3 -60] * (1 - 0.6 * along);
    obscura_set(camera, 'camera', 'position_m', place);
    obscura_set(camera, 'lamp', 'spot', 'position_m', place + [0.5 0 0]);
    obscura_set(camera, 'body', 'upper arm', 'joint_angle_deg', 70 * along);
    obscura_set(camera, 'body', 'forearm', 'joint_angle_deg', 40 * along);
    picture = obscura_render(camera, 'time_s', frame, 'frame', frame + 1, 'samples', 4, 'layers', {'depth_m'}, 'truth', true);
    fprintf('frame %3d: nearest surface %7.3f m, light %.4e W/m2\n', frame + 1, min(picture.layers.depth_m(:)), ...
            sum(double(picture.values(:))));
  end
  file = fopen(fullfile(folder, 'rendezvous.toml'), 'w');
  fprintf(file, '%s', obscura_export(camera));
  fclose(file);
  obscura_close(camera);
end

function body = link(name, parent)
% A boom of 2 m, hinged at its parent's end.
  body = struct('name', name, 'parent', parent, 'position_m', [0 0 2], 'shape', 'cone', 'bottom_radius_m', 0.08, ...
                'top_radius_m', 0.08, 'height_m', 2, 'albedo', 0.6, 'joint', 'hinge', 'joint_axis', [0 1 0], 'joint_angle_deg', 0);
end
