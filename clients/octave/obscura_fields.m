function fields = obscura_fields(list)
% FIELDS = OBSCURA_FIELDS({NAME, VALUE, ...}) or OBSCURA_FIELDS({STRUCT}): struct of names and values.

  % SPDX-License-Identifier: Apache-2.0
  if numel(list) == 1 && isstruct(list{1})
    fields = list{1};
    return
  end
  if mod(numel(list), 2) ~= 0
    error('obscura:bad_use', 'names and values are wanted in turn');
  end
  fields = struct();
  for i = 1:2:numel(list)
    fields.(list{i}) = list{i + 1};
  end
end
