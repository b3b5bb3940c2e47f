// Where a pixel of the panorama looks, and the virtual camera that looks into it.
// Rays are [x right, y down, z ahead]; angles are radians, bearings positive to the right.

/**
 * How each kind of surface maps rays, in focal lengths from its centre: ray (a, b) => [x, y, z],
 * point [x, y, z] => [a, b] or null, both once more as GLSL for the shader, and whether its
 * columns are bearings, so that it can lead all around.
 */
export const SURFACES = {
  cylindrical: {
    columnsAreBearings: true,
    ray: (a, b) => [Math.sin(a), b, Math.cos(a)],
    point: ([x, y, z]) => [Math.atan2(x, z), y / Math.hypot(x, z)],
    shader: 'vec2(atan(ray.x, ray.z), ray.y / length(ray.xz))',
    unfold: 'vec3(sin(point.x), point.y, cos(point.x))',
  },
  equirectangular: {
    columnsAreBearings: true,
    ray: (a, b) => [Math.cos(b) * Math.sin(a), Math.sin(b), Math.cos(b) * Math.cos(a)],
    point: ([x, y, z]) => [Math.atan2(x, z), Math.atan2(y, Math.hypot(x, z))],
    shader: 'vec2(atan(ray.x, ray.z), atan(ray.y, length(ray.xz)))',
    unfold: 'vec3(cos(point.y) * sin(point.x), sin(point.y), cos(point.y) * cos(point.x))',
  },
  rectilinear: {
    columnsAreBearings: false,
    ray: (a, b) => [a, b, 1],
    point: ([x, y, z]) => (z > 0 ? [x / z, y / z] : null),
    shader: 'ray.z > 0.0 ? ray.xy / ray.z : vec2(1e9)',
    unfold: 'vec3(point, 1.0)',
  },
};

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** What the panorama shows: a message of panorama/projection. */
export class Projection {
  constructor(message) {
    Object.assign(this, message);
    if (!Object.hasOwn(SURFACES, this.surface)) {
      throw new Error(`this page cannot show a ${this.surface} panorama; `
        + `expected ${Object.keys(SURFACES).join(', ')}`);
    }
  }

  /** How the surface maps rays. No property of its own: those are what the message says. */
  get kind() {
    return SURFACES[this.surface];
  }

  /** What of an image's width and height is the panorama's: video has even sides. */
  share({ displayWidth, displayHeight }) {
    return [
      displayWidth - this.width === 1 ? this.width / displayWidth : 1,
      displayHeight - this.height === 1 ? this.height / displayHeight : 1,
    ];
  }

  /** Ray of a pixel; integers are pixel centres. */
  ray(x, y) {
    return this.kind.ray((x - this.center_x_px) / this.focal_px,
      (y - this.center_y_px) / this.focal_px);
  }

  /**
   * Pixel [x, y] of a ray; null where the surface cannot show it. Of columns a turn apart, it is
   * in the one whose bearing is next to `near`.
   */
  pixel(ray, near = this.middle) {
    const point = this.kind.point(ray);
    if (!point) return null;
    const a = this.kind.columnsAreBearings ? nextTo(near, point[0]) : point[0];
    return [this.center_x_px + this.focal_px * a, this.center_y_px + this.focal_px * point[1]];
  }

  /** The pixel's [bearing, angle above the horizon]; bearings go on beyond half a turn. */
  angles(x, y) {
    const [bearing, up] = anglesOf(this.ray(x, y));
    return [this.kind.columnsAreBearings ? (x - this.center_x_px) / this.focal_px : bearing, up];
  }

  /** Bearing of the middle column. */
  get middle() {
    return this.angles((this.width - 1) / 2, this.center_y_px)[0];
  }

  /** Whether some bearings have two columns, as frames side by side may have. */
  get repeats() {
    return this.kind.columnsAreBearings && this.width - 1 > 2 * Math.PI * this.focal_px;
  }

