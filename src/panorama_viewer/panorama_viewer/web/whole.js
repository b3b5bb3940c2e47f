// The whole panorama on a canvas; with the outline of a view it is a map.

const POINTS = 24; // on each side of the outline

export class Whole {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext('2d');
  }

  draw(bitmap, projection, view = null, ratio = 1) {
    const { pen, canvas } = this;
    pen.imageSmoothingQuality = 'high';
    const [across, down] = projection.share(bitmap);
    const { displayWidth = bitmap.width, displayHeight = bitmap.height } = bitmap;
    const part = [0, 0, across * displayWidth, down * displayHeight];
    pen.drawImage(bitmap, ...part, 0, 0, canvas.width, canvas.height);
    if (view) this.outline(projection, view, ratio);
  }

  outline(projection, view, ratio) {
    const { pen, canvas } = this;
    const { width } = canvas;
    const scale = width / projection.width;
    const path = new Path2D();
    const near = view.near(projection);
    let last = null;
    for (const [u, v] of border(view, ratio)) {
      const pixel = projection.pixel(view.ray(u, v), near);
      let [x, y] = pixel ? pixel.map((p) => (p + 0.5) * scale) : [];
      if (projection.wraps && last !== null) x -= width * Math.round((x - last) / width);
      const joined = pixel && last !== null && Math.abs(x - last) < width / 2;
      if (pixel) path[joined ? 'lineTo' : 'moveTo'](x, y);
      last = pixel ? x : null;
    }
    // What goes on beyond one edge comes in at the other.
    const outline = new Path2D();
    for (const aside of projection.wraps ? [-width, 0, width] : [0]) {
      outline.addPath(path, new DOMMatrix([1, 0, 0, 1, aside, 0]));
    }
    for (const [color, width] of [['rgb(0 0 0 / 60%)', 4], ['#fff', 1.6]]) {
      pen.strokeStyle = color;
      pen.lineWidth = width * devicePixelRatio;
      pen.stroke(outline);
    }
  }
}

/** Points (u, v) once around the edge of a view whose size has this ratio of width to height. */
function* border(view, ratio) {
  const u = (ratio > 1 ? 1 : ratio) / view.focal(2, 2);
  const v = (ratio > 1 ? 1 / ratio : 1) / view.focal(2, 2);
  const corners = [[-u, -v], [u, -v], [u, v], [-u, v]];
  for (let i = 0; i <= 4 * POINTS; i++) {
    const [a, b] = [corners[Math.floor(i / POINTS) % 4], corners[(Math.floor(i / POINTS) + 1) % 4]];
    const t = (i % POINTS) / POINTS;
    yield [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
  }
}
