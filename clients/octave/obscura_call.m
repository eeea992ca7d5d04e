function [map, arrays] = obscura_call(camera, name, varargin)
% [MAP, ARRAYS] = OBSCURA_CALL(CAMERA, NAME, FIELD, VALUE, ...) makes any call of the server (docs/reference/calls.md).
% [MAP, ARRAYS] = OBSCURA_CALL(CAMERA, NAME, FIELDS) has its fields in a struct.
% Structs are maps, cell arrays and vectors are arrays, [] is nil. A double that is whole is sent as an integer, an array of
% doubles as numbers; single(4) is a number, int32([1 2]) are integers.
% Fails with the identifier obscura:CODE; OBSCURA_LAST_ERROR tells more.

  % SPDX-License-Identifier: Apache-2.0
  [map, arrays] = obscura_mex('call', camera.handle, name, obscura_fields(varargin));
end