  /** Bearings of the left and the right edge. */
  get sides() {
    return [-0.5, this.width - 0.5].map((x) => this.angles(x, this.center_y_px)[0]);
  }

  /** The same, infinite where one can turn on; angles above the horizon of the other edges. */
  get limits() {
    const [, top] = this.angles(this.center_x_px, -0.5);
    const [, bottom] = this.angles(this.center_x_px, this.height - 0.5);
    const [left, right] = this.wraps ? [-Infinity, Infinity] : this.sides;
    return { left, right, top, bottom };
  }
}

/** The same direction as a bearing, at most half a turn from `near`. */
export function nextTo(near, bearing) {
  return bearing - 2 * Math.PI * Math.round((bearing - near) / (2 * Math.PI));
}

/** [bearing, angle above the horizon] of a ray. */
export function anglesOf([x, y, z]) {
  return [Math.atan2(x, z), -Math.atan2(y, Math.hypot(x, z))];
}

const START = { yaw: 0, pitch: 0, fov: Math.PI / 2 };
const NARROWEST = Math.PI / 36;
const WIDEST = (120 / 180) * Math.PI;
const NEAREST = 0.02; // cosine of a ray's angle to the view's axis, for one that has a place

/** A camera without distortion that is turned about the vertical and up or down. */
export class View {
  constructor() {
    this.reset();
  }

  /** Look straight ahead; where the panorama does not hold that, at its middle. */
  reset(projection = null) {
    Object.assign(this, START);
    if (!projection) return;
    const ahead = nextTo(projection.middle, this.yaw);
    const { left, right } = projection.limits;
    this.turnTo(left <= ahead && ahead <= right ? ahead : projection.middle, 0, projection);
  }

  /** Start anew where one would look outside a panorama that has come or changed. */
  keepTo(projection) {
    const { left, right, top, bottom } = projection.limits;
    const isWithin = (yaw) => left <= yaw && yaw <= right;
    if (!isWithin(this.yaw)) this.yaw = nextTo(projection.middle, this.yaw);
    const isSeen = isWithin(this.yaw) && bottom <= this.pitch && this.pitch <= top;
    if (!isSeen) this.reset(projection);
  }

  /** Next to which bearing the columns of a panorama are that this view shows. */
  near({ repeats, middle }) {
    return repeats ? this.yaw : middle;
  }

  /** Focal length for a picture of this size; `fov` spans its longer side. */
  focal(width, height) {
    return Math.max(width, height) / 2 / Math.tan(this.fov / 2);
  }

  /** Ray of the point (u, v) right of and below the centre, in focal lengths. */
  ray(u, v) {
    const [cp, sp, cy, sy] = [Math.cos(this.pitch), Math.sin(this.pitch),
      Math.cos(this.yaw), Math.sin(this.yaw)];
    const [y, z] = [v * cp - sp, v * sp + cp];
    return [u * cy + z * sy, y, z * cy - u * sy];
  }

  /** Point (u, v) of a ray; null for one that is not clearly before the view. */
  point(ray) {
    const along = ([x, y, z]) => x * ray[0] + y * ray[1] + z * ray[2];
    const middle = this.ray(0, 0);
    const depth = along(middle);
    if (!(depth > NEAREST * Math.hypot(...ray))) return null;
    return [along(this.ray(1, 0)) / depth - 1, along(this.ray(0, 1)) / depth - 1];
  }

  /** Look at a bearing and an angle above the horizon, as far as the panorama goes. */
  turnTo(yaw, pitch, projection) {
    const { left, right, top, bottom } = projection.limits;
    this.yaw = clamp(Number.isFinite(left) ? yaw : nextTo(0, yaw), left, right);
    this.pitch = clamp(pitch, bottom, top);
  }

  /** Make things `factor` times as large. */
  zoom(factor) {
    const half = Math.atan(Math.tan(this.fov / 2) / factor);
    this.fov = clamp(2 * half, NARROWEST, WIDEST);
  }
}
