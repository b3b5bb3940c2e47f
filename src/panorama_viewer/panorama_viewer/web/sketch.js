// Lines and words over the picture, at rays.

const CASING = 'rgb(0 0 0 / 60%)'; // around what is whole, so that it is seen on any ground

export class Sketch {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext('2d');
  }

  /**
   * Begin anew. `locate` gives the place of a ray, CSS px, or null for nowhere; `wraps`: what
   * leaves at one side may come in at the other.
   */
  begin(locate, wraps) {
    const { pen, canvas } = this;
    this.locate = locate;
    this.written = []; // places of words: none is written over another
    this.longest = wraps ? canvas.clientWidth / 2 : Infinity;
    this.size = parseFloat(getComputedStyle(canvas).fontSize);
    pen.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    pen.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
    pen.lineJoin = 'round';
  }

  /** Draw a line through rays, so many of them that its pieces are straight. */
  line(rays, color, { width = 2, dash = [] } = {}) {
    const { pen } = this;
    const path = new Path2D();
    let last = null;
    for (const ray of rays) {
      const place = this.locate(ray);
      const isJoined = place && last && Math.abs(place[0] - last[0]) < this.longest;
      if (place) path[isJoined ? 'lineTo' : 'moveTo'](...place);
      last = place;
    }
    const scale = this.size / 13;
    pen.setLineDash(dash.map((length) => length * scale));
    for (const [style, more] of dash.length ? [[color, 0]] : [[CASING, 2], [color, 0]]) {
      pen.strokeStyle = style;
      pen.lineWidth = (width + more) * scale;
      pen.stroke(path);
    }
  }

  /** Write at a ray, beside it where `align` says so ('left': to the right of it). */
  words(ray, text, color, align = 'center') {
    const place = this.locate(ray);
    if (!place) return;
    const { pen, size } = this;
    const [x, y] = [place[0] + { left: size / 2, center: 0, right: -size / 2 }[align], place[1]];
    const isOver = ([left, top]) => Math.abs(x - left) < 3 * size && Math.abs(y - top) < size;
    if (this.written.some(isOver)) return;
    this.written.push([x, y]);
    pen.font = `600 ${size}px ${getComputedStyle(this.canvas).fontFamily}`;
    pen.textAlign = align;
    pen.textBaseline = 'middle';
    pen.setLineDash([]);
    pen.strokeStyle = CASING;
    pen.lineWidth = size / 4;
    pen.strokeText(text, x, y);
    pen.fillStyle = color;
    pen.fillText(text, x, y);
  }
}
