// SPDX-License-Identifier: Apache-2.0
// Picture on a canvas: zoom, position, stretch, and which part of the image is wanted from the server.
import {countsOf, endsOf, tableOf} from "./stretch.js";

const MOST_ZOOM = 64, MOST_BIN = 64, PICTURES_PER_S = 10;

/** Sizes of the canvas and `scale` are in pixels of the device, positions in pixels of the image: pixel (3, 2) covers 3 to 4 and 2 to 3. */
export class Viewer {
  /** `changed()` is called after whatever else is to be shown on screen; `wants(view)` with the part of the image that is wanted. */
  constructor(canvas, {changed, wants}) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.source = document.createElement("canvas");
    this.changed = changed;
    this.wants = wants;
    this.picture = null;
    this.image = {width: 0, height: 0};
    this.scale = 1;
    this.left = this.top = 0;
    this.fitted = true;
    this.stretch = {kind: "auto", black: 0, white: 4095};
    this.ends = {black: 0, white: 1};
    this.reduce = "max";
  }

  resize(width, height) {
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    if (this.fitted) this.fit();
    else this.place();
  }

  show(picture) {
    const first = !this.image.width, {imageWidth: width, imageHeight: height} = picture;
    this.picture = picture;
    if (this.image.width !== width || this.image.height !== height) {
      this.image = {width, height};
      if (first || this.fitted) this.fit(false);
      else this.place(false);
      this.ask();
    }
    this.develop();
  }

  setStretch(stretch) {
    this.stretch = stretch;
    this.develop();
  }

  setReduce(reduce) {
    this.reduce = reduce;
    this.ask();
  }

  /** Digital numbers to grey. */
  develop() {
    const p = this.picture;
    if (p) {
      const {kind} = this.stretch;
      this.ends = endsOf(kind, kind === "linear" || kind === "manual" ? null : countsOf(p.pixels), p.pixels.length, p.bits, this.stretch);
      const table = tableOf(kind, this.ends);
      this.source.width = p.columns;
      this.source.height = p.lines;
      const grey = new Uint32Array(p.pixels.length);
      for (let i = 0; i < grey.length; ++i) grey[i] = table[p.pixels[i]];
      this.source.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(grey.buffer), p.columns, p.lines), 0, 0);
    }
    this.draw();
  }

  draw() {
    const {context, canvas, picture: p, scale} = this;
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (p) {
      // Nearest neighbours, so that a pixel looks like one; only where several share a pixel of the screen their mean.
      context.imageSmoothingEnabled = p.bin * scale < 1;
      context.drawImage(this.source, (p.x - this.left) * scale, (p.y - this.top) * scale, p.columns * p.bin * scale, p.lines * p.bin * scale);
    }
    this.changed();
  }

  fit(ask = true) {
    const {width, height} = this.image;
    this.fitted = true;
    if (!width || !this.canvas.width) return;
    this.scale = Math.min(this.canvas.width / width, this.canvas.height / height, MOST_ZOOM);
    this.left = (width - this.canvas.width / this.scale) / 2;
    this.top = (height - this.canvas.height / this.scale) / 2;
    if (ask) this.place();
  }

  /** Sets the scale; the position (x, y) of the image stays where it is on the screen. */
  zoom(scale, x = this.left + this.canvas.width / this.scale / 2, y = this.top + this.canvas.height / this.scale / 2) {
    const {width, height} = this.image;
    if (!width) return;
    const least = Math.min(1, this.canvas.width / width, this.canvas.height / height);
    const wanted = Math.min(MOST_ZOOM, Math.max(least, scale)), ratio = this.scale / wanted;
    this.left = x - (x - this.left) * ratio;
    this.top = y - (y - this.top) * ratio;
    this.scale = wanted;
    this.fitted = false;
    this.place();
  }

  pan(dx, dy) {
    this.left -= dx / this.scale;
    this.top -= dy / this.scale;
    this.fitted = false;
    this.place();
  }

  /** Keeps the image on the screen, and its pixels on whole ones of the screen. */
  place(ask = true) {
    const inside = (at, size, screen) => {
      const shown = screen / this.scale;
      const kept = shown >= size ? (size - shown) / 2 : Math.min(size - shown, Math.max(0, at));
      return Math.round(kept * this.scale) / this.scale;
    };
    this.left = inside(this.left, this.image.width, this.canvas.width);
    this.top = inside(this.top, this.image.height, this.canvas.height);
    if (ask) this.ask();
    this.draw();
  }

  /** The part of the image that the canvas shows, as the server wants it. */
  view() {
    const {width, height} = this.image;
    if (!width) return {x: 0, y: 0, w: 0, h: 0, bin: 4, reduce: this.reduce, max_hz: PICTURES_PER_S};
    const bin = Math.min(MOST_BIN, Math.max(1, 2 ** Math.floor(Math.log2(1 / this.scale))));
    const from = (at) => Math.max(0, Math.floor(at / bin) * bin);
    const x = from(this.left), y = from(this.top);
    return {x, y, w: Math.min(width, Math.ceil(this.left + this.canvas.width / this.scale)) - x,
            h: Math.min(height, Math.ceil(this.top + this.canvas.height / this.scale)) - y, bin, reduce: this.reduce, max_hz: PICTURES_PER_S};
  }
  ask() { this.wants(this.view()); }

  /** Position in the image of one on the canvas, and back. */
  toImage(px, py) { return {x: this.left + px / this.scale, y: this.top + py / this.scale}; }
  toScreen(x, y) { return {x: (x - this.left) * this.scale, y: (y - this.top) * this.scale}; }

  /** What is known of pixel (x, y): {dn, bin, reduce}, the block it stands for; null: not shown. */
  probe(x, y) {
    const p = this.picture;
    if (!p || x < p.x || y < p.y || x >= p.x + p.w || y >= p.y + p.h) return null;
    const column = Math.floor((x - p.x) / p.bin), line = Math.floor((y - p.y) / p.bin);
    if (y >= p.rows && p.rows > 0) return null;
    return {dn: p.pixels[line * p.columns + column], bin: p.bin, reduce: p.reduce, x: p.x + column * p.bin, y: p.y + line * p.bin};
  }
}
