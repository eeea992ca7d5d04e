// SPDX-License-Identifier: Apache-2.0
// WebSocket of live pictures: at most one picture on its way, the next one when `ready()` says that this one is drawn.
import {token} from "./api.js";

const HEADER = 80, VERSION = 1;

/** Head of a picture and its pixels, or its `jpeg` (bytes); null: not one of this version. */
export function pictureOf(buffer) {
  if (buffer.byteLength < HEADER) return null;
  const view = new DataView(buffer);
  const magic = String.fromCharCode(...new Uint8Array(buffer, 0, 4));
  if (magic !== "OBSV" || view.getUint16(4, true) !== VERSION || view.getUint8(51) > 1) return null;
  const u16 = (at) => view.getUint16(at, true), flags = view.getUint32(12, true), bin = u16(48);
  const picture = {
    camera: view.getUint32(8, true), rateLowered: (flags & 1) !== 0, viewLowered: (flags & 2) !== 0,
    frame: view.getBigUint64(16, true), trigger: view.getBigUint64(24, true), edgeTaiNs: view.getBigInt64(32, true),
    x: u16(40), y: u16(42), w: u16(44), h: u16(46), bin, reduce: view.getUint8(50) ? "mean" : "max",
    bits: view.getUint8(52), rows: u16(54), skipped: view.getUint32(56, true), imageWidth: u16(60), imageHeight: u16(62),
    id: String(view.getBigUint64(64, true)), madeTaiNs: view.getBigInt64(72, true), cameAt: performance.now(),
  };
  const at = u16(6);
  picture.columns = Math.ceil(picture.w / bin);
  picture.lines = Math.ceil(picture.h / bin);
  if (view.getUint8(51) === 1) return {...picture, jpeg: new Uint8Array(buffer, at)};
  if (at % 2 || buffer.byteLength < at + 2 * picture.columns * picture.lines) return null;
  picture.pixels = new Uint16Array(buffer, at, picture.columns * picture.lines);
  return picture;
}

/** Time since the edge of a picture's frame, s: by the server's clock until it was made, and what has gone by here since. Null: not known. */
export function ageOf(picture) {
  if (!picture?.madeTaiNs) return null;
  return Number(picture.madeTaiNs - picture.edgeTaiNs) / 1e9 + (performance.now() - picture.cameAt) / 1e3;
}

/** Live pictures of one camera. Calls `on.picture(picture)`, `on.histogram(figures)` and `on.note(line)`, "": all is well. Connects
 *  again after a second, as long as it is not closed. */
export class LiveSocket {
  constructor(view, on) {
    this.view = view;
    this.on = on;
    this.closed = false;
    this.owed = false; // whether the server waits for `ready`
    this.busy = 0; // works in progress of `during`
    this.onVisible = () => { if (!document.hidden && this.owed) this.ready(); };
    document.addEventListener("visibilitychange", this.onVisible);
    this.connect();
  }

  connect() {
    const url = new URL("api/v1/live", location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.hash = "";
    const socket = this.socket = new WebSocket(url, "obscura.v1");
    socket.binaryType = "arraybuffer";
    let opened = false, why = "";
    socket.onopen = () => {
      opened = true;
      this.send({token});
      this.send({view: this.view});
      this.sent = JSON.stringify(this.view);
    };
    socket.onmessage = (message) => {
      if (typeof message.data !== "string") {
        const picture = pictureOf(message.data);
        this.owed = true;
        if (picture) this.on.picture(picture);
        else this.on.note("The pictures are of another version than this page: load it again.");
        return;
      }
      const told = JSON.parse(message.data);
      if (told.histogram) this.on.histogram(told.histogram);
      if (told.error || told.gone) this.on.note(why = told.error ?? told.gone);
      // The server forgets the view of a camera that does not answer, which a busy daemon may do for a while, too.
      if (told.gone) this.again = setTimeout(() => { if (this.socket === socket) this.send({view: this.view}); }, 1000);
    };
    socket.onclose = (event) => {
      if (this.closed || this.socket !== socket) return;
      this.on.note(why || event.reason || (opened ? "The pictures have ended; connecting again." : "No live pictures: this obscura-web does not send them."));
      this.retry = setTimeout(() => this.connect(), opened ? 1000 : 5000);
    };
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  setView(view) {
    this.view = view;
    const text = JSON.stringify(view);
    if (text === this.sent || this.socket.readyState !== WebSocket.OPEN) return;
    this.sent = text;
    this.send({view});
  }

  /** Asks for the next picture, unless the page is hidden: then once it is seen again. */
  ready() {
    if (document.hidden || this.held || this.busy) { this.owed = true; return; }
    this.owed = false;
    this.send({ready: true});
  }

  /** Holds the picture that is shown; false: goes on. */
  hold(held) {
    this.held = held;
    if (!held && this.owed) this.ready();
  }

  /** Asks for no picture until `work()` has ended, so that the server keeps the frame that is shown. */
  async during(work) {
    ++this.busy;
    try {
      return await work();
    } finally {
      --this.busy;
      if (this.owed) this.ready();
    }
  }

  close() {
    this.closed = true;
    clearTimeout(this.retry);
    clearTimeout(this.again);
    document.removeEventListener("visibilitychange", this.onVisible);
    // One that is still connecting closes once it is open: browsers complain of it before.
    const {socket} = this;
    if (socket.readyState === WebSocket.CONNECTING) socket.onopen = () => socket.close();
    else socket.close();
  }
}
