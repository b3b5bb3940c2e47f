// A panorama of a robot that nods, turned until it is level: the whole page shows it so.

import { Look } from '/look.js';

export class Level {
  constructor() {
    this.rows = null; // of the rotation of the rays of the picture as it came to level ones
  }

  /** Return the picture as it would be on the same surface, were it level; uses the bitmap up. */
  levelled(bitmap, projection, orientation) {
    this.rows = null;
    // Frames side by side are at no true bearings by which they could be turned.
    if (!orientation || !projection || projection.repeats) return bitmap;
    try {
      this.look ??= new Look(new OffscreenCanvas(1, 1));
    } catch {
      return bitmap; // without WebGL it is shown as it is
    }
    const { canvas } = this.look;
    const { displayWidth = bitmap.width, displayHeight = bitmap.height } = bitmap;
    const [across, down] = projection.share(bitmap);
    const [width, height] = [Math.round(across * displayWidth), Math.round(down * displayHeight)];
    if (canvas.width !== width || canvas.height !== height) {
      [canvas.width, canvas.height] = [width, height];
    }
    this.rows = matrix(orientation);
    this.look.turn(bitmap, projection, this.rows);
    bitmap.close();
    return canvas.transferToImageBitmap();
  }

  /** The ray at which the picture shows what it had at this one before it was levelled. */
  ray([x, y, z]) {
    if (!this.rows) return [x, y, z];
    return [0, 3, 6].map((i) => this.rows[i] * x + this.rows[i + 1] * y + this.rows[i + 2] * z);
  }
}

/** Rows of the rotation of a unit quaternion [x, y, z, w], one behind the other. */
function matrix([x, y, z, w]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
    2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
    2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
  ];
}
