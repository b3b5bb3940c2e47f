// What is on the screen: the whole panorama, or a view into it with a map; the scale under both.

import { Aids } from '/aids.js';
import { Projection, View, anglesOf, nextTo } from '/geometry.js';
import { Level } from '/level.js';
import { Look } from '/look.js';
import { Scale } from '/scale.js';
import { Whole } from '/whole.js';

const $ = (id) => document.getElementById(id);
const MAP_SHARE = 0.24; // of the height, at most
const BESIDE = 1.5; // rad: no bearing further from the view's middle is on its scale

export class Screen {
  constructor() {
    this.view = new View();
    this.scale = new Scale($('scale'));
    this.whole = new Whole($('whole'));
    this.map = new Whole($('map'));
    this.level = new Level();
    this.aids = new Aids(this);
    this.projection = this.bitmap = this.pointer = this.frame = null;
    try {
      this.look = new Look($('look'));
    } catch (error) {
      this.look = null;
      $('toggle').disabled = true;
      $('toggle').title = `Looking around is not possible: ${error.message}`;
    }
    this.mode = this.look && innerWidth < innerHeight ? 'look' : 'whole';
    new ResizeObserver(() => this.arrange()).observe(document.querySelector('main'));
  }

  get mode() {
    return document.body.dataset.mode;
  }

  set mode(mode) {
    document.body.dataset.mode = mode;
    const other = mode === 'look' ? 'whole' : 'look';
    $('toggle').querySelector('use').setAttribute('href', `/icon.svg#${other}`);
    $('toggle').querySelector('span').textContent = mode === 'look' ? 'Whole' : 'Look around';
    this.pointer = null;
    this.arrange();
  }

  /** Take what the panorama shows: the state's `projection`; an Error if that cannot be drawn. */
  place(projection) {
    if (JSON.stringify(projection) === JSON.stringify(this.projection)) return;
    this.projection = null;
    this.projection = new Projection(projection);
    this.view.keepTo(this.projection);
    this.arrange();
  }

  /** Show a picture, levelled; settled when it is on the screen. */
  async show(plain, orientation = null) {
    const bitmap = this.level.levelled(plain, this.projection, orientation);
    this.bitmap?.close();
    this.bitmap = bitmap;
    await this.redraw();
  }

  /** How wide a picture can be, px. */
  get widest() {
    return this.look?.widest ?? Infinity;
  }

  /** Give each canvas its place for the mode, and as many pixels as the screen has there. */
  arrange() {
    const main = document.querySelector('main');
    const aspect = this.projection ? this.projection.width / this.projection.height : 2.4;
    const rest = main.clientHeight - $('scale').offsetHeight - $('rear').offsetHeight;
    const fit = (canvas, height) => {
      const width = Math.min(main.clientWidth, height * aspect);
      canvas.style.width = `${width}px`;
      canvas.style.height = `${width / aspect}px`;
    };
    fit($('whole'), rest);
    fit($('map'), MAP_SHARE * rest);
    $('scale').style.width = this.mode === 'look' ? '100%' : $('whole').style.width;
    for (const canvas of document.querySelectorAll('canvas')) {
      canvas.width = Math.round(canvas.clientWidth * devicePixelRatio);
      canvas.height = Math.round(canvas.clientHeight * devicePixelRatio);
    }
    this.redraw();
  }

  /** Draw with the next frame of the screen; settles when that is done. */
  redraw() {
    this.frame ??= new Promise((done) => {
      requestAnimationFrame(() => {
        this.frame = null;
        this.draw();
        done();
      });
    });
    return this.frame;
  }

  draw() {
    const { bitmap, projection, view } = this;
    if (!bitmap || !projection) return;
    if (this.mode === 'look') {
      this.look.draw(bitmap, projection, view);
      this.map.draw(bitmap, projection, view, $('look').width / $('look').height);
    } else {
      this.whole.draw(bitmap, projection);
    }
    this.scale.draw((bearing) => this.column(bearing), ...this.onScale);
    this.aids.draw();
    this.point();
  }

  /** The canvas that shows the picture. */
  get shown() {
    return this.mode === 'look' ? $('look') : $('whole');
  }

  /** Bearing of the middle of the picture. */
  get middle() {
    return this.angles(this.shown, this.shown.clientWidth / 2, this.shown.clientHeight / 2)[0];
  }

  /** Where a ray lies on the picture, CSS px; null for nowhere. */
  locate(ray) {
    const { clientWidth: width, clientHeight: height } = this.shown;
    if (this.mode === 'look') {
      const point = this.view.point(ray);
      return point && [width / 2 + this.focal * point[0], height / 2 + this.focal * point[1]];
    }
    const pixel = this.projection.pixel(ray);
    return pixel && pixel.map((p) => ((p + 0.5) / this.projection.width) * width);
  }

  /** The first and the last bearing that may be on the scale. */
  get onScale() {
    if (this.mode !== 'look') return this.projection.sides;
    const [{ left, right }, { yaw }] = [this.projection.limits, this.view];
    return [Math.max(left, yaw - BESIDE), Math.min(right, yaw + BESIDE)];
  }

  /** Where a bearing, as the columns have it, lies on the scale, CSS px; null for nowhere. */
  column(bearing) {
    const { view, projection } = this;
    if (this.mode === 'look') {
      const aside = nextTo(0, bearing - view.yaw);
      if (Math.abs(aside) > BESIDE) return null;
      return $('look').clientWidth / 2 + this.focal * Math.tan(aside) * Math.cos(view.pitch);
    }
    const pixel = projection.pixel([Math.sin(bearing), 0, Math.cos(bearing)], bearing);
    return pixel && ((pixel[0] + 0.5) / projection.width) * $('whole').clientWidth;
  }

  /** Focal length of the view, CSS px. */
  get focal() {
    return this.view.focal($('look').clientWidth, $('look').clientHeight);
  }

  /** [bearing, angle above the horizon] at a place of a canvas, CSS px. */
  angles(canvas, x, y) {
    const { projection } = this;
    if (canvas === $('look')) {
      const { clientWidth: width, clientHeight: height } = canvas;
      return anglesOf(this.view.ray((x - width / 2) / this.focal, (y - height / 2) / this.focal));
    }
    const scale = projection.width / canvas.clientWidth;
    return projection.angles(x * scale - 0.5, y * scale - 0.5);
  }

  /** Show the bearing under the pointer, or of the middle where there is none. */
  point() {
    const { shown } = this;
    const middle = [shown, shown.clientWidth / 2, shown.clientHeight / 2];
    const [canvas, x, y] = this.pointer ?? middle;
    const angles = this.angles(canvas, x, y);
    this.scale.point(canvas === shown ? x : this.column(angles[0]), angles);
  }
}
