// SPDX-License-Identifier: Apache-2.0
// Picture on a canvas: zoom, position, stretch, comparison, and which part of the image is wanted from the server.
import {differenceOf, viewOf} from "./frames.js";
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
    this.numbers = false; // whether digital numbers are needed, and not only a picture
    this.held = false;
    this.frozen = null; // the whole frame that is held
    this.compare = {mode: "off", reference: null, other: false};
  }

  resize(width, height) {
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    if (this.fitted) this.fit();
    else this.place();
  }

  /** A picture of the server; one that comes while another is held is passed over. */
  show(picture) {
    if (this.held) return;
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

  /** Holds the picture that is shown; false: goes on. */
  hold(held) {
    this.held = held;
    this.frozen = null;
    if (!held) this.ask();
  }

  /** The frame that is held, so that all of it can be looked at. */
  freeze(frame) {
    this.frozen = frame;
    this.ask();
  }

  /** `mode`: off, blink (the reference while `other`), difference. `reference`: a whole frame, or null. */
  setCompare(compare) {
    this.compare = compare;
    this.develop();
  }

  /** Pixels of the reference as those of the picture are shown; null: there are none. */
  reference() {
    const {picture: p, compare: {reference}} = this;
    if (!p?.pixels || !reference || reference.width !== p.imageWidth || reference.height !== p.imageHeight) return null;
    const key = [reference.id, p.x, p.y, p.w, p.h, p.bin, p.reduce].join();
    if (this.referenceKey !== key) {
      this.referenceKey = key;
      this.referencePixels = viewOf(reference, p).pixels;
    }
    return this.referencePixels;
  }

  setStretch(stretch) {
    this.stretch = stretch;
    this.develop();
  }

  setReduce(reduce) {
    this.reduce = reduce;
    this.ask();
  }

  setNumbers(numbers) {
    if (this.numbers === numbers) return;
    this.numbers = numbers;
    this.ask();
  }

  /** Digital numbers to grey; a JPEG is so already. */
  develop() {
    const p = this.picture;
    this.difference = null;
    if (p?.bitmap) {
      this.source.width = p.columns;
      this.source.height = p.lines;
      this.source.getContext("2d").drawImage(p.bitmap, 0, 0);
    } else if (p) {
      const {kind} = this.stretch, {mode, other} = this.compare, reference = mode === "off" ? null : this.reference();
      this.ends = endsOf(kind, kind === "linear" || kind === "manual" ? null : countsOf(p.pixels), p.pixels.length, p.bits, this.stretch);
      const table = tableOf(kind, this.ends);
      this.source.width = p.columns;
      this.source.height = p.lines;
      const grey = new Uint32Array(p.pixels.length), shown = reference && mode === "blink" && other ? reference : p.pixels;
      if (reference && mode === "difference") {
        // Middle grey where nothing differs; the largest difference is white or black.
        const {values, least, most} = this.difference = differenceOf(p.pixels, reference), scale = 127 / Math.max(1, -least, most);
        for (let i = 0; i < grey.length; ++i) grey[i] = 0xff000000 | Math.round(128 + scale * values[i]) * 0x10101;
      } else {
        for (let i = 0; i < grey.length; ++i) grey[i] = table[shown[i]];
      }
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
    if (!width) return {x: 0, y: 0, w: 0, h: 0, bin: 4, reduce: this.reduce, max_hz: PICTURES_PER_S, enc: this.encoding(4)};
    const bin = Math.min(MOST_BIN, Math.max(1, 2 ** Math.floor(Math.log2(1 / this.scale))));
    const from = (at) => Math.max(0, Math.floor(at / bin) * bin);
    const x = from(this.left), y = from(this.top);
    return {x, y, w: Math.min(width, Math.ceil(this.left + this.canvas.width / this.scale)) - x,
            h: Math.min(height, Math.ceil(this.top + this.canvas.height / this.scale)) - y, bin, reduce: this.reduce, max_hz: PICTURES_PER_S, enc: this.encoding(bin)};
  }

  /** "auto": JPEG will do where the server's share for all viewers would make bins larger. Single pixels are always numbers. */
  encoding(bin) { return this.numbers || bin === 1 ? "u16" : "auto"; }

  ask() {
    if (!this.frozen) {
      this.wants(this.view());
      return;
    }
    this.picture = {...this.picture, ...viewOf(this.frozen, this.view()), bitmap: null, rateLowered: false, viewLowered: false};
    this.develop();
  }

  /** Position in the image of one on the canvas, and back. */
  toImage(px, py) { return {x: this.left + px / this.scale, y: this.top + py / this.scale}; }
  toScreen(x, y) { return {x: (x - this.left) * this.scale, y: (y - this.top) * this.scale}; }

  /** What is known of pixel (x, y): {dn, reference, bin, reduce, x, y}, the block it stands for; null: not shown. */
  probe(x, y) {
    const p = this.picture;
    if (!p?.pixels || x < p.x || y < p.y || x >= p.x + p.w || y >= p.y + p.h) return null;
    const column = Math.floor((x - p.x) / p.bin), line = Math.floor((y - p.y) / p.bin);
    if (y >= p.rows && p.rows > 0) return null;
    const at = line * p.columns + column, reference = this.compare.reference && this.reference();
    return {dn: p.pixels[at], reference: reference?.[at], bin: p.bin, reduce: p.reduce, x: p.x + column * p.bin, y: p.y + line * p.bin};
  }
}
