% SPDX-License-Identifier: Apache-2.0
% The part of client_bench in Octave. Usage: client_bench.m ADDRESS REPEATS; prints JSON.
1;

function text = times_us(count, work)
  spent = zeros(1, count);
  used = cputime();
  for i = 1:count
    begin = tic();
    work(i);
    spent(i) = 1e6 * toc(begin);
  end
  used = 1e6 * (cputime() - used) / count;
  spent = sort(spent);
  text = sprintf('{"p50": %.1f, "p99": %.1f, "processor": %.1f}', spent(floor(count / 2) + 1), spent(floor(count * 0.99) + 1), used);
end

words = argv();
camera = obscura_connect(words{1});
repeats = str2double(words{2});
pictures = max(floor(repeats / 50), 10);
status = times_us(repeats, @(i) obscura_call(camera, 'status'));
change = times_us(repeats, @(i) obscura_set(camera, 'sun', 'limb_darkening', (i - 1) / repeats));
obscura_load(camera, struct());
picture = times_us(pictures, @(i) obscura_render(camera, 'width', 1024, 'height', 1024, 'samples', 1));
printf('{"status_us": %s, "set_us": %s, "picture_us": %s}\n', status, change, picture);
obscura_close(camera);
