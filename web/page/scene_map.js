// SPDX-License-Identifier: Apache-2.0
// Map of a scene in two views along the boresight, and the geometry that is computed from true poses: phase angles, sizes.
import {html} from "./vendor/preact-htm.js";
import {figure} from "./format.js";

const WIDTH = 460, HEIGHT = 230, EDGE = 26, LEAST_PX = 3;

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const norm = (a) => Math.sqrt(dot(a, a));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const degrees = (rad) => rad * 180 / Math.PI;
/** Angle between two directions, rad; exact for small ones too. */
const angleOf = (a, b) => Math.atan2(norm(cross(a, b)), dot(a, b));

/** A vector turned by the inverse of a quaternion w, x, y, z: from inertial to camera axes. */
export function toCamera([w, x, y, z], v) {
  const q = [-x, -y, -z], t = cross(q, v).map((n) => 2 * n), u = cross(q, t);
  return [0, 1, 2].map((k) => v[k] + w * t[k] + u[k]);
}

/** Angle at the body between the directions to the Sun and to the camera, degrees: 0 fully lit. */
export const phaseOf = (truth, body) => degrees(angleOf(minus(truth.sun_position_m, body.position_m), minus(truth.camera_position_m, body.position_m)));
/** Direction of the Sun as the camera sees it: angle off the boresight, and around it from right towards down, degrees. */
export function sunOf(truth) {
  const sun = toCamera(truth.camera_orientation, minus(truth.sun_position_m, truth.camera_position_m));
  return {off: degrees(angleOf(sun, [0, 0, 1])), around: degrees(Math.atan2(sun[1], sun[0])), distance_m: norm(sun)};
}
/** Radius of a body's bounding sphere in metres, from its size in the image; none: not known. */
function radiusOf(body, fieldDeg, pixels) {
  return body.radius_px && fieldDeg ? body.range_m * Math.sin(Math.min(Math.PI / 2, body.radius_px * fieldDeg / pixels * Math.PI / 180)) : undefined;
}

/** One view: the boresight to the right, `across` (0: the image's x axis, 1: its y axis) downwards, metres to scale. */
function View({title, across, places, sun, fieldDeg, scale, far}) {
  const x = (m) => EDGE + m * scale, y = (m) => HEIGHT / 2 + m * scale;
  const half = fieldDeg * Math.PI / 360, reach = WIDTH - EDGE - 8;
  const edge = (side) => {
    // As far as the view reaches, to the right or to its edge.
    const along = Math.min(reach, half < 1.5 ? (HEIGHT / 2 - 4) / Math.max(1e-9, Math.tan(half)) : 0);
    return `M${EDGE} ${HEIGHT / 2}L${(EDGE + along).toFixed(1)} ${(HEIGHT / 2 + side * along * Math.tan(Math.min(half, 1.5))).toFixed(1)}`;
  };
  const towards = [sun[2], sun[across]], long = Math.hypot(...towards), at = [WIDTH - 66, 52];
  const arrow = long > 0 ? towards.map((n) => 24 * n / Math.max(long, 1e-9) * Math.min(1, long)) : [0, 0];
  const told = places.map((p) => `${p.name} ${figure(p.at[2], 3)} m ahead, ${figure(Math.abs(p.at[across]), 3)} m ${across ? p.at[1] < 0 ? "up" : "down" : p.at[0] < 0 ? "left" : "right"}`).join("; ");
  return html`<figure class="map"><svg viewBox=${`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label=${`${title}: ${told || "no bodies"}`}>
      <path class="frustum" d=${edge(-1) + edge(1)} /><path class="boresight" d=${`M${EDGE} ${HEIGHT / 2}H${WIDTH - 8}`} />
      ${places.map((p) => html`<circle key=${p.name} class="body" cx=${x(p.at[2]).toFixed(1)} cy=${y(p.at[across]).toFixed(1)} r=${Math.max(LEAST_PX, (p.radius_m ?? 0) * scale).toFixed(1)} />`)}
      ${places.map((p) => html`<text key=${p.name} x=${x(p.at[2]).toFixed(1)} y=${(y(p.at[across]) - Math.max(LEAST_PX, (p.radius_m ?? 0) * scale) - 4).toFixed(1)} text-anchor="middle">${p.name}</text>`)}
      <path class="eye" d=${`M${EDGE - 12} ${HEIGHT / 2 - 6}h8l4 -4v20l-4 -4h-8z`} />
      <g class="sun"><circle cx=${at[0]} cy=${at[1]} r="3" /><path d=${`M${at[0]} ${at[1]}l${arrow[0].toFixed(1)} ${arrow[1].toFixed(1)}`} /><circle cx=${(at[0] + arrow[0]).toFixed(1)} cy=${(at[1] + arrow[1]).toFixed(1)} r="5" class="disc" /><text x=${at[0]} y="14" text-anchor="middle">to the Sun</text></g>
      <path class="ruler" d=${`M${EDGE} ${HEIGHT - 8}v-5h${(far.length_m * scale).toFixed(1)}v5`} /><text x=${EDGE + 4} y=${HEIGHT - 17}>${far.text}</text></svg>
    <figcaption>${title}</figcaption></figure>`;
}

/** A round length that fits a third of the view. */
function ruler(scale) {
  const most = WIDTH / 3 / scale, decade = 10 ** Math.floor(Math.log10(most)), length = [5, 2, 1].map((n) => n * decade).find((n) => n <= most) ?? decade;
  return {length_m: length, text: length >= 1e3 ? `${figure(length / 1e3, 3)} km` : `${figure(length, 3)} m`};
}

/** Both views of the bodies of a `truth`; `lens`: the camera of the scene's description, if there is one. */
export function SceneMap({truth, lens}) {
  const [wide, high] = lens?.field_of_view_deg ?? [0, 0];
  const places = truth.bodies.map((body) => ({name: body.name, at: toCamera(truth.camera_orientation, minus(body.position_m, truth.camera_position_m)), radius_m: radiusOf(body, wide, lens?.width ?? 1)}));
  const sun = toCamera(truth.camera_orientation, minus(truth.sun_position_m, truth.camera_position_m)), distance = norm(sun);
  const ahead = Math.max(...places.map((p) => Math.abs(p.at[2]) + (p.radius_m ?? 0)), 1e-9), aside = Math.max(...places.map((p) => Math.max(Math.abs(p.at[0]), Math.abs(p.at[1])) + (p.radius_m ?? 0)), 1e-9);
  const scale = Math.min((WIDTH - EDGE - 40) / ahead, (HEIGHT / 2 - 30) / aside), far = ruler(scale), unit = sun.map((n) => n / Math.max(distance, 1e-9));
  const shared = {places, sun: unit, scale, far};
  return html`<div class="maps"><${View} title="From above: the boresight to the right, the image's right downwards" across=${0} fieldDeg=${wide} ...${shared} />
    <${View} title="From the side: the boresight to the right, the image's down downwards" across=${1} fieldDeg=${high} ...${shared} /></div>`;
}
